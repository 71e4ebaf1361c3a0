"""Faults of the other sign, for the studies: what reads too low reads too high by as much, and so on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cosim import Scenario
from cosim.run.component_models import make_system, values_in_use
from plant_models.faults.fault_system import FaultSystem


class Error(NamedTuple):
    """What a reading y becomes: ``gain y + offset``, and `drift` more in every second."""

    gain: float = 1.0
    offset: float = 0.0
    drift: float = 0.0

    @property
    def turned(self) -> Error:
        """The same error with the other sign: 10 % too low becomes 10 % too high, nothing at all twice as much."""
        return Error(2.0 - self.gain, -self.offset, -self.drift)


NONE = Error()


def turned(chosen: Scenario) -> Scenario:
    """The scenario with all given faults of its wheels and signals turned: jams are skids, what is low is high.

    Args:
        chosen: changed and returned.

    Raises:
        ValueError: faults are drawn: their signs follow from the effort.
    """
    for name, table in chosen.table().components.items():
        system = make_system(table, str(chosen)) if table.model is not None else None
        if not isinstance(system, FaultSystem):
            continue
        values = system.cause.turned(values_in_use(table, system))
        if values is None:
            raise ValueError(
                f"{name} draws its faults: jams of a braked and skids of a driven wheel have no other sign"
            )
        for parameter, value in values.items():
            chosen.set(f"{name}.{parameter}", np.asarray(value))
    return chosen

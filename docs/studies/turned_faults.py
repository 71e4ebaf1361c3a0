"""Faults of the other sign, for the studies: what reads too low reads too high by as much, and so on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cosim import Scenario
from cosim.run.component_models import make_system, values_in_use


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
        if str(table.model) not in _TURNS:
            continue
        system: Any = make_system(table, str(chosen))
        if getattr(system, "cause", "given") != "given":
            raise ValueError(
                f"{name} draws its faults: jams of a braked and skids of a driven wheel have no other sign"
            )
        values = values_in_use(table, system)
        for parameter, turn in _TURNS[str(table.model)].items():
            chosen.set(f"{name}.{parameter}", turn(values))
    return chosen


def _plain(values: np.ndarray) -> float | Sequence[float]:
    return float(values) if np.ndim(values) == 0 else np.asarray(values).tolist()  # type: ignore[no-any-return]


_TURNS = {
    "wheel_fault": {"fault_kind": lambda p: _plain(-np.asarray(p.fault_kind))},
    "signal_fault": {
        "fault_gain": lambda p: _plain(Error(np.asarray(p.fault_gain)).turned.gain),  # type: ignore[arg-type]
        "fault_offset": lambda p: _plain(-np.asarray(p.fault_offset)),
    },
}

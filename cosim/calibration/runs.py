"""What is calibrated: something that can be run with other parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.least_squares import Fit, unseen_directions
from cosim.calibration.recorded_signals import RecordedSignals
from fmus.fmi.units import NamedUnit, named_unit

Array = NDArray[np.float64]
LIMIT = 0.5
"""Standard deviation along a direction, relative to the sizes of the parameters, beyond which it is not identified."""


class Hidden(NamedTuple):
    """What a recording does not show of the parameters.

    Attributes:
        names: parameters that are not identified. text: a sentence with the reason.
    """

    names: tuple[str, ...]
    text: str


class Runs(ABC):
    """What can be run with other parameters.

    Attributes:
        failures: of runs since `prepare`, parameters and reason of each. outputs: signals that it has.
        inputs: inputs that a recording may drive. discrete: those that are no continuous ones.
        start: first guesses by name.
        bounds: lowest and highest value by name; those without an entry have none.
    """

    failures: Sequence[str] = ()
    outputs: tuple[str, ...]
    inputs: tuple[str, ...] = ()
    discrete: tuple[str, ...] = ()
    start: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]

    @abstractmethod
    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """Simulate with parameters.

        Args:
            values: by name. recorded: instants, inputs in the units of the model, and names of the signals.

        Returns:
            The signals at the instants in the units of the model, shape (q, n).
        """

    def run_all(self, points: Sequence[Mapping[str, float]], recorded: RecordedSignals) -> Array:
        """Simulate with several sets of parameters.

        Args:
            points: parameters of each run, by name. recorded: as for `run`.

        Returns:
            The signals, shape (m, q, n); those of a run that failed are no numbers.
        """
        return np.stack([self.run(values, recorded) for values in points])

    @abstractmethod
    def unit(self, name: str) -> str:
        """Unit of a signal or of a value that is fitted, empty where it is not known.

        Args:
            name: of it.
        """

    def named_unit(self, name: str) -> NamedUnit | None:
        """What the unit of a signal is; None where it is not known.

        Args:
            name: of it.
        """
        unit = self.unit(name)
        return None if unit in ("", "1") else named_unit(unit)

    def prepare(self, recorded: RecordedSignals) -> tuple[RecordedSignals, Mapping[str, float]]:
        """The part of a recording that is fitted, and first guesses by name, of what is fitted to it.

        Args:
            recorded: the whole, in the units of the model.

        Raises:
            CalibrationError: nothing can be fitted to it.
        """
        return recorded, self.start

    def hidden(self, found: Fit, names: Sequence[str], recorded: RecordedSignals, level: float) -> list[Hidden]:
        """What the recording does not show: directions along which the parameters are uncertain by half their size.

        Args:
            found: the fit. names: of its parameters. recorded: what was fitted. level: of the intervals.
        """
        return [Hidden(tuple(d.shares), d.explain()) for d in unseen_directions(found, names, LIMIT)]

    def remarks(self, found: Fit, names: Sequence[str], recorded: RecordedSignals) -> list[str]:
        """What else there is to know of a fit.

        Args:
            found: the fit. names: of its parameters. recorded: what was fitted.
        """
        return []

    def parameter_lines(self, values: Mapping[str, float]) -> dict[str, float]:
        """What stands in a scenario, by name: values found, and those that belong to them.

        Args:
            values: by name.
        """
        return dict(values)

    def close(self) -> None:  # noqa: B027 - most have opened nothing
        """Free what was opened."""


def in_words(values: Mapping[str, float]) -> str:
    """Parameters with their values.

    Args:
        values: by name.
    """
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())

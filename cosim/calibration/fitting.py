"""Calibrating: fit parameters to a recording, and say how well they are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.calibration.runs import Runs
from cosim.errors import nearest
from fmu_observer.identification.least_squares import Fit, fit, unseen_directions
from fmus.tables.numbers import number
from fmus.text_table import text_table

Array = NDArray[np.float64]
LIMIT = 0.5
"""Relative standard deviation beyond which a direction counts as not identified."""
ALIKE = 0.3
"""Correlation of neighbouring residuals from which the model is doubted."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Calibrated parameters.

    Attributes:
        names: of the parameters. units: of them, by name. start: first guesses by name. fit: the numbers.
        recorded: what was fitted. level: of the intervals. remarks: what to know.
    """

    names: tuple[str, ...]
    units: Mapping[str, str]
    start: Mapping[str, float]
    fit: Fit
    recorded: RecordedSignals
    level: float
    remarks: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return dict(zip(self.names, self.fit.parameters.tolist(), strict=True))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Ends of the confidence intervals by name, one parameter at a time."""
        halves = self.fit.half_widths(self.level)
        found = zip(self.names, self.fit.parameters, halves, strict=True)
        return {name: (float(value - half), float(value + half)) for name, value, half in found}

    @property
    def identified(self) -> bool:
        """Whether every direction of the parameters is seen."""
        return self.fit.converged and not unseen_directions(self.fit, self.names, LIMIT)

    def toml(self) -> str:
        """Parameters for a scenario, to be pasted below ``[components.NAME]``."""
        intervals = self.intervals
        lines = []
        for name, value in self.values.items():
            low, high = intervals[name]
            lines.append(
                f"parameters.{_key(name)} = {value!r}  # {100.0 * self.level:g} %: {low:.6g} to {high:.6g} "
                f"{self.units.get(name, '')}".rstrip()
            )
        return "\n".join(lines) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """Everything but the series as plain data."""
        intervals = self.intervals
        parameters = {
            name: {"value": value, "low": intervals[name][0], "high": intervals[name][1], "start": self.start[name]}
            for name, value in self.values.items()
        }
        signals = {
            name: {"noise": float(self.fit.noise[i]), "correlation": float(self.fit.correlation[i])}
            for i, name in enumerate(self.recorded.measured)
        }
        rest = {"level": self.level, "covariance": self.fit.covariance.tolist(), "runs": self.fit.runs}
        state = {"identified": self.identified, "remarks": list(self.remarks)}
        return {"parameters": parameters, "signals": signals} | rest | state

    def text(self) -> str:
        """Estimates, intervals, residuals and remarks for people."""
        intervals = self.intervals
        rows = [["parameter", "start", "estimate", f"{100.0 * self.level:g} % interval", "unit"]]
        for name, value in self.values.items():
            low, high = intervals[name]
            interval = f"{number(low, 5)} to {number(high, 5)}"
            rows.append([name, number(self.start[name], 5), number(value, 5), interval, self.units.get(name, "")])
        noise = [["signal", "residuals", "unit", "correlation"]]
        for i, name in enumerate(self.recorded.measured):
            unit = self.recorded.units.get(name, "")
            noise.append([name, number(float(self.fit.noise[i])), unit, number(float(self.fit.correlation[i]), 2)])
        time = self.recorded.time
        span = f"from {number(float(time[0]), 5)} to {number(float(time[-1]), 5)} s"
        head = f"{len(time)} samples {span}, {self.fit.runs} runs"
        tables = [*text_table(rows, left=(0, 4), heading=True), "", *text_table(noise, left=(0, 2), heading=True)]
        return "\n".join([head, "", *tables, "", *(f"- {remark}" for remark in self.remarks)]).rstrip()


def calibrate(
    runs: Runs,
    recorded: RecordedSignals,
    *,
    noise: Mapping[str, float] | None = None,
    level: float = 0.95,
) -> Calibration:
    """Fit the parameters of runs to a recording.

    Args:
        runs: what is run; its `start` names the parameters. recorded: what was measured.
        noise: standard deviations of the measured signals by name; what is left out is estimated from the residuals.
        level: probability with which an interval covers, between 0 and 1.

    Returns:
        The calibration.

    Raises:
        CalibrationError: a parameter changes nothing that was measured, the model gives no numbers, or too few samples.
    """
    names = tuple(runs.start)
    measured = np.array(list(recorded.measured.values()))
    if not 0.0 < level < 1.0:
        raise CalibrationError(f"level {level!r}: expected a probability between 0 and 1, for instance 0.95.")
    if np.isfinite(measured).sum() <= len(names):
        raise CalibrationError(
            f"{np.isfinite(measured).sum()} measured values for {len(names)} parameters; expected more of them."
        )
    low, high = (np.array([runs.bounds[name][i] for name in names]) for i in (0, 1))
    found = _fit(runs, recorded, measured, noise=_deviations(noise, recorded), low=low, high=high)
    _demand_effects(found, names, recorded)
    units = {name: runs.unit(name) for name in names}
    known = {name: runs.unit(name) or unit if unit == "1" else unit for name, unit in recorded.units.items()}
    recorded = replace(recorded, units=known)  # a table without units has those of the model
    return Calibration(
        names, units, dict(runs.start), found, recorded, level, tuple(_remarks(found, names, recorded, low, high))
    )


def _fit(runs: Runs, recorded: RecordedSignals, measured: Array, **limits: Any) -> Fit:
    """The fit, begun at the first guesses."""
    names = tuple(runs.start)
    start = np.array([runs.start[name] for name in names])

    def simulate(parameters: Array) -> Array:
        return runs.run(dict(zip(names, parameters.tolist(), strict=True)), recorded)

    try:
        return fit(simulate, start, measured, **limits)
    except ValueError as error:
        if isinstance(error, CalibrationError):
            raise
        raise CalibrationError(f"The fit cannot begin with these first guesses: {error}") from error


def _demand_effects(found: Fit, names: tuple[str, ...], recorded: RecordedSignals) -> None:
    """Refuse parameters that change nothing that was measured."""
    idle = [name for i, name in enumerate(names) if not np.any(found.jacobian[..., i])]
    if idle:
        signals = ", ".join(recorded.measured)
        driven = ", ".join(recorded.inputs) or "none"
        raise CalibrationError(
            f"{', '.join(idle)}: changes nothing in {signals} and cannot be calibrated from this recording. Leave it "
            f"out, or record signals, or a run, that it acts on. Inputs that the recording drives: {driven}."
        )


def _deviations(noise: Mapping[str, float] | None, recorded: RecordedSignals) -> Array | None:
    if not noise:
        return None
    for name, value in noise.items():
        if name not in recorded.measured:
            raise CalibrationError(f"noise of {name!r}: no such signal is fitted; {nearest(name, recorded.measured)}")
        if not value > 0.0:
            raise CalibrationError(f"noise of {name}: expected a standard deviation above 0 (got {value!r}).")
    left = [name for name in recorded.measured if name not in noise]
    if left:
        raise CalibrationError(f"noise: give it for all signals or for none; {', '.join(left)} is missing.")
    return np.array([float(noise[name]) for name in recorded.measured])


def _remarks(found: Fit, names: tuple[str, ...], recorded: RecordedSignals, low: Array, high: Array) -> list[str]:
    remarks = [] if found.converged else ["The fit did not come to rest; try other first guesses."]
    remarks += [f"Not identified: {d.explain()}." for d in unseen_directions(found, names, LIMIT)]
    for i, name in enumerate(names):
        near = 1e-6 * found.sizes[i]
        if found.parameters[i] - low[i] <= near or high[i] - found.parameters[i] <= near:
            remarks.append(f"{name} stands at the end of its range; its interval says nothing.")
    for i, signal in enumerate(recorded.measured):
        if found.correlation[i] > ALIKE:
            wider = np.sqrt((1.0 + min(found.correlation[i], 0.999)) / (1.0 - min(found.correlation[i], 0.999)))
            remarks.append(
                f"Neighbouring residuals of {signal} are alike (correlation {found.correlation[i]:.2f}): a sensor that "
                f"filters, or something that the model misses. Its share of the intervals is {wider:.2g} times wider; "
                "that covers noise of a sensor, not a model that is wrong. Look at the residuals."
            )
    return remarks


def _key(name: str) -> str:
    """The parameter behind its component, quoted where TOML needs it."""
    bare = name.rpartition(".")[2]
    return bare if bare.replace("_", "").isalnum() else f'"{bare}"'

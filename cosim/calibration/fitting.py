"""Calibrating: fit parameters to a recording, and say how well they are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.least_squares import Fit, NoSlopeError, fit
from cosim.calibration.model_units import in_units_of
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.calibration.runs import Hidden, Runs, in_words
from cosim.errors import nearest
from fmus.tables.numbers import instant, number
from fmus.tables.table import Column, Parts, Readable, Table, name_column, text_column

Array = NDArray[np.float64]
_ESTIMATE = (
    name_column("name", "parameter"),
    Column("start", "start", meaning="First guess", digits=5),
    Column("value", "estimate", digits=5),
)
_BEHIND = (
    text_column("unit", "unit"),
    text_column(
        "identified",
        "identified",
        "Whether the recording shows the parameter",
        write=lambda sure: "yes" if sure else "no",
    ),
)
_SIGNALS = (
    name_column("name", "signal"),
    Column("noise", "residuals", meaning="Standard deviation of measured less fitted values"),
    text_column("unit", "unit"),
    Column("correlation", "correlation", meaning="Of neighbouring residuals", digits=2),
    Column("samples_per_independent", "as one", meaning="Samples that say as much as one with white noise", digits=2),
)
_ROUNDING = 1e-6  # of what a signal varies: residuals below it are no noise


@dataclass(frozen=True, eq=False)
class Calibration(Readable):
    """Calibrated parameters.

    Attributes:
        names: of the parameters. units: of them, by name. start: first guesses by name. fit: the numbers.
        recorded: what was fitted. level: of the intervals. hidden: what the recording does not show of the parameters.
        remarks: what else to know. lines: values for a scenario by name, those that were not fitted among them.
    """

    names: tuple[str, ...]
    units: Mapping[str, str]
    start: Mapping[str, float]
    fit: Fit
    recorded: RecordedSignals
    level: float
    hidden: tuple[Hidden, ...]
    remarks: tuple[str, ...]
    lines: Mapping[str, float]

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
        """Whether all parameters are identified."""
        return self.fit.converged and not self.hidden

    @property
    def not_identified(self) -> set[str]:
        """Names of the parameters that are not identified."""
        return {name for hidden in self.hidden for name in hidden.names}

    def toml(self) -> str:
        """Parameters for a scenario, to be pasted below ``[components.NAME]``."""
        intervals, hidden = self.intervals, self.not_identified
        lines = []
        for name, value in self.lines.items():
            line = f"parameters.{_key(name)} = {value!r}"
            if name in intervals:
                low, high = intervals[name]
                line += (
                    f"  # {'not identified: ' if name in hidden else ''}{100.0 * self.level:g} %: {low:.6g} to "
                    f"{high:.6g} {self.units.get(name, '')}"
                )
            lines.append(line.rstrip())
        return "\n".join(lines) + "\n"

    def parameters(self) -> Table:
        """Estimates with their intervals."""
        intervals, hidden = self.intervals, self.not_identified
        rows = [
            [name, self.start[name], value, intervals[name], self.units.get(name, ""), name not in hidden]
            for name, value in self.values.items()
        ]
        interval = Column("interval", f"{100.0 * self.level:g} % interval", digits=5)
        return Table("parameters", (*_ESTIMATE, interval, *_BEHIND), rows)

    def signals(self) -> Table:
        """Residuals of what was fitted."""
        found, units = self.fit, self.recorded.units
        rows = [
            [name, float(found.noise[i]), units.get(name, ""), float(found.correlation[i]), float(independent)]
            for i, (name, independent) in enumerate(
                zip(self.recorded.measured, found.samples_per_independent, strict=True)
            )
        ]
        return Table("signals", _SIGNALS, rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the series as plain data."""
        parameters = {row.pop("name"): _ends(row) for row in self.parameters().data()}
        signals = {row.pop("name"): row for row in self.signals().data()}
        rest = {"level": self.level, "covariance": self.fit.covariance.tolist(), "runs": self.fit.runs}
        rest |= {"condition": self.fit.condition, "from": self.recorded.time[0], "to": self.recorded.time[-1]}
        state = {"identified": self.identified, "remarks": [*(h.text for h in self.hidden), *self.remarks]}
        return {"parameters": parameters, "signals": signals} | rest | state

    def parts(self) -> Parts:
        """Estimates, intervals, residuals and remarks for people."""
        time = self.recorded.time
        span = f"from {instant(float(time[0]))} to {instant(float(time[-1]))} s"
        head = f"{len(time)} samples {span}, {self.fit.runs} runs, condition number {number(self.fit.condition, 2)}"
        notes = [*(f"- Not identified: {hidden.text}" for hidden in self.hidden), *(f"- {r}" for r in self.remarks)]
        return [head, self.parameters(), self.signals(), *(["\n".join(notes)] if notes else [])]


def _ends(row: dict[str, Any]) -> dict[str, Any]:
    """A row with the ends of its interval apart."""
    low, high = row.pop("interval")
    return {"value": row.pop("value"), "low": low, "high": high} | row


def calibrate(
    runs: Runs,
    recorded: RecordedSignals,
    *,
    noise: Mapping[str, float] | None = None,
    level: float = 0.95,
) -> Calibration:
    """Fit the parameters of runs to a recording.

    Args:
        runs: what is run; its first guesses name the parameters.
        recorded: what was measured, with its units: numbers are brought to those of the model; what has none is taken
            as it is, which a remark says.
        noise: standard deviations of the measured signals by name, in the units of the model; what is left out is
            estimated from the residuals.
        level: probability with which an interval covers, between 0 and 1.

    Raises:
        CalibrationError: a unit cannot be converted, a parameter changes nothing that was measured, the model gives no
            numbers, or too few samples.
    """
    if not 0.0 < level < 1.0:
        raise CalibrationError(f"level {level!r}: expected a probability between 0 and 1, for instance 0.95.")
    recorded, taken = in_units_of(runs, recorded)
    recorded, start = runs.prepare(recorded)
    names, measured = tuple(start), np.array(list(recorded.measured.values()))
    if np.isfinite(measured).sum() <= len(names):
        raise CalibrationError(
            f"{np.isfinite(measured).sum()} measured values for {len(names)} parameters; expected more of them."
        )
    bounds = np.array([runs.bounds.get(name, (-np.inf, np.inf)) for name in names]).T
    found = _fit(runs, recorded, start, measured, noise=_deviations(noise, recorded), low=bounds[0], high=bounds[1])
    _demand_effects(found, names, recorded)
    remarks = (*taken, *runs.remarks(found, names, recorded), *_remarks(found, names, recorded, *bounds))
    return _calibration(runs, start, found, recorded, level, remarks)


def _calibration(
    runs: Runs,
    start: Mapping[str, float],
    found: Fit,
    recorded: RecordedSignals,
    level: float,
    remarks: tuple[str, ...],
) -> Calibration:
    """What a fit shows."""
    names = tuple(start)
    return Calibration(
        names,
        {name: runs.unit(name) for name in names},
        dict(start),
        found,
        recorded,
        level,
        tuple(runs.hidden(found, names, recorded, level)),
        remarks,
        runs.parameter_lines(dict(zip(names, found.parameters.tolist(), strict=True))),
    )


def _fit(runs: Runs, recorded: RecordedSignals, start: Mapping[str, float], measured: Array, **limits: Any) -> Fit:
    """The fit, begun at the first guesses."""

    def simulate(points: Array) -> Array:
        return runs.run_all([dict(zip(start, point, strict=True)) for point in points.tolist()], recorded)

    try:
        return fit(simulate, np.array(list(start.values())), measured, **limits)
    except NoSlopeError as error:
        reached = in_words(dict(zip(start, error.parameters.tolist(), strict=True)))
        names = ", ".join(name for i, name in enumerate(start) if i in error.which)
        raise CalibrationError(
            f"The fit ended at {reached}: runs with {names} a little above and a little below that give no numbers, so "
            f"that no slope is known. {_last_failure(runs)}Begin with other first guesses, or leave {names} out."
        ) from error
    except ValueError as error:
        if isinstance(error, CalibrationError):
            raise
        raise CalibrationError(
            f"The fit cannot begin with these first guesses: {error}. {_last_failure(runs)}".rstrip()
        ) from error


def _last_failure(runs: Runs) -> str:
    """Why a run failed, where one did, with a space behind it."""
    return f"The last run that failed, with {runs.failures[-1].rstrip('.')}. " if runs.failures else ""


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
    for i, name in enumerate(names):
        near = 1e-6 * found.sizes[i]
        if found.parameters[i] - low[i] <= near or high[i] - found.parameters[i] <= near:
            remarks.append(f"{name} stands at the end of its range; its interval says nothing.")
    for i, (signal, measured) in enumerate(recorded.measured.items()):
        times = float(found.samples_per_independent[i])
        if times > 1.0 and found.noise[i] > _ROUNDING * np.nanstd(measured):
            remarks.append(
                f"Residuals of {signal} are no white noise (correlation of neighbours {found.correlation[i]:.2f}): a "
                "sensor that filters or aggregates, an input that is not as recorded, a gradient, slip, or something "
                f"else that the model misses. Of a mean {times:.2g} samples count as one; the intervals allow for it. "
                "That covers noise of a sensor, not a model that is wrong. Check the residuals (--plot FILE)."
            )
    return remarks


def _key(name: str) -> str:
    """The parameter behind its component, quoted where TOML needs it."""
    bare = name.rpartition(".")[2]
    return bare if bare.replace("_", "").isalnum() else f'"{bare}"'

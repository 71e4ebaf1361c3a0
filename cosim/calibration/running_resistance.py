"""Running resistance w0 + w1 v + w2 v^2 as a model to calibrate: the speed of a train under a known effort, or without
one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

import numpy as np
import scipy
from numpy.typing import NDArray

from cosim.calibration.least_squares import Fit
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.calibration.runs import Hidden, Runs

Array = NDArray[np.float64]

MINIMUM_SPEED = 5.0
"""Below it adhesion, gears and the odometer rule what is measured, not the running resistance [m/s]; (5.2)."""
RESOLUTION = 0.05
_FEWEST = 20  # samples: four numbers and a noise are estimated
_LEAST_CHANGE = 1.0  # [m/s]
_LEAST_PART = 0.01
"""Of the resistance at top speed, as acceleration [m/s2]: a first guess below it is this, for it gives the size."""
_GRID_STEP, _GRID_MOST = 0.25, 400  # [s]; speeds change over many seconds, so that fourth order is exact to rounding
_GRAVITY = 9.81
_FASTEST_PROPOSAL, _PROPOSAL_STEP = 100.0, 2.5  # [m/s], of a run that would do
_PER_MASS = {"davis_a": "m/s2", "davis_b": "1/s", "davis_c": "1/m"}
_WITH_MASS = {"davis_a": "N", "davis_b": "N.s/m", "davis_c": "N.s2/m2"}


class RunningResistance(Runs):
    """A train as one point: ``v' = effort/mass - w0 - w1 v - w2 v^2``, fitted to its measured speed.

    `davis_a`, `davis_b` and `davis_c` are w0, w1 and w2 times the mass. Where no effort is known it is constant, and
    only `net_acceleration`, effort less w0 by mass, is fitted in the place of `davis_a`. `initial_speed` is the speed
    at the first instant. First guesses come from a regression on integrals of the measured speed.

    Args:
        mass: with rotating parts [kg]; 1 where efforts are by mass. None: no effort is known, coefficients by mass.
        minimum_speed: slower samples are left out, and the longest part of the others is used [m/s]; 5 as printed.
        resolution: widest half of an interval that counts as identified, as acceleration at the highest speed [m/s2].

    Raises:
        CalibrationError: a mass or a resolution that cannot be.

    Source: Aguiar Cota 2019, (5.1)-(5.2) and Table 5.1.
    """

    outputs = ("speed",)
    _measured_inputs: ClassVar[tuple[str, ...]] = ()

    def __init__(
        self, *, mass: float | None = None, minimum_speed: float = MINIMUM_SPEED, resolution: float = RESOLUTION
    ) -> None:
        if mass is not None and not 0.0 < mass < np.inf:
            raise CalibrationError(f"mass {mass!r} kg: expected a number above 0, rotating parts included.")
        if not resolution > 0.0:
            raise CalibrationError(f"resolution {resolution!r} m/s2: expected a number above 0.")
        self.mass, self.minimum_speed, self.resolution = mass, minimum_speed, resolution
        self.inputs = (*self._measured_inputs, *(() if mass is None else ("effort",)))
        self.start, self.bounds = {}, {}

    def unit(self, name: str) -> str:
        """Unit of a signal or a coefficient, see `Runs.unit`. Of a mass of 1 efforts are by mass."""
        rest = {"effort": "m/s2" if self.mass == 1.0 else "N"}
        rest |= {"net_acceleration": "m/s2", "initial_speed": "m/s", "speed": "m/s", "acceleration": "m/s2"}
        return (rest | (_PER_MASS if self.mass is None else _WITH_MASS)).get(name, "")

    def prepare(self, recorded: RecordedSignals) -> tuple[RecordedSignals, Mapping[str, float]]:
        """The longest part above the lowest speed, with first guesses; see `Runs.prepare`."""
        speeds = self._speeds(recorded)
        if not np.isfinite(speeds).all():
            wrong = np.flatnonzero(~np.isfinite(speeds))
            raise CalibrationError(
                f"speed: {len(wrong)} of {len(speeds)} samples are not numbers, the first one at "
                f"{recorded.time[wrong[0]]:g} s is {speeds[wrong[0]]}. Leave them out."
            )
        part = recorded.part(self._used(recorded))
        _check_part(self._speeds(part), self.minimum_speed)
        if self.mass is None and "effort" in part.inputs:
            raise CalibrationError(
                "An effort in newtons needs the mass [kg], rotating parts included; for efforts by mass [m/s2] give "
                "mass 1."
            )
        net, linear, square, *speed = self._first_guess(part)
        mass, fastest = self.mass or 1.0, float(self._speeds(part).max())
        guess = {"davis_a": -mass * net} if "effort" in part.inputs else {"net_acceleration": net}
        guess |= {"davis_b": mass * linear, "davis_c": mass * square}
        least = {name: _LEAST_PART / weight for name, weight in self._weights(guess, fastest).items()}
        sized = {name: float(np.copysign(max(abs(v), least[name]), v)) for name, v in guess.items()}
        return part, sized | dict(zip(["initial_speed"], speed, strict=False))

    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """Speeds with these coefficients, see `Runs.run`."""
        forcing = self._efforts(recorded)
        time, grid = recorded.time, _grid(recorded.time, forcing)
        known = forcing if len(grid) == len(time) else np.broadcast_to(forcing[:, :1], (2, len(grid) - 1))
        coefficients = self._by_mass(values)
        speeds, rates = _integrated(grid, known + coefficients[0], *coefficients[1:], values["initial_speed"])
        return _between(grid, speeds, rates, time)[None]

    def hidden(self, found: Fit, names: Sequence[str], recorded: RecordedSignals, level: float) -> list[Hidden]:
        """Coefficients whose intervals stand for more acceleration than the resolution, and what run would do."""
        speeds, halves = self._speeds(recorded), dict(zip(names, found.half_widths(level), strict=True))
        changes = {n: w * float(halves[n]) for n, w in self._weights(names, float(speeds.max())).items()}
        lacking = {name: change for name, change in changes.items() if not change <= self.resolution}
        if not lacking:
            return []
        linear, square = names.index("davis_b"), names.index("davis_c")
        deviations = np.sqrt(np.diagonal(found.covariance))
        alike = float(found.covariance[linear, square] / (deviations[linear] * deviations[square]))
        parts = {"davis_b": "w1 v", "davis_c": "w2 v^2"}
        sizes = ", ".join(f"{parts.get(name, 'w0')} ±{change:.2g} m/s2" for name, change in lacking.items())
        text = (
            f"{', '.join(lacking)}. At {speeds.max():.3g} m/s the intervals stand for {sizes}, more than "
            f"{self.resolution:g} m/s2. From {speeds.min():.3g} to {speeds.max():.3g} m/s, w1 v and w2 v^2 are nearly "
            f"the same curve (correlation of the estimates {alike:.4f}): their sum is known better than either."
            f"{self._run_that_would_do(found, recorded, level)}"
        )
        return [Hidden(tuple(lacking), text)]

    def remarks(self, found: Fit, names: Sequence[str], recorded: RecordedSignals) -> list[str]:
        """What is identifiable of the constant part, with numbers; see `Runs.remarks`."""
        values = dict(zip(names, found.parameters.tolist(), strict=True))
        if "net_acceleration" in values:
            net = values["net_acceleration"]
            pairs = [f"{net + w0:.4g} m/s2 with w0 = {w0:g} m/s2" for w0 in (0.1, 0.5)]
            return [
                "The effort is not known, so that only its difference to w0 is identifiable: effort/mass - w0 = "
                f"{net:.4g} m/s2. An effort/mass of {pairs[0]} gives the same run as {pairs[1]}. w1 and w2 by mass "
                "need no effort."
            ]
        mass, effort = self.mass or 1.0, recorded.inputs["effort"]
        scaled = "." if mass == 1.0 else ", one of the mass into all three."
        shown = f" Effort less w0, by mass: {(effort[0] - values['davis_a']) / mass:.4g} m/s2."
        return [
            f"A gradient is not in the model: each per mille of rise reads as {_GRAVITY * 1e-3 * mass:.3g} "
            f"{self.unit('davis_a')} more of davis_a. An error of the effort goes into davis_a in full{scaled}"
            f"{shown if np.ptp(effort) == 0.0 else ''}"
        ]

    def parameter_lines(self, values: Mapping[str, float]) -> dict[str, float]:
        """Mass and coefficients, without what is of this run alone; see `Runs.parameter_lines`."""
        return {"mass": self.mass or 1.0} | {n: v for n, v in values.items() if n.startswith("davis_")}

    def _speeds(self, recorded: RecordedSignals) -> Array:
        return recorded.measured["speed"]

    def _used(self, recorded: RecordedSignals) -> NDArray[np.intp]:
        """Samples of the longest part above the lowest speed."""
        speeds = self._speeds(recorded)
        fast = np.concatenate([[False], speeds > self.minimum_speed, [False]])
        edges = np.flatnonzero(fast[1:] != fast[:-1]).reshape(-1, 2)
        if not len(edges):
            raise CalibrationError(
                f"No sample is above {self.minimum_speed:g} m/s, the highest speed is {speeds.max():.3g} m/s: a "
                "standstill or a crawl shows nothing of w1 and w2. Give a run that accelerates, or a lower minimum "
                "speed."
            )
        begin, end = max(edges, key=lambda edge: recorded.time[edge[1] - 1] - recorded.time[edge[0]])
        return np.arange(begin, end)

    def _efforts(self, recorded: RecordedSignals) -> Array:
        """Effort by mass at begin and end of each interval [m/s2], shape (2, n - 1); zero where it is not known."""
        if "effort" not in recorded.inputs:
            return np.zeros((2, len(recorded.time) - 1))
        held = recorded.inputs["effort"][:-1]
        return np.asarray(recorded.ends.get("effort", np.stack([held, held]))) / (self.mass or 1.0)

    def _by_mass(self, values: Mapping[str, float]) -> tuple[float, float, float]:
        """Constant part of the acceleration, effort apart [m/s2], w1 [1/s] and w2 [1/m]."""
        mass = self.mass or 1.0
        net = values["net_acceleration"] if "net_acceleration" in values else -values["davis_a"] / mass
        return net, values["davis_b"] / mass, values["davis_c"] / mass

    def _weights(self, names: Sequence[str] | Mapping[str, float], fastest: float) -> dict[str, float]:
        """What one unit of each coefficient changes in the acceleration at the highest speed [m/s2]."""
        mass = self.mass or 1.0
        powers = {"davis_a": 1.0, "davis_b": fastest, "davis_c": fastest**2}
        known = {"net_acceleration": 1.0} | {name: power / mass for name, power in powers.items()}
        return {name: known[name] for name in names if name in known}

    def _first_guess(self, part: RecordedSignals) -> list[float]:
        """Regression on integrals of the speed: v = v0 + q t + a t - w1 int v - w2 int v^2; a, w1, w2, v0."""
        time, speeds = part.time - part.time[0], self._speeds(part)
        known = np.append(0.0, np.cumsum(np.diff(time) * self._efforts(part).mean(axis=0)))
        first = scipy.integrate.cumulative_trapezoid(speeds, time, initial=0.0)
        second = scipy.integrate.cumulative_trapezoid(speeds**2, time, initial=0.0)
        return _regression([time, -first, -second, np.ones_like(time)], speeds - known)

    def _run_that_would_do(self, found: Fit, recorded: RecordedSignals, level: float) -> str:
        """How fast a run from the lowest speed, of the same mean acceleration, period and noise, must end to identify
        everything, in words.
        """
        time, measured = recorded.time, self._speeds(recorded)
        rate = abs(float((measured[-1] - measured[0]) / (time[-1] - time[0])))
        period = float((time[-1] - time[0]) / (len(time) - 1))
        noise = float(found.noise[0] * np.sqrt(found.samples_per_independent[0]))
        quantile = float(found.half_widths(level)[0] / np.sqrt(found.covariance[0, 0]))
        first = np.ceil(measured.max() / _PROPOSAL_STEP) * _PROPOSAL_STEP
        for highest in np.arange(first, _FASTEST_PROPOSAL if rate >= 1e-3 else first, _PROPOSAL_STEP):
            span = (highest - self.minimum_speed) / rate
            t = np.linspace(0.0, span, 200)
            v = self.minimum_speed + rate * t
            columns = np.stack([t, (v**2 - v[0] ** 2) / 2 / rate, (v**3 - v[0] ** 3) / 3 / rate, np.ones_like(t)], 1)
            lengths = np.linalg.norm(columns, axis=0)
            inverse = np.linalg.inv((columns / lengths).T @ (columns / lengths))
            deviations = noise * np.sqrt(np.diag(inverse)[:3] * len(t) / (span / period)) / lengths[:3]
            if np.all(quantile * deviations * np.array([1.0, highest, highest**2]) <= self.resolution):
                return (
                    f" A run from {self.minimum_speed:g} to {highest:g} m/s with the same sampling, noise and mean "
                    f"acceleration ({rate:.2g} m/s2) would do."
                )
        return " No single run with this noise and sampling would do up to 100 m/s: a better sensor, or several runs."


class ResistanceOfAcceleration(RunningResistance):
    """The same model as a regression of a measured acceleration on 1, v and v^2, as the thesis does in (5.2).

    For an acceleration that was measured by itself, such as that of an accelerometer, and a speed, an input, that is
    known much better: an acceleration computed by differences of the same noisy speed makes intervals wrong. All
    samples above the lowest speed are used. Arguments as for `RunningResistance`.
    """

    outputs = ("acceleration",)
    _measured_inputs = ("speed",)

    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """Accelerations with these coefficients, see `Runs.run`."""
        net, linear, square = self._by_mass(values)
        speeds = self._speeds(recorded)
        return (self._effort(recorded) + net - linear * speeds - square * speeds**2)[None]

    def _speeds(self, recorded: RecordedSignals) -> Array:
        return recorded.inputs["speed"]

    def _effort(self, recorded: RecordedSignals) -> Array:
        """Effort by mass at the samples [m/s2]."""
        return np.asarray(recorded.inputs.get("effort", np.zeros_like(recorded.time))) / (self.mass or 1.0)

    def _used(self, recorded: RecordedSignals) -> NDArray[np.intp]:
        return np.flatnonzero(self._speeds(recorded) > self.minimum_speed)

    def _first_guess(self, part: RecordedSignals) -> list[float]:
        speeds = self._speeds(part)
        return _regression(
            [np.ones_like(speeds), -speeds, -(speeds**2)], part.measured["acceleration"] - self._effort(part)
        )

    def _run_that_would_do(self, found: Fit, recorded: RecordedSignals, level: float) -> str:
        return ""


def _check_part(speeds: Array, minimum_speed: float) -> None:
    if len(speeds) < _FEWEST:
        raise CalibrationError(
            f"Only {len(speeds)} samples in one piece above {minimum_speed:g} m/s, expected at least {_FEWEST}: four "
            "numbers and the noise are estimated from them. Sample faster, or take a longer run."
        )
    if np.ptp(speeds) < _LEAST_CHANGE:
        raise CalibrationError(
            f"Nothing accelerates: all speeds used lie between {speeds.min():.4g} and {speeds.max():.4g} m/s. At one "
            "speed only the sum of effort and resistance shows. Give a run from 5 m/s to the highest speed of use."
        )


def _regression(columns: Sequence[Array], values: Array) -> list[float]:
    """Coefficients of columns for the least squares."""
    matrix = np.stack(columns, axis=1)
    lengths = np.linalg.norm(matrix, axis=0)
    return list((np.linalg.lstsq(matrix / lengths, values, rcond=None)[0] / lengths).tolist())


def _grid(time: Array, forcing: Array) -> Array:
    """Instants of the integration: the samples themselves where the effort changes, a uniform grid otherwise."""
    if np.ptp(forcing) > 0.0:
        return time
    count = int(np.clip(np.ceil((time[-1] - time[0]) / _GRID_STEP), 40, _GRID_MOST))
    return np.linspace(time[0], time[-1], count + 1)


def _integrated(grid: Array, forcing: Array, linear: float, square: float, speed: float) -> tuple[Array, Array]:
    """Speeds and accelerations at the instants by Runge-Kutta steps of fourth order, in plain numbers: an array of one
    would take ten times as long.

    Args:
        grid: instants [s], shape (n,). forcing: acceleration but for w1 and w2 at both ends of each interval, on a line
            between [m/s2], shape (2, n - 1). linear, square: w1 [1/s], w2 [1/m]. speed: at the first instant [m/s].
    """
    speeds, rates = [speed], []
    begins, ends = forcing.tolist()
    for (earlier, later), begin, end in zip(pairwise(grid.tolist()), begins, ends, strict=True):
        step, middle = later - earlier, 0.5 * (begin + end)
        first = begin - (linear + square * speed) * speed
        other = speed + 0.5 * step * first
        second = middle - (linear + square * other) * other
        other = speed + 0.5 * step * second
        third = middle - (linear + square * other) * other
        other = speed + step * third
        fourth = end - (linear + square * other) * other
        speed += step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        speeds.append(speed)
        rates.append(first)
    return np.array(speeds), np.array([*rates, ends[-1] - (linear + square * speed) * speed])


def _between(grid: Array, speeds: Array, rates: Array, time: Array) -> Array:
    """Speeds at the samples by cubic Hermite polynomials, shape (n,)."""
    if len(grid) == len(time) and np.array_equal(grid, time):
        return speeds
    found = scipy.interpolate.CubicHermiteSpline(grid, speeds, rates)(time)
    return np.asarray(found)

"""What the bounds say of one observer with its numbers: at its period, over missing samples, and the largest gap that
keeps a limit. NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import exp, inf, sqrt
from typing import Any

import numpy as np

from fmu_observer.certificates.bounds.bounded_gaps import FIRST, HORIZON, growth_over_missing_samples, largest_gap
from fmu_observer.certificates.bounds.formulas import improved_dmo_bound
from fmu_observer.certificates.bounds.worst_case import worst_case

_EXACT_HORIZON = 1e3  # [s] up to which gaps of the worst case are searched
_COARSE = 18  # halvings where each value is a worst case: to 1e-5 of the gap


@dataclass(frozen=True)
class BoundRow:
    """Bounds of the speed error just before the next sample.

    Attributes:
        missing: samples missing since the last one. gap: time since the last one [s].
        as_printed, carried, exact: see `ErrorBounds` [m/s].
    """

    missing: int
    gap: float
    as_printed: float
    carried: float
    exact: float


@dataclass(frozen=True, eq=False)
class ErrorBounds:
    """Bounds of the speed error of an observer whose odometer reading is held between samples, and held on where
    samples are missing.

    Attributes:
        observer: name. preset: that the numbers come from.
        period: between samples of the odometer [s]. rate: xi, largest acceleration or deceleration [m/s2].
        beta: overshoot [1]. m: decay rate [1/s]. gain: norm of the gain [1/s]; the three are of the printed formula.
        sample_error: norm of the error at a sample, as stated for the printed formula.
        noise: largest error of a reading [m/s].
        disturbances: largest unknown inputs to the three error equations, shape (3,) [m/s2, m/s3, m/s4].
        P: matrix of the carried bound, shape (3, 3). decay: its decay rate [1/s].
        drifts: error matrices ``A - K C`` at both ends of the drag slopes, each of shape (3, 3).
        gains: K at both ends of the speeds that it may be scheduled with, each of shape (3,).
    """

    observer: str
    preset: str
    period: float
    rate: float
    beta: float
    m: float
    gain: float
    sample_error: float
    noise: float
    disturbances: tuple[float, float, float]
    P: np.ndarray
    decay: float
    drifts: Sequence[np.ndarray]
    gains: Sequence[np.ndarray]

    def as_printed(self, gap: float) -> float:
        """The printed formula, from the sample on with the error stated there (Aguiar Cota 2019, (4.19), (4.40)).

        It is a bound only where the error at the sample really is as stated. Errors that many samples build up are
        larger for some gains: for such it is exceeded, and nothing may rest on it.

        Args:
            gap: time since the sample [s].

        Returns:
            What is printed for the norm of the error [m/s]; noise and unknown inputs are not in it.
        """
        return float(improved_dmo_bound(gap, self.sample_error, self.beta, self.m, self.gain, self.rate))

    def carried(self, gap: float) -> float:
        """The bound carried over samples, after many samples at the period, in the gap after the last of them.

        Args:
            gap: time since the last sample [s].

        Returns:
            Bound of the speed error [m/s]; noise and unknown inputs as stated are in it.
        """
        size = sqrt(float(np.linalg.inv(self.P)[0, 0]))
        settled = self._forced(self.period) / (1.0 - exp(-self.decay * self.period))
        return size * (exp(-self.decay * gap) * settled + self._forced(gap))

    def exact(self, gap: float) -> float:
        """What the held reading can really do after many samples at the period: the worst acceleration, ours.

        Args:
            gap: time since the last sample [s].

        Returns:
            Speed error [m/s], for constant drag slopes, without noise and unknown inputs.
        """
        return max(
            worst_case(F, K, self.rate, self.period, gap).error for F, K in zip(self.drifts, self.gains, strict=True)
        )

    def growth(self, missing: int) -> tuple[BoundRow, ...]:
        """The bounds over missing samples.

        Args:
            missing: most samples missing in a row.

        Returns:
            A row for each number of missing samples from 0.
        """
        rows = growth_over_missing_samples(self.as_printed, self.period, missing)
        return tuple(BoundRow(k, gap, value, self.carried(gap), self.exact(gap)) for k, gap, value in rows)

    def largest_gaps(self, limit: float) -> dict[str, float]:
        """Largest time since a sample at which each bound keeps a limit, samples before at the period.

        Args:
            limit: of the error [m/s].

        Returns:
            By the name of the bound [s]; 0 where it is exceeded at the sample already.

        Raises:
            ValueError: the limit is not positive.
        """
        exact = cache(lambda gap: self.exact(max(gap, FIRST)))
        bounds: dict[str, Callable[[float], float]] = {
            "as_printed": self.as_printed,
            "carried": self.carried,
        }
        found = {name: largest_gap(bound, limit) for name, bound in bounds.items()}
        found["exact"] = largest_gap(exact, limit, _EXACT_HORIZON, _COARSE)
        return found

    def largest_periods(self, limit: float) -> dict[str, float]:
        """Largest period of the odometer at which each bound keeps a limit, no sample missing.

        Args:
            limit: of the error [m/s].

        Returns:
            By the name of the bound [s]; the printed formula knows no past, so that its gap is its period.

        Raises:
            ValueError: the limit is not positive.
        """
        return {
            "as_printed": largest_gap(self.as_printed, limit),
            "carried": largest_gap(lambda period: self._at_period(period).carried(max(period, FIRST)), limit),
            "exact": largest_gap(
                lambda period: self._at_period(period).exact(max(period, FIRST)), limit, _EXACT_HORIZON, _COARSE
            ),
        }

    def _at_period(self, period: float) -> ErrorBounds:
        return replace(self, period=max(period, FIRST))

    def _forced(self, gap: float) -> float:
        """What a gap adds to the level, from zero."""
        faded = 1.0 - exp(-self.decay * gap)
        reading = max(self._level(K) for K in self.gains)
        unknown = sum(self._level(size * unit) for size, unit in zip(self.disturbances, np.eye(3), strict=True))
        held = reading * self.rate * (gap - faded / self.decay) / self.decay
        return held + (reading * self.noise + unknown) * faded / self.decay

    def _level(self, z: np.ndarray) -> float:
        return sqrt(float(z @ self.P @ z))


def bound_data(bounds: ErrorBounds, limit: float | None, missing: int) -> dict[str, Any]:
    """The bounds as plain data.

    Args:
        bounds: of an observer. limit: of the error, for the largest gaps [m/s]; None for none.
        missing: most samples missing in a row.

    Returns:
        Observer, numbers, `rows` and, with a limit, `largest_gaps` and `largest_periods` [s].

    Raises:
        ValueError: the limit is not positive, or `missing` is negative.
    """
    shared = ("observer", "preset", "period", "rate", "beta", "m", "gain", "sample_error", "noise", "disturbances")
    data: dict[str, Any] = {name: getattr(bounds, name) for name in (*shared, "decay")}
    data["rows"] = [asdict(row) for row in bounds.growth(missing)]
    if limit is not None:
        data |= {
            "limit": limit,
            "largest_gaps": bounds.largest_gaps(limit),
            "largest_periods": bounds.largest_periods(limit),
        }
    return data


def bound_text(bounds: ErrorBounds, limit: float | None, missing: int) -> str:
    """The bounds as a table for a terminal.

    Args:
        bounds: of an observer. limit: of the error, for the largest gaps [m/s]; None for none.
        missing: most samples missing in a row.

    Returns:
        Lines, without a last line break.
    """
    lines = [
        f"{bounds.observer} ({bounds.preset}): odometer every {bounds.period:g} s, accelerations up to "
        f"{bounds.rate:g} m/s2",
        "Speed error [m/s] just before the next sample:",
        f"{'missing':>8} {'gap [s]':>8} {'as printed':>10} {'carried':>10} {'exact':>10}",
    ]
    lines += [
        f"{row.missing:8d} {row.gap:8.3g} {row.as_printed:10.4g} {row.carried:10.4g} {row.exact:10.4g}"
        for row in bounds.growth(missing)
    ]
    if limit is not None:
        for what, found in (("gap", bounds.largest_gaps(limit)), ("period", bounds.largest_periods(limit))):
            shown = ", ".join(f"{name.replace('_', ' ')} {_seconds(name, value)}" for name, value in found.items())
            lines.append(f"Largest {what} that keeps {limit:g} m/s: {shown}")
    lines.append(
        f"as printed, no bound: from the sample on, error there stated as {bounds.sample_error:g}, beta "
        f"{bounds.beta:g}, m {bounds.m:g} 1/s; no noise, no unknown input"
    )
    lines.append(
        f"carried, a bound: over all samples before; noise up to {bounds.noise:g} m/s and unknown inputs up to "
        f"{' '.join(f'{v:g}' for v in bounds.disturbances)} (m/s2, m/s3, m/s4) in it"
    )
    lines.append("exact: the worst acceleration there is; no noise, no unknown input")
    return "\n".join(lines)


def _seconds(name: str, value: float) -> str:
    horizon = _EXACT_HORIZON if name == "exact" else HORIZON
    return f"> {horizon:.4g} s" if value == inf else f"{value:.4g} s"

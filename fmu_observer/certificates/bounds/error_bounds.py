"""What the bounds say of one observer with its numbers: at its period, over missing samples, and the largest gap that
keeps a limit. NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import exp, isfinite, sqrt

import numpy as np

from fmu_observer.certificates.bounds.bounded_gaps import FIRST, HALVINGS, HORIZON, largest_gap
from fmu_observer.certificates.bounds.formulas import improved_dmo_bound
from fmu_observer.certificates.bounds.worst_case import worst_case
from fmu_observer.certificates.finding import Finding, Kind, limit_found

_Bound = Callable[[float], float]

_EXACT_HORIZON = 1e3  # [s] up to which gaps of the worst case are searched
_COARSE = 18  # halvings where each value is a worst case: to 1e-5 of the gap


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

    def findings(self, limit: float | None = None, missing: int = 0) -> Iterator[Finding]:
        """The curves as numbers: just before the next sample, and the largest gaps and periods that keep a limit.

        Args:
            limit: of the speed error [m/s]; None for none. missing: most samples missing in a row.

        Returns:
            By number of missing samples, and then by what keeps the limit: as printed, sufficient, exact.

        Raises:
            ValueError: the limit is not positive, or `missing` is negative.
        """
        if missing < 0:
            raise ValueError(f"Missing samples: their number must not be negative, got {missing}.")
        if limit is not None and not (isfinite(limit) and limit > 0.0):
            raise ValueError(f"Largest gap: the limit must be a positive number, got {limit!r}.")
        return self._findings(limit, missing)

    def _findings(self, limit: float | None, missing: int) -> Iterator[Finding]:
        for k in range(missing + 1):
            gap = (k + 1) * self.period
            what = f"speed error after {gap:.3g} s, {k} sample{'' if k == 1 else 's'} missing"
            for kind, curve in self._curves().items():
                value = curve(gap)
                yield Finding(what, value, "m/s", kind, self._sources[kind], _within(value, limit), demand=limit)
        if limit is not None:
            for what, curves in (("gap", self._curves()), ("period", self._curves_over_periods())):
                for kind, curve in curves.items():
                    horizon, halvings = (_EXACT_HORIZON, _COARSE) if kind == "exact" else (HORIZON, HALVINGS)
                    longest = largest_gap(cache(curve), limit, horizon, halvings)
                    text = f"{what} that keeps {limit:g} m/s"
                    yield limit_found(text, longest, horizon, self._sources[kind], kind=kind)

    @property
    def _sources(self) -> dict[Kind, str]:
        unknown = " ".join(f"{v:g}" for v in self.disturbances)
        return {
            "as printed": f"no bound: from the sample on, error there stated as {self.sample_error:g}, beta "
            f"{self.beta:g}, m {self.m:g} 1/s; no noise, no unknown input",
            "sufficient": f"carried over all samples before; noise up to {self.noise:g} m/s and unknown inputs up to "
            f"{unknown} (m/s2, m/s3, m/s4) in it",
            "exact": "the worst acceleration there is; no noise, no unknown input",
        }

    def _curves(self) -> dict[Kind, _Bound]:
        return {
            "as printed": self.as_printed,
            "sufficient": self.carried,
            "exact": lambda gap: self.exact(max(gap, FIRST)),
        }

    def _curves_over_periods(self) -> dict[Kind, _Bound]:
        """Over the period, no sample missing; the printed formula knows no past, so that its gap is its period."""
        return {
            "as printed": self.as_printed,
            "sufficient": lambda period: self._at_period(period).carried(max(period, FIRST)),
            "exact": lambda period: self._at_period(period).exact(max(period, FIRST)),
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


def _within(value: float, limit: float | None) -> bool | None:
    return None if limit is None else value <= limit

"""Gains for the balise gaps that a track and a range of speeds will bring: chosen by closed form, believed by
certificate.

Nothing here is needed at run time. The functions ask the observers' own `findings`; the rules of choice are ours, the
families of gains are those of Bouchama 2024, (3.24)-(3.48).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import inf, isfinite
from typing import TYPE_CHECKING, Literal

import numpy as np
import scipy

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.design.certified_gains import RATIOS, SHARES, Gains, balise_family, certified_gains, rounded_down
from fmu_observer.observers.train.adaptive_gain_cdo import AdaptiveGainCdo
from fmu_observer.observers.train.multirate_cdo import DifferentiatorCdo
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo

_POINTS = 16  # of time in a gap at which the error is judged


@dataclass(frozen=True)
class _NoiseAmplification:
    """Standard deviations of the estimate's error, at their largest over the gaps judged.

    Attributes:
        position: of the position [m], speed: of the speed [m/s], for balise positions with independent errors of 1 m.
        slip: error of the speed [m/s] for an odometer that is constantly 1 m/s off.
    """

    position: float
    speed: float
    slip: float

    def explain(self) -> str:
        """One sentence for the user."""
        return (
            f"Noise of 1 m in the balise positions becomes {self.position:.3g} m in position and {self.speed:.3g} m/s "
            f"in speed, "
            f"1 m/s of odometer slip {self.slip:.3g} m/s."
        )


if TYPE_CHECKING:
    from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
    from fmu_observer.observers.train.train_observer import TrainObserver

Trust = Literal["balises", "odometer"]

_DEFAULT_MARGIN = 0.1
_THETA_MAX = 8.0  # [1/s], the thesis's gain
# [ours], see docs/reference/certificates.md
FAR = {"innovation_decay": 3.0, "odometer_gain_position": 0.7, "odometer_gain_speed": 1.6}
_SHARE_AT_BALISE = 0.8  # of the position error that a balise takes away in the end, with the gains FAR


@dataclass(frozen=True)
class _BaliseGaps:
    """The times between two balises that a track and a range of speeds bring.

    Attributes:
        nearest, farthest: shortest and longest spacing [m]. slowest, fastest: range of speeds [m/s].
    """

    nearest: float
    farthest: float
    slowest: float
    fastest: float

    @property
    def shortest(self) -> float:
        """Shortest gap [s]."""
        return self.nearest / self.fastest

    @property
    def longest(self) -> float:
        """Longest gap [s]."""
        return self.farthest / self.slowest


@dataclass(frozen=True)
class GainDesign:
    """Gains, what is certified with them, and what they cost.

    Attributes:
        observer: model name. parameters: values to set, by name. gaps: what they were designed for.
        certificate: of these very values, for the longest gap.
        margin: certified limit over longest gap, less 1 [1]; inf if no gap up to the certificate's horizon is too long.
        noise: what measurement errors do to the estimate at constant speeds.
    """

    observer: str
    parameters: Mapping[str, float]
    gaps: _BaliseGaps
    certificate: Finding
    margin: float
    noise: _NoiseAmplification

    def explain(self) -> str:
        """Two or three sentences for the user."""
        values = ", ".join(f"{name} = {value:.4g}" for name, value in self.parameters.items())
        found = self.certificate
        covered = f"{found.value:.4g} s{'' if isfinite(found.limit) else ' and more'}"
        occur = f"Gaps up to {self.gaps.longest:.4g} s occur, certified are {covered}"
        return f"{self.observer}: {values}. {occur}. {self.noise.explain()}"


def balise_gaps(spacing: float | Sequence[float], speeds: tuple[float, float]) -> _BaliseGaps:
    """The gaps that balises bring.

    Args:
        spacing: distance between balises [m], or the positions of all of them [m], increasing; the place where a
            journey begins may stand as the first.
        speeds: slowest and fastest speed at which balises are passed [m/s].

    Raises:
        ValueError: a spacing or a speed is not positive, two balises lie at one place, or the speeds are not in order.
    """
    slowest, fastest = (float(speed) for speed in speeds)
    if not (0.0 < slowest <= fastest < inf):
        raise ValueError(
            f"Balise gaps: expected 0 < slowest <= fastest speed [m/s], got {slowest:g} and {fastest:g}. A train that "
            "may stand still between balises has no longest gap; give the slowest speed at which the estimate must be "
            "right."
        )
    distances = (
        [float(spacing)] if isinstance(spacing, int | float) else _distances([float(place) for place in spacing])
    )
    if not all(isfinite(distance) and distance > 0.0 for distance in distances):
        raise ValueError(f"Balise gaps: the spacing must be positive and finite [m], got {spacing!r}.")
    return _BaliseGaps(min(distances), max(distances), slowest, fastest)


def design_high_gain(
    spacing: float | Sequence[float],
    speeds: tuple[float, float],
    observer: HighGainTrainObserver | None = None,
    margin: float = _DEFAULT_MARGIN,
) -> GainDesign:
    """The largest constant theta certified for every mixture of the gaps.

    Args:
        spacing, speeds: see `balise_gaps`. observer: a high-gain train observer; `DifferentiatorCdo` unless given.
        margin: the certified limit is this much longer than the longest gap [1].

    Raises:
        ValueError: bad input (see `balise_gaps`), or nothing could be certified.
    """
    chosen = DifferentiatorCdo() if observer is None else observer
    gaps = balise_gaps(spacing, speeds)
    parameters = _searched(chosen, lambda theta: {chosen.theta_name: theta}, _with_margin(gaps, margin))
    theta = parameters[chosen.theta_name]
    return _design(chosen, parameters, gaps, lambda _: _high_gain_error(theta))


def design_takagi_sugeno(
    spacing: float | Sequence[float],
    speeds: tuple[float, float],
    trust: Trust = "balises",
    margin: float = _DEFAULT_MARGIN,
) -> GainDesign:
    """Gains of `TakagiSugenoCdo` certified for every mixture of the gaps.

    Args:
        spacing, speeds: see `balise_gaps`.
        trust: ``balises``: ``K_1 = (2 theta, theta^2)``, decay ``2 theta``, no odometer, so that slip does not touch
            the estimate; theta is the largest certified one. ``odometer``: the speed is that of the odometer and a
            balise corrects the position only, certified for any gap; slip biases the speed.
        margin: the certified limit is this much longer than the longest gap [1].

    Raises:
        ValueError: bad input (see `balise_gaps`), an unknown `trust`, or nothing could be certified.
    """
    gaps, observer = balise_gaps(spacing, speeds), TakagiSugenoCdo()
    if trust not in ("balises", "odometer"):
        raise ValueError(f"Takagi-Sugeno design: unknown trust {trust!r}; use 'balises' or 'odometer'.")
    wanted = _with_margin(gaps, margin)
    gains = _odometer_family() if trust == "odometer" else _searched(observer, balise_family, wanted)
    on_position, on_speed = gains["odometer_gain_position"], gains["odometer_gain_speed"]
    error = SampledError.of(
        [[0.0, 1.0 - on_position], [0.0, -on_speed]],
        (gains["balise_gain_position"], gains["balise_gain_speed"]),
        gains["innovation_decay"],
    )
    return _design(observer, gains, gaps, lambda _: error, (on_position, on_speed))


def design_adaptive(
    spacing: float | Sequence[float],
    speeds: tuple[float, float],
    acceleration: float = 0.7,
    speed_error: float = 0.05,
    margin: float = _DEFAULT_MARGIN,
) -> GainDesign:
    """Rule of `AdaptiveGainCdo` certified for the gaps and for every change of speed within `acceleration`.

    The largest of a few ratios is taken that is certified with some theta_min, and for it the largest theta_min;
    theta_max is what the fastest speed asks for, at most 8 1/s.

    Args:
        spacing, speeds: see `balise_gaps`. Spacings that differ by more than about a third are hardly ever certified.
        acceleration: largest acceleration and deceleration [m/s2]. speed_error: largest relative error of the odometer,
            slip included [1]. margin: the certified limit is this much longer than the longest gap [1].

    Raises:
        ValueError: bad input (see `balise_gaps`), or no rule could be certified; the constant theta that can is named.
    """
    gaps, observer = balise_gaps(spacing, speeds), AdaptiveGainCdo()
    longest, middle = _with_margin(gaps, margin), 0.5 * (gaps.nearest + gaps.farthest)
    assumed = {"acceleration": acceleration, "speed_error": speed_error, "spacing_error": gaps.farthest / middle - 1.0}
    journey = {"expected_spacing": middle} | {f"assumed_{name}": value for name, value in assumed.items()}
    for ratio, share in product(RATIOS, SHARES):
        rule = _rule(ratio, share / longest, ratio * gaps.fastest / middle) | journey
        if next(observer.findings(longest, rule)).holds:
            return _design(observer, rule, gaps, _followed(rule))
    constant = design_high_gain(spacing, speeds, margin=margin).parameters["theta"]
    journeys = f"spacings of {gaps.nearest:g} to {gaps.farthest:g} m and accelerations up to {acceleration:g} m/s2"
    raise ValueError(
        f"Adaptive gain: no rule is certified for gaps up to {gaps.longest:.4g} s with {journeys}; a constant theta of "
        f"{constant:.3g} is. Raise the slowest speed, or lower the acceleration."
    )


def _rule(ratio: float, smallest: float, asked: float) -> dict[str, float]:
    """A rule whose fastest speed asks for a gain of so much [1/s]."""
    largest = max(min(_THETA_MAX, asked), smallest)
    return {"ratio": ratio, "theta_min": rounded_down(smallest), "theta_max": largest}


def _odometer_family() -> Gains:
    """T-S gains that trust the odometer between balises and correct the position only at them [ours]."""
    return {**FAR, "balise_gain_position": _SHARE_AT_BALISE * FAR["innovation_decay"], "balise_gain_speed": 0.0}


def _high_gain_error(theta: float) -> SampledError:
    """Error of the high gain theta [1/s] with K = (2, 1), drag left out."""
    return SampledError.of([[0.0, 1.0], [0.0, 0.0]], (2.0 * theta, theta**2), 2.0 * theta)


def _followed(rule: Gains) -> Callable[[float], SampledError]:
    return lambda gap: _high_gain_error(float(np.clip(rule["ratio"] / gap, rule["theta_min"], rule["theta_max"])))


def _searched(observer: TrainObserver, family: Callable[[float], Gains], gap: float) -> Gains:
    found = certified_gains(gap, family, lambda gains: next(observer.findings(gap, gains)))
    if found is None:
        raise ValueError(f"{observer.name}: no gain was found that is certified for gaps of {gap:.4g} s.")
    return found


def _design(
    observer: TrainObserver,
    parameters: Gains,
    gaps: _BaliseGaps,
    error: Callable[[float], SampledError],
    odometer_gain: tuple[float, float] = (0.0, 0.0),
) -> GainDesign:
    """The design with its certificate; `error` gives the error equations at a gap."""
    found = next(observer.findings(gaps.longest, parameters))
    if not found.holds:
        raise ValueError(f"{observer.name}: the gains of the design are not certified. {found.explain()}")
    evaluated = [(error(gap), gap) for gap in map(float, np.linspace(gaps.shortest, gaps.longest, 5))]
    margin = found.limit / gaps.longest - 1.0
    return GainDesign(observer.name, parameters, gaps, found, margin, _noise_amplification(evaluated, odometer_gain))


def _with_margin(gaps: _BaliseGaps, margin: float) -> float:
    if not 0.0 <= margin < inf:
        raise ValueError(f"Gap-aware design: the margin must not be negative, got {margin!r}.")
    return gaps.longest * (1.0 + margin)


def _distances(positions: Sequence[float]) -> list[float]:
    if len(positions) < 2:
        raise ValueError(
            f"Balise gaps: expected a spacing or at least two positions, got {len(positions)} position(s)."
        )
    for number, (place, following) in enumerate(pairwise(positions), start=1):
        if place == following:
            raise ValueError(
                f"Balise gaps: balises {number} and {number + 1} both lie at {place:g} m; give each place once."
            )
        if following < place:
            raise ValueError(
                f"Balise gaps: positions must increase; number {number + 1} at {following:g} m follows number {number} "
                f"at {place:g} m."
            )
    return [following - place for place, following in pairwise(positions)]


def _noise_amplification(
    errors: Sequence[tuple[SampledError, float]], odometer_gain: tuple[float, float] = (0.0, 0.0)
) -> _NoiseAmplification:
    """Amplification at constant gaps, in the long run."""
    found = [_at(error, gap, np.asarray(odometer_gain, dtype=float)) for error, gap in errors]
    return _NoiseAmplification(*map(float, np.max(found, axis=0)))


def _at(error: SampledError, gap: float, odometer_gain: np.ndarray) -> tuple[float, float, float]:
    """Position and speed by balise noise, speed by slip, at one gap."""
    n = error.size
    generator = np.zeros((n + 2, n + 2))  # error, decaying innovation, constant odometer error
    generator[: n + 1, : n + 1] = error.generator
    generator[:n, n + 1] = odometer_gain
    if error.spectral_radius(gap) >= 1.0:
        raise ValueError(f"Noise amplification: the error grows at a constant gap of {gap:.4g} s.")
    moved = [scipy.linalg.expm(generator * t)[:n] for t in np.linspace(0.0, gap, _POINTS)]
    # the innovation starts as the first error component
    closed = [m[:, :n] + np.outer(m[:, n], np.eye(n)[0]) for m in moved]
    at_balises = scipy.linalg.solve_discrete_lyapunov(closed[-1], np.outer(moved[-1][:, n], moved[-1][:, n]))
    offset = np.linalg.solve(np.eye(n) - closed[-1], moved[-1][:, n + 1])
    variances = [np.diag(c @ at_balises @ c.T) + m[:, n] ** 2 for c, m in zip(closed, moved, strict=True)]
    slip = max(abs(float((c @ offset + m[:, n + 1])[1])) for c, m in zip(closed, moved, strict=True))
    position, speed = np.sqrt(np.max(variances, axis=0))[:2]
    return float(position), float(speed), slip

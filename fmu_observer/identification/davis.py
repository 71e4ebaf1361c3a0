"""Davis coefficients from an acceleration run, with confidence intervals and what of them is identifiable (Aguiar Cota
2019, (5.1)-(5.2) and Table 5.1). Arrays in, an estimate out; reads no file.
"""

from __future__ import annotations

from typing import NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_observer.identification.acceleration_run import Array
from fmu_observer.identification.davis_estimate import Coefficient, DavisEstimate, IdentificationError
from fmu_observer.identification.output_error import RunFits, fit_runs, with_covariance

MINIMUM_SPEED = 5.0
"""Below it adhesion, gears and the odometer rule what is measured, not the running resistance [m/s]; (5.2)."""
LEVEL, RESOLUTION = 0.95, 0.05
_FEWEST = 20  # samples: four numbers and a noise are estimated
_LEAST_CHANGE = 1.0  # [m/s]
_ALIKE = 0.3  # correlation of neighbouring residuals from which the model is doubted
_GRAVITY = 9.81
_FASTEST_PROPOSAL, _PROPOSAL_STEP = 100.0, 2.5  # [m/s], of a run that would do


class DavisOptions(TypedDict, total=False):
    """What an identification may be asked.

    Attributes:
        minimum_speed: slower samples are left out [m/s], 5 as printed in (5.2).
        level: probability with which an interval covers, between 0 and 1, 0.95.
        resolution: widest half of an interval that counts as identified, as acceleration at the highest speed [m/s2],
            0.05.
    """

    minimum_speed: float
    level: float
    resolution: float


class _Asked(NamedTuple):
    """Options, checked, and the mass [kg]."""

    mass: float | None
    minimum_speed: float
    level: float
    resolution: float


def identify_davis(
    time: ArrayLike,
    speed: ArrayLike,
    *,
    effort: ArrayLike | None = None,
    mass: float | None = None,
    **options: Unpack[DavisOptions],
) -> DavisEstimate:
    """Davis coefficients from the measured speed of a run under constant, or known, effort.

    Gauss-Newton least squares on the solution of v' = effort/mass - w0 - w1 v - w2 v^2, with the speed at the begin as
    a fourth unknown. Intervals come from the sensitivities and Student's t; they hold for noise that is white, and
    nearly for one of first order. The longest part of the run above `minimum_speed` is used.

    Args:
        time: of the samples [s], shape (n,), increasing. speed: measured [m/s], shape (n,), without slip.
        effort: traction positive [N], one number; or shape (n,), on lines between samples; or at begin and end of each
            interval between samples, shape (2, n - 1), for one that is held. None where it is constant and not known:
            w0 cannot be told from it then.
        mass: with rotating parts [kg]; 1 where efforts are by mass. None: coefficients by mass, effort not known.
        options: see `DavisOptions`.

    Raises:
        IdentificationError: too few samples, nothing above `minimum_speed`, no acceleration, numbers that are not
            finite, a time that does not increase, an effort without a mass.
    """
    asked = _asked(mass, options)
    times, speeds = _samples(time, speed)
    forcing, constant = _efforts(effort, mass, len(times))
    chosen = _part(times, speeds, asked.minimum_speed)
    forcing = None if forcing is None else forcing[:, chosen.start : chosen.stop - 1]
    times, speeds = times[chosen], speeds[chosen]
    fits = _fitted(times, speeds, forcing)
    remarks = _limitations(fits, forcing is None and constant is None)
    return _estimate(fits, times, speeds, constant, forcing is not None, asked, remarks)


def _fitted(times: Array, speeds: Array, forcing: Array | None) -> RunFits:
    fits = fit_runs(times, speeds[None, :], forcing)
    if not (fits.converged[0] and np.all(np.isfinite(fits.parameters))):
        raise IdentificationError(
            f"The fit of {len(times)} samples from {speeds.min():.3g} to {speeds.max():.3g} m/s does not come to rest: "
            "the run does not follow v' = a - w1 v - w2 v^2. Give a part of it with one constant effort."
        )
    return fits


def identify_davis_from_acceleration(
    speed: ArrayLike,
    acceleration: ArrayLike,
    *,
    effort: float | None = None,
    mass: float | None = None,
    **options: Unpack[DavisOptions],
) -> DavisEstimate:
    """Davis coefficients by regression of a measured acceleration on 1, v and v^2, as the thesis does in (5.2).

    For an acceleration that was measured by itself, such as that of an accelerometer: one computed by differences of
    the same noisy speed makes intervals wrong, `identify_davis` is for that.

    Args:
        speed: [m/s], shape (n,), known much better than the acceleration.
        acceleration: measured [m/s2], shape (n,). effort: constant, traction positive [N]; None where it is not known.
        mass: with rotating parts [kg]; 1 where the effort is by mass. options: see `DavisOptions`.

    Returns:
        The estimate; its `time` holds speeds, and `measured` accelerations.

    Raises:
        IdentificationError: as for `identify_davis`.
    """
    asked = _asked(mass, options)
    speeds, rates = _samples(speed, acceleration, increasing=False)
    forcing, constant = _efforts(effort, mass, len(speeds))
    if forcing is not None:
        raise IdentificationError("A regression on accelerations takes one constant effort, not a series.")
    fast = speeds > asked.minimum_speed
    speeds, rates = speeds[fast], rates[fast]
    _check_part(speeds, asked.minimum_speed)
    return _estimate(_regression(speeds, rates), speeds, rates, constant, False, asked, [])


def _regression(speeds: Array, rates: Array) -> RunFits:
    """Accelerations on 1, v and v^2."""
    columns = np.stack([np.ones_like(speeds), -speeds, -(speeds**2)], axis=1)
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns / lengths
    found, _, _, singular = np.linalg.lstsq(scaled, rates, rcond=None)
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-14, hermitian=True) / np.outer(lengths, lengths)
    condition = np.array([singular[0] / max(singular[-1], 1e-300)])
    return with_covariance(
        (found / lengths)[:, None], inverse[None], (rates - scaled @ found)[None], condition, np.array([True])
    )


def _asked(mass: float | None, options: DavisOptions) -> _Asked:
    asked = _Asked(
        mass,
        options.pop("minimum_speed", MINIMUM_SPEED),
        options.pop("level", LEVEL),
        options.pop("resolution", RESOLUTION),
    )
    if options:
        raise TypeError(f"unknown option {', '.join(options)}; there are {', '.join(DavisOptions.__annotations__)}.")
    if not 0.0 < asked.level < 1.0:
        raise IdentificationError(f"level {asked.level!r}: expected a probability between 0 and 1, for instance 0.95.")
    if not asked.resolution > 0.0:
        raise IdentificationError(f"resolution {asked.resolution!r} m/s2: expected a number above 0.")
    return asked


def _samples(first: ArrayLike, second: ArrayLike, *, increasing: bool = True) -> tuple[Array, Array]:
    """Both series as arrays of finite numbers."""
    one, other = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    names = ("time", "speed") if increasing else ("speed", "acceleration")
    if one.ndim != 1 or one.shape != other.shape:
        raise IdentificationError(
            f"{names[0]} and {names[1]} are two series of equal length (got shapes {one.shape} and {other.shape})."
        )
    for name, series in zip(names, (one, other), strict=True):
        wrong = np.flatnonzero(~np.isfinite(series))
        if len(wrong):
            raise IdentificationError(
                f"{name}: {len(wrong)} of {len(series)} samples are not numbers, the first is sample {wrong[0] + 1} "
                f"({series[wrong[0]]}). Leave them out."
            )
    if increasing and len(one) > 1 and not np.all(np.diff(one) > 0.0):
        at = int(np.argmax(np.diff(one) <= 0.0)) + 1
        raise IdentificationError(f"time does not increase: {one[at - 1]:g} s, then {one[at]:g} s at sample {at + 1}.")
    return one, other


def _efforts(effort: ArrayLike | None, mass: float | None, count: int) -> tuple[Array | None, float | None]:
    """The effort by mass [m/s2]: at both ends of each interval where it changes, a number where it is constant."""
    if mass is not None and not 0.0 < mass < np.inf:
        raise IdentificationError(f"mass {mass!r} kg: expected a number above 0, rotating parts included.")
    if effort is None:
        return None, None
    if mass is None:
        raise IdentificationError(
            "An effort in newtons needs the mass [kg], rotating parts included; for efforts by mass [m/s2] give mass 1."
        )
    efforts = np.asarray(effort, dtype=float)
    if efforts.shape not in ((), (count,), (2, count - 1)) or not np.all(np.isfinite(efforts)):
        raise IdentificationError(
            f"effort: expected one finite number or {count}, one for each sample, or two for each interval between "
            f"samples (got shape {efforts.shape})."
        )
    if np.ptp(efforts) == 0.0:
        return None, float(efforts.flat[0]) / mass
    return (np.stack([efforts[:-1], efforts[1:]]) if efforts.ndim == 1 else efforts) / mass, None


def _part(times: Array, speeds: Array, minimum_speed: float) -> slice:
    """The longest part of the run above the lowest speed."""
    fast = np.concatenate([[False], speeds > minimum_speed, [False]])
    edges = np.flatnonzero(fast[1:] != fast[:-1]).reshape(-1, 2)
    if not len(edges):
        most = f", the highest speed is {speeds.max():.3g} m/s" if len(speeds) else ""
        raise IdentificationError(
            f"No sample is above {minimum_speed:g} m/s{most}: a standstill or a crawl shows nothing of w1 and w2. "
            "Give a run that accelerates, or a lower minimum speed."
        )
    begin, end = max(edges, key=lambda edge: times[edge[1] - 1] - times[edge[0]])
    _check_part(speeds[begin:end], minimum_speed)
    return slice(int(begin), int(end))


def _check_part(speeds: Array, minimum_speed: float) -> None:
    if len(speeds) < _FEWEST:
        raise IdentificationError(
            f"Only {len(speeds)} samples in one piece above {minimum_speed:g} m/s, expected at least {_FEWEST}: four "
            "numbers and the noise are estimated from them. Sample faster, or take a longer run."
        )
    if np.ptp(speeds) < _LEAST_CHANGE:
        raise IdentificationError(
            f"Nothing accelerates: all speeds used lie between {speeds.min():.4g} and {speeds.max():.4g} m/s. At one "
            "speed only the sum of effort and resistance shows. Give a run from 5 m/s to the highest speed of use."
        )


def _limitations(fits: RunFits, unknown: bool) -> list[str]:
    """What the residuals say against the model."""
    alike = float(fits.correlation[0])
    if alike < _ALIKE or fits.noise[0] < 1e-5:
        return []
    cause = "an effort that is not constant, a gradient that changes, slip, or a sensor that filters or aggregates"
    wider = np.sqrt((1.0 + min(alike, 0.999)) / (1.0 - min(alike, 0.999)))
    remark = (
        f"Neighbouring residuals are alike (correlation {alike:.2f}): {cause}. Intervals are {wider:.2g} times wider "
        "for it; that covers noise of a sensor, not a model that is wrong. Look at the residuals"
    )
    return [remark + (", and give the effort if it was recorded." if unknown else ".")]


def _estimate(
    fits: RunFits,
    times: Array,
    measured: Array,
    constant: float | None,
    forced: bool,
    asked: _Asked,
    remarks: list[str],
) -> DavisEstimate:
    """The estimate of one run, in the units of the mass."""
    regression = len(fits.parameters) == 3
    speeds = times if regression else measured
    low, high = float(speeds.min()), float(speeds.max())
    changes = fits.half_widths(asked.level)[:3, 0] * np.array([1.0, high, high**2])
    known = changes <= asked.resolution
    net, a, b, c = _coefficients(fits, constant, forced, asked, high)
    covariance = fits.covariance[0]
    confusion = float(covariance[1, 2] / np.sqrt(covariance[1, 1] * covariance[2, 2]))
    span = float(times[-1] - times[0])
    rate = float((measured[-1] - measured[0]) / span) if not regression else float("nan")
    words = [*_constant_part(a, net, asked.mass), *remarks]
    if not known.all():
        sought = None if regression else _speed_that_would_do(fits, times, measured, asked)
        words.append(_in_words(known, changes, (low, high), confusion, asked.resolution, sought, rate))
    return DavisEstimate(
        net, a, b, c, asked.mass, asked.level, asked.resolution, float(fits.noise[0]), len(measured), (low, high),
        float("nan") if regression else span, float(fits.condition[0]), confusion, float(fits.correlation[0]),
        tuple(words), times, measured, fits.residuals[0],
    )  # fmt: skip


def _coefficients(
    fits: RunFits, constant: float | None, forced: bool, asked: _Asked, fastest: float
) -> tuple[Coefficient, Coefficient | None, Coefficient, Coefficient]:
    """The net acceleration, and a, b and c in the units of the mass; a only where the effort is known."""
    values, widths = fits.parameters[:3, 0], fits.half_widths(asked.level)[:3, 0]
    powers = np.array([1.0, fastest, fastest**2])
    known = widths * powers <= asked.resolution
    factor = 1.0 if asked.mass is None else asked.mass
    units = ("m/s2", "1/s", "1/m") if asked.mass is None else ("N", "N.s/m", "N.s2/m2")

    def made(name: str, unit: str, meaning: str, value: float, i: int, factor: float) -> Coefficient:
        width, weight = factor * float(widths[i]), float(powers[i]) / factor
        return Coefficient(name, unit, value, value - width, value + width, meaning, weight, bool(known[i]))

    meant = "-w0: the constant resistance, negative" if forced else "effort less w0, by mass"
    net, a = made("net_acceleration", "m/s2", meant, float(values[0]), 0, 1.0), None
    if forced or constant is not None:
        w0 = (0.0 if constant is None else constant) - float(values[0])
        a = made("davis_a", units[0], "w0", factor * w0, 0, factor)
    b = made("davis_b", units[1], "w1", factor * float(values[1]), 1, factor)
    return net, a, b, made("davis_c", units[2], "w2", factor * float(values[2]), 2, factor)


def _constant_part(a: Coefficient | None, net: Coefficient, mass: float | None) -> list[str]:
    """What is identifiable of the constant part, in words with numbers."""
    if a is None:
        pairs = [f"{net.value + w0:.4g} m/s2 with w0 = {w0:g} m/s2" for w0 in (0.1, 0.5)]
        return [
            "The effort is not known, so that only its difference to w0 is identifiable: "
            f"effort/mass - w0 = {net.value:.4g} m/s2. An effort/mass of {pairs[0]} gives the same run as {pairs[1]}. "
            "w1 and w2 by mass need no effort."
        ]
    per_mass = _GRAVITY * 1e-3 * (1.0 if mass is None else mass)
    scaled = "." if mass is None or mass == 1.0 else ", one of the mass into all three."
    return [
        f"A gradient is not in the model: each per mille of rise reads as {per_mass:.3g} {a.unit} more of davis_a. "
        f"An error of the effort goes into davis_a in full{scaled}"
    ]


def _in_words(
    known: NDArray[np.bool_],
    widths: Array,
    speeds: tuple[float, float],
    confusion: float,
    resolution: float,
    sought: float | None,
    rate: float,
) -> str:
    """Which coefficients cannot be identified, why, and what run would do."""
    lacking = [i for i in range(3) if not known[i]]
    names = [("net_acceleration (and davis_a)", "davis_b", "davis_c")[i] for i in lacking]
    sizes = [f"{('w0', 'w1 v', 'w2 v^2')[i]} ±{widths[i]:.2g} m/s2" for i in lacking]
    text = (
        f"Cannot be identified from this run: {', '.join(names)}. At {speeds[1]:.3g} m/s the intervals stand for "
        f"{', '.join(sizes)}, more than {resolution:g} m/s2. From {speeds[0]:.3g} to {speeds[1]:.3g} m/s, w1 v and "
        f"w2 v^2 are nearly the same curve (correlation of the estimates {confusion:.4f}): their sum is known better "
        "than either."
    )
    if sought is not None:
        text += (
            f" A run from {MINIMUM_SPEED:g} to {sought:g} m/s with the same sampling, noise and mean acceleration "
            f"({abs(rate):.2g} m/s2) would do."
        )
    elif np.isfinite(rate):
        text += " No single run with this noise and sampling would do up to 100 m/s: a better sensor, or several runs."
    return text


def _speed_that_would_do(fits: RunFits, times: Array, measured: Array, asked: _Asked) -> float | None:
    """How fast [m/s] a run from the minimum speed, of the same mean acceleration, period and noise, must end to
    identify everything; None where none does.
    """
    rate = abs(float((measured[-1] - measured[0]) / (times[-1] - times[0])))
    period = float((times[-1] - times[0]) / (len(times) - 1))
    if rate < 1e-3:
        return None
    alike = max(float(fits.correlation[0]), 0.0)
    noise = float(fits.noise[0]) * np.sqrt((1.0 + min(alike, 0.999)) / (1.0 - min(alike, 0.999)))
    quantile = fits.half_widths(asked.level)[0, 0] / np.sqrt(fits.covariance[0][0, 0])
    for highest in np.arange(
        np.ceil(measured.max() / _PROPOSAL_STEP) * _PROPOSAL_STEP, _FASTEST_PROPOSAL, _PROPOSAL_STEP
    ):
        span = (highest - MINIMUM_SPEED) / rate
        t = np.linspace(0.0, span, 200)
        v = MINIMUM_SPEED + rate * t
        columns = np.stack([t, (v**2 - v[0] ** 2) / 2 / rate, (v**3 - v[0] ** 3) / 3 / rate, np.ones_like(t)], axis=1)
        lengths = np.linalg.norm(columns, axis=0)
        inverse = np.linalg.inv((columns / lengths).T @ (columns / lengths))
        deviations = noise * np.sqrt(np.diag(inverse)[:3] * len(t) / (span / period)) / lengths[:3]
        if np.all(quantile * deviations * np.array([1.0, highest, highest**2]) <= asked.resolution):
            return float(highest)
    return None

"""Thresholds from recordings without a fault, and what false alarms they mean: a rate per hour with its interval,
checked on recordings that the threshold has not seen.

NumPy and SciPy over recordings; nothing of it runs inside a detector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
import scipy

_HOUR = 3600.0  # [s]


@dataclass(frozen=True, slots=True)
class _AlarmRate:
    """False alarms in fault-free time.

    Attributes:
        alarms: how many began. hours: fault-free time [h]. rate: per hour [1/h]. low: lower end of its interval [1/h].
        high: upper end [1/h]. confidence: of the interval, from 0 to 1.
    """

    alarms: int
    hours: float
    rate: float
    low: float
    high: float
    confidence: float

    def __str__(self) -> str:
        """For a table: the rate with its interval."""
        return (
            f"{self.rate:.2g}/h ({self.alarms} in {self.hours:.3g} h, {100 * self.confidence:g} %: "
            f"{self.low:.2g} to {self.high:.2g})"
        )


def garwood(count: int, exposure: float, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of the rate of a Poisson process: Garwood 1936.

    Args:
        count: events seen. exposure: for how long, in the unit of the rate. level: of confidence [1].

    Returns:
        Lower and upper limit in 1/unit; NaN where nothing was seen for no time.
    """
    if not exposure > 0.0:
        return nan, nan
    tail = 0.5 * (1.0 - level)
    low = scipy.special.gammaincinv(count, tail) if count else 0.0
    return float(low) / exposure, float(scipy.special.gammaincinv(count + 1, 1.0 - tail)) / exposure


def clopper_pearson(count: int, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a probability: Clopper and Pearson 1934.

    Args:
        count: successes. trials: out of so many. level: of confidence [1].

    Returns:
        Lower and upper limit [1]; NaN without a trial.
    """
    if trials < 1:
        return nan, nan
    tail = 0.5 * (1.0 - level)
    low = float(scipy.special.betaincinv(count, trials - count + 1, tail)) if count else 0.0
    high = float(scipy.special.betaincinv(count + 1, trials - count, 1.0 - tail)) if count < trials else 1.0
    return low, high


def alarm_rate(alarms: int, hours: float, confidence: float = 0.95) -> _AlarmRate:
    """Rate of alarms with the interval of `garwood`.

    Args:
        alarms: how many were counted, not negative. hours: time in which they were [h], positive.
        confidence: of the two-sided interval, between 0 and 1. Without any alarm the upper end has it one-sided half
            way: at 95 %, 3.7 alarms in the time.

    Raises:
        ValueError: an argument is out of its range.
    """
    if alarms < 0 or not hours > 0.0 or not 0.0 < confidence < 1.0:
        raise ValueError(
            f"alarm_rate({alarms}, {hours}, {confidence}): expected a count from 0, hours above 0, confidence between "
            "0 and 1."
        )
    return _AlarmRate(alarms, hours, alarms / hours, *garwood(alarms, hours, confidence), confidence)


def count_alarms(exceeds: np.ndarray) -> int:
    """How many alarms begin in a recording: runs of samples above the threshold, however long each is.

    Args:
        exceeds: at each sample whether the alarm is raised, shape (samples,).
    """
    raised = np.asarray(exceeds, dtype=bool)
    return int(raised[0]) + int(np.count_nonzero(raised[1:] & ~raised[:-1])) if raised.size else 0


def largest_threshold(recordings: Sequence[np.ndarray], margin: float = 1.05) -> float:
    """Largest residual without a fault, times a margin: Omar 2012, 7.5.1 (iii), with our margin.

    Args:
        recordings: residuals without a fault, each of shape (samples,). margin: factor [1].

    Raises:
        ValueError: there is no recording, an empty one, or a value that is not finite.
    """
    return margin * max(float(np.max(values)) for values in _checked(recordings))


def rate_threshold(recordings: Sequence[np.ndarray], sample_period: float, alarms_per_hour: float) -> float:
    """Smallest threshold at which fault-free recordings have no more alarms per hour than allowed.

    The rate holds where it was fitted; `checked` says what it is elsewhere. A rate below one alarm in all recordings
    cannot be fitted: then the threshold is their largest residual.

    Args:
        recordings: residuals without a fault, each of shape (samples,). sample_period: between their samples [s].
        alarms_per_hour: allowed [1/h], not negative.

    Raises:
        ValueError: there is no recording, an empty one, or a value that is not finite.
    """
    kept = _checked(recordings)
    allowed = int(alarms_per_hour * sum(map(len, kept)) * sample_period / _HOUR)
    # An alarm begins where the residual rises past the threshold: each rise from a to b begins one for thresholds
    # from a up to b. Tried are the values from which rises begin, and where they end.
    before = np.concatenate([np.concatenate([[-np.inf], values[:-1]]) for values in kept])
    after = np.concatenate(kept)
    rising = after > before
    starts, ends = np.sort(before[rising]), np.sort(after[rising])
    candidates = np.unique(ends)
    begun = np.searchsorted(starts, candidates, side="right") - np.searchsorted(ends, candidates, side="right")
    enough = begun <= allowed
    last_excess = np.flatnonzero(~enough)
    # Below low residuals everything is one long alarm: only thresholds above the last excess count.
    return float(candidates[last_excess[-1] + 1 if last_excess.size else 0])


def checked(
    recordings: Sequence[np.ndarray], threshold: float, sample_period: float, confidence: float = 0.95
) -> _AlarmRate:
    """False alarms of a threshold on recordings without a fault; take others than those it was made of.

    Args:
        recordings: residuals without a fault, each of shape (samples,). threshold: of the residual.
        sample_period: between their samples [s]. confidence: of the interval, between 0 and 1.

    Raises:
        ValueError: there is no recording, an empty one, or a value that is not finite.
    """
    kept = _checked(recordings)
    alarms = sum(count_alarms(values > threshold) for values in kept)
    return alarm_rate(alarms, sum(map(len, kept)) * sample_period / _HOUR, confidence)


@dataclass(frozen=True, slots=True)
class Window:
    """A window of a residual that sees all faults it was shown.

    Attributes:
        samples: its length N. threshold: of the sum of squares. delays: of each fault, samples from its onset on.
    """

    samples: int
    threshold: float
    delays: tuple[int, ...]


def smallest_window(
    free: Sequence[np.ndarray],
    faulty: Sequence[np.ndarray],
    onset: int,
    windows: Sequence[int],
    margin: float = 1.05,
) -> Window | None:
    """Shortest window whose sum of squares shows every fault: Omar 2012, 7.5.1 (iv), begin with the window that keeps
    the limit of the delay, and enlarge it until it detects.

    Args:
        free: residuals x without a fault, each of shape (samples,). faulty: residuals with one from sample `onset` on.
        onset: its place. windows: lengths N in the order in which they are tried. margin: see `largest_threshold`.

    Returns:
        The first that sees all faults, with the threshold that its fault-free sums ask for; None where none does.

    Raises:
        ValueError: there is no recording, a window is longer than one, or a value is not finite.
    """
    quiet, loud = _checked(free), _checked(faulty)
    for samples in windows:
        if not 1 <= samples <= min(map(len, (*quiet, *loud))):
            raise ValueError(f"smallest_window: a window of {samples} samples; expected 1 to the shortest recording.")
        threshold = largest_threshold([_sums(x, samples) for x in quiet], margin)
        # The sum of index i ends at sample i + N - 1 and is the first to hold the fault where that is the onset.
        above = [np.flatnonzero(_sums(x, samples)[max(onset - samples + 1, 0) :] > threshold) for x in loud]
        if all(found.size for found in above):
            return Window(samples, threshold, tuple(int(found[0]) for found in above))
    return None


def _sums(residual: np.ndarray, samples: int) -> np.ndarray:
    """Sums of squares over windows, one for each that is full."""
    return np.convolve(residual**2, np.ones(samples), "valid")


def _checked(recordings: Sequence[np.ndarray]) -> list[np.ndarray]:
    kept = [np.asarray(values, dtype=float).ravel() for values in recordings]
    if not kept or any(values.size == 0 for values in kept):
        raise ValueError("A threshold needs at least one recording, and none may be empty.")
    for number, values in enumerate(kept):
        if not np.isfinite(values).all():
            where = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ValueError(
                f"Recording {number} is {values[where]} at sample {where}; expected finite residuals. Leave out the "
                "samples before the window was full."
            )
    return kept

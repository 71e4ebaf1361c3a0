"""How far observers and the plain odometer were off at the end of each gap between two balises. Imports NumPy only.

The end of a gap is where a train knows its place least: the longer the gap, the more a wheel that slips can add up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any, TypeVar

import numpy as np

from cosim.evaluation.roles import estimation_error, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import BaliseRecord, Result

Length = TypeVar("Length", float, np.ndarray)

LONGEST = 10
"""How many gaps a table shows, the longest first."""
FIXED_SHARE, SHARE_OF_DISTANCE = 5.0, 0.05
ENVELOPE = "SUBSET-041: 5 m + 5 % of the distance since the last balise"
PLAIN_ODOMETER = "plain odometer"
_DISTANCE = "distance"
"""Output of an odometer that counts the way of the wheel [m]."""
STANDING = 0.5
"""Below this speed [m/s] an error in metres has no running time worth the name."""
EQUAL_WITHIN = 1e-9  # times this close, relative to their size, are one


@dataclass(frozen=True, slots=True)
class Gap:
    """The way from one balise to the next one that was read.

    Args:
        origin, target: names of the two. start, end: when their telegrams were delivered [s].
        length: way of the train from the first balise to where the second was delivered [m].
        speed: of the train at the end [m/s]; NaN where it was not recorded.
    """

    origin: str
    target: str
    start: float
    end: float
    length: float
    speed: float

    @property
    def seconds(self) -> float:
        """How long it lasted [s]."""
        return self.end - self.start

    @property
    def envelope(self) -> float:
        """What SUBSET-041 grants an odometer at the end of this gap [m]."""
        return envelope(self.length)


def envelope(length: Length) -> Length:
    """What SUBSET-041 grants an odometer [m].

    Args:
        length: way since the last balise [m], a number or an array.
    """
    return FIXED_SHARE + SHARE_OF_DISTANCE * length


@dataclass(frozen=True)
class GapErrors:
    """Position errors at the end of the gaps of a run.

    Args:
        gaps: in order of time.
        errors: by component of an observer, and under `PLAIN_ODOMETER`: estimated minus true position in the last row
            before the telegram is used [m], shape (gaps,); NaN where nothing was recorded, infinite once diverged.
        labels: what to call them.
    """

    gaps: Sequence[Gap]
    errors: Mapping[str, np.ndarray]
    labels: Mapping[str, str]

    def longest(self, count: int = LONGEST) -> list[int]:
        """Indices of the longest gaps, the longest first; of two of one length the earlier one first.

        Args:
            count: how many at most.
        """
        return sorted(range(len(self.gaps)), key=lambda i: (-self.gaps[i].length, i))[:count]

    def running_time(self, name: str) -> np.ndarray:
        """Errors as running time: what the train needs for them at the speed it has there [s], shape (gaps,); NaN where
        it stands or its speed was not recorded.

        Args:
            name: key of `errors`.
        """
        speeds = np.array([gap.speed for gap in self.gaps])
        moving = np.abs(speeds) > STANDING
        with np.errstate(invalid="ignore"):
            return np.where(moving, self.errors[name] / np.where(moving, np.abs(speeds), 1.0), nan)

    def within_envelope(self, name: str) -> float:
        """Share of the gaps at whose end the error is within the envelope of SUBSET-041 [1]; NaN without gaps.

        Args:
            name: key of `errors`.
        """
        if not self.gaps:
            return nan
        granted = envelope(np.array([gap.length for gap in self.gaps]))
        return float(np.mean(np.abs(self.errors[name]) <= granted))

    def to_data(self) -> dict[str, Any]:
        """Plain data for a summary: the longest gaps with all errors, and what all gaps come to."""
        seconds = {name: self.running_time(name) for name in self.errors}
        return {
            "gaps": len(self.gaps),
            "envelope": ENVELOPE,
            "longest": [
                {
                    "from": self.gaps[i].origin,
                    "to": self.gaps[i].target,
                    "start_s": self.gaps[i].start,
                    "end_s": self.gaps[i].end,
                    "length_m": self.gaps[i].length,
                    "speed_m_s": self.gaps[i].speed,
                    "envelope_m": self.gaps[i].envelope,
                    "error_m": {name: float(errors[i]) for name, errors in self.errors.items()},
                    "error_s": {name: float(errors[i]) for name, errors in seconds.items()},
                }
                for i in self.longest()
            ],
            "all": {
                name: {
                    "largest_m": largest(errors),
                    "rms_m": root_mean_square(errors),
                    "largest_s": largest(seconds[name][~np.isnan(seconds[name])]),
                    "within_envelope": self.within_envelope(name),
                }
                for name, errors in self.errors.items()
            },
        }


def gap_errors(result: Result, spec: ReportSpec) -> GapErrors:
    """Errors at the end of the gaps between balises that were read; gaps that end before `evaluate_after` are left out.

    The plain odometer is set to the place of each balise and then counts: by its output ``distance`` where that was
    recorded (on straight lines between its samples), else by its reading, held from row to row.

    Args:
        result: the run, with its telegrams.
        spec: roles of the signals, labels, start of the evaluation.

    Returns:
        The errors; without gaps where there is no true position in any row, or fewer than two balises were read.
    """
    place = recorded(result, spec.true_position)
    telegrams = telegrams_read(result.events)
    if place is None or not len(place) or len(telegrams) < 2:
        return GapErrors((), {}, {})
    times = np.array([event.delivered_at for event in telegrams])
    rows = rows_before(result.time, times)
    speed = recorded(result, spec.true_speed)
    evaluated = np.flatnonzero(times[1:] >= spec.evaluate_after) + 1
    lengths = _lengths(result.time, place, [telegrams[i - 1] for i in evaluated], rows[evaluated])
    gaps = [
        Gap(
            telegrams[i - 1].identity,
            telegrams[i].identity,
            float(times[i - 1]),
            float(times[i]),
            length,
            nan if speed is None else float(speed[rows[i]]),
        )
        for i, length in zip(evaluated.tolist(), lengths, strict=True)
    ]
    errors = _errors_at(result, spec, rows, evaluated, place)
    labels = {name: PLAIN_ODOMETER if name == PLAIN_ODOMETER else label(spec, name) for name in errors}
    return GapErrors(gaps, errors, labels)


def travelled(place: np.ndarray) -> np.ndarray:
    """Way that the train has made up to each row [m], shape (rows,), also where it comes back.

    Args:
        place: its true position [m], shape (rows,).
    """
    return np.concatenate(([0.0], np.cumsum(np.abs(np.diff(place)))))


def _lengths(time: np.ndarray, place: np.ndarray, passed: Sequence[BaliseRecord], rows: np.ndarray) -> list[float]:
    """Ways from the passing of a balise each to a row each [m]."""
    way, there = travelled(place), np.array([telegram.true_position for telegram in passed])
    first = np.minimum(np.searchsorted(time, np.array([telegram.stamp for telegram in passed])), rows)
    lengths: list[float] = (np.abs(place[first] - there) + way[rows] - way[first]).tolist()
    return lengths


def _errors_at(
    result: Result, spec: ReportSpec, rows: np.ndarray, evaluated: np.ndarray, place: np.ndarray
) -> dict[str, np.ndarray]:
    """Position errors at the end of the judged gaps [m], of each observer and of the plain odometer."""
    errors: dict[str, np.ndarray] = {}
    for observer in spec.observers:
        error = estimation_error(result, spec, observer, "position")
        if error is not None:
            errors[observer] = np.where(np.isnan(error[rows[evaluated]]), inf, error[rows[evaluated]])
    counted = _odometer_way(result, spec)
    if counted is not None:
        with np.errstate(invalid="ignore"):
            ahead = counted[rows] - place[rows]
            errors[PLAIN_ODOMETER] = ahead[evaluated] - ahead[evaluated - 1]
    return errors


def rows_before(time: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """The row before each event, shape (n,): the first of the rows of its time, where a table has rows for it, else the
    last one before it.

    Args:
        time: of the rows [s], not decreasing, shape (rows,). instants: of the events [s], shape (n,).
    """
    close = EQUAL_WITHIN * np.maximum(1.0, np.abs(instants))
    rows = np.searchsorted(time, instants - close)
    beyond = time[np.minimum(rows, len(time) - 1)] > instants + close
    return np.asarray(np.clip(np.where(beyond, rows - 1, rows), 0, len(time) - 1))


def largest(errors: np.ndarray) -> float:
    """Largest magnitude; NaN without any.

    Args:
        errors: shape (n,).
    """
    return float(np.max(np.abs(errors))) if len(errors) else nan


def root_mean_square(errors: np.ndarray) -> float:
    """Root mean square, infinite where one is; NaN without any.

    Args:
        errors: shape (n,).
    """
    scale = largest(errors)
    if not np.isfinite(scale) or scale == 0.0:
        return scale
    return scale * float(np.sqrt(np.mean((errors / scale) ** 2)))  # scaled: the square of a diverged one would overflow


def telegrams_read(events: Sequence[BaliseRecord]) -> list[BaliseRecord]:
    """Telegrams of balises that were read and delivered, in the order of delivery, one at an instant.

    Args:
        events: of a run.
    """
    delivered = [event for event in events if event.kind == "true" and np.isfinite(event.delivered_at)]
    by_time = {event.delivered_at: event for event in sorted(delivered, key=lambda event: event.stamp)}
    return [by_time[time] for time in sorted(by_time)]


def _odometer_way(result: Result, spec: ReportSpec) -> np.ndarray | None:
    """Way that the odometer has counted up to each row [m], shape (rows,), or None without an odometer."""
    reading = recorded(result, spec.odometer)
    if spec.odometer is None or reading is None:
        return None
    name = f"{spec.odometer.rpartition('.')[0]}.{_DISTANCE}"
    counted = recorded(result, name)
    if counted is not None:
        sampled = any(info.name == name and info.variability == "discrete" for info in result.signals)
        return _between_samples(result.time, counted) if sampled else counted
    return np.concatenate(([0.0], np.cumsum(reading[:-1] * np.diff(result.time))))


def _between_samples(time: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """A count that is held from sample to sample, on a straight line between them: a row between two samples would
    else lack the way since the last one."""
    new = np.flatnonzero(np.diff(counted, prepend=np.nan) != 0.0)
    return np.asarray(np.interp(time, time[new], counted[new]))

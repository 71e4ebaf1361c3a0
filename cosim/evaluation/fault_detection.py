"""How well observers find faults, say that the odometer lies: found and missed, false alarms, delays, positions at
balises.

Rates come with the interval that their count allows. Imports NumPy only; SciPy is loaded for an interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any

import numpy as np

from cosim.evaluation.metrics import FEWEST_INSTANTS, instants
from cosim.evaluation.roles import estimate, estimation_error, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from fmu_observer.formulas.diagnosis.thresholds import clopper_pearson, garwood

GRACE = 0.5
"""A detection that begins so soon after the end of a fault is still of that fault [s]."""
HOUR = 3600.0
_SEPARATE = 1e-6  # [s]: intervals closer than that are one

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FaultDetection:
    """What one observer said of the faults of a run: Aguiar Cota 2019, section 5.3.3.

    Args:
        observer: component name.
        duration: time judged [s].
        faults: number of true faults in it. detected: of those, how many it found in time, by a detection that began in
            them.
        detections: how many intervals it indicated. false: of those, how many belong to no fault.
        start_delays: from the start of each detected fault to the detection [s], in their order.
        end_delays: from its end to the end of the detection [s]; infinite where that was still on when the run ended.
        time_outside: time for which it was on without a fault, false alarms and late ends together [s].
        position_errors: estimate minus true position at the last row before each balise [m].
        indicates: whether it says anything of faults; where it does not, the position errors alone mean something.
    """

    observer: str
    duration: float
    faults: int
    detected: int
    detections: int
    false: int
    start_delays: tuple[float, ...]
    end_delays: tuple[float, ...]
    time_outside: float
    position_errors: tuple[float, ...]
    indicates: bool = True

    @property
    def missed(self) -> int:
        """Faults that it did not find."""
        return self.faults - self.detected

    @property
    def detection_rate(self) -> float:
        """FDR: detected faults over all [1]; NaN without a fault."""
        return self.detected / self.faults if self.faults else nan

    @property
    def missed_rate(self) -> float:
        """UFR: missed faults over all [1]; NaN without a fault."""
        return self.missed / self.faults if self.faults else nan

    @property
    def false_rate(self) -> float:
        """FAR: false detections over all detections [1]; NaN without a detection."""
        return self.false / self.detections if self.detections else nan

    @property
    def false_per_hour(self) -> float:
        """False detections in an hour of operation [1/h]; NaN where no time was judged."""
        return self.false / (self.duration / HOUR) if self.duration > 0.0 else nan

    def within(self, limit: float) -> bool:
        """Whether every fault was found, and none later than that.

        Args:
            limit: longest delay [s].
        """
        return not self.missed and max(self.start_delays, default=0.0) <= limit + _SEPARATE

    @property
    def missed_interval(self) -> Interval:
        """Clopper-Pearson interval of the share of missed faults [1]."""
        return clopper_pearson(self.missed, self.faults)

    @property
    def false_interval(self) -> Interval:
        """Garwood interval of the false detections in an hour [1/h]."""
        return garwood(self.false, self.duration / HOUR)

    def to_data(self) -> dict[str, Any]:
        """Plain data for a result file; numbers that are not finite as None."""
        data: dict[str, Any] = {name: getattr(self, name) for name in self.__slots__}
        for name in ("missed", "detection_rate", "missed_rate", "false_rate", "false_per_hour"):
            data[name] = getattr(self, name)
        data |= {"missed_interval": self.missed_interval, "false_interval": self.false_interval}
        return {name: _plain(value) for name, value in data.items()}


def fault_detection(result: Result, spec: ReportSpec) -> list[FaultDetection]:
    """What every observer said of the faults by their output `spec.detection`, from the start of the evaluation on.

    Observers without that output are compared by their position.

    Args:
        result: the run.
        spec: the role `true_fault`, the output `detection`, `delay_limit`, observers, start of the evaluation.

    Returns:
        One entry an observer, in their order; none where no true fault was recorded.
    """
    true = recorded(result, spec.true_fault)
    if true is None or instants(result.time) < FEWEST_INSTANTS:
        return []
    start = max(float(result.time[0]), spec.evaluate_after)
    faults = [f for f in intervals(result.time, true) if f[0] >= start]
    indicated = {observer: estimate(result, observer, spec.detection) for observer in spec.observers}
    seen = [o for o in indicated if indicated[o] is not None or estimate(result, o, "position") is not None]
    return [_evaluated(result, spec, observer, indicated[observer], faults, start) for observer in seen]


def _evaluated_detections(
    faults: Sequence[Interval], detections: Sequence[Interval], end: float, delay_limit: float | None = None
) -> tuple[list[float], list[float], int]:
    """Which detections belong to which faults.

    A detection belongs to the fault in which it *begins*, the fault taken to last `GRACE` longer, though not beyond the
    begin of the next; one that was on before is none of it, however long it lasts. A fault is detected where one of its
    detections begins within the delay limit; it begins with the first of them and ends with the last. A detection in a
    fault that begins later than that is late, and not false.

    Args:
        faults: true intervals [s], in order. detections: indicated intervals [s], in order. end: of the run [s].
        delay_limit: longest delay [s]; None for none.

    Returns:
        Delays of the detected faults at their start and at their end [s], and the number of false detections.
    """
    starts, ends, matched = [], [], set()
    for number, (a, b) in enumerate(faults, 1):
        next_begin = faults[number][0] if number < len(faults) else inf
        last_begin = min(b + GRACE, next_begin - _SEPARATE)
        own = [k for k, (c, _) in enumerate(detections) if a - _SEPARATE <= c <= last_begin]
        matched |= set(own)
        if own and (delay_limit is None or detections[own[0]][0] <= a + delay_limit + _SEPARATE):
            starts.append(max(detections[own[0]][0] - a, 0.0))
            last = detections[own[-1]][1]
            ends.append(inf if last >= end - _SEPARATE and last > b + GRACE else last - b)
    return starts, ends, len(detections) - len(matched)


def intervals(time: np.ndarray, on: np.ndarray) -> list[Interval]:
    """Intervals in which a signal is not zero; its values hold until the next row.

    Args:
        time: instants [s], shape (rows,), never falling. on: the signal, shape (rows,).

    Returns:
        Disjoint intervals (start, end) [s] in order.
    """
    active = np.concatenate(([False], np.nan_to_num(on) != 0.0, [False]))
    starts, ends = np.flatnonzero(~active[:-1] & active[1:]), np.flatnonzero(active[:-1] & ~active[1:])
    times = np.append(time, time[-1:])
    found = [(float(times[i]), float(times[k])) for i, k in zip(starts, ends, strict=True) if times[k] > times[i]]
    joined: list[Interval] = []
    for a, b in found:  # an event within has two rows of one time
        if joined and a - joined[-1][1] <= _SEPARATE:
            joined[-1] = (joined[-1][0], b)
        else:
            joined.append((a, b))
    return joined


def position_errors(result: Result, spec: ReportSpec, observer: str) -> list[float]:
    """Estimate minus true position at the last row before each balise that was read [m].

    These are the final errors e_p of the thesis; divide by the length of the train for its unit.

    Args:
        result: the run. spec: roles, start of the evaluation. observer: name of its component.
    """
    error = estimation_error(result, spec, observer, "position")
    if error is None:
        return []
    stamps = sorted({e.stamp for e in result.events if e.kind == "true" and e.stamp >= spec.evaluate_after})
    rows = np.searchsorted(result.time, np.asarray(stamps) - 1e-9 * np.maximum(np.abs(stamps), 1.0))
    return [float(error[row]) for row in rows if row < len(error)]


def _evaluated(
    result: Result, spec: ReportSpec, observer: str, indicated: np.ndarray | None, faults: list[Interval], start: float
) -> FaultDetection:
    end = float(result.time[-1])
    detections = [] if indicated is None else [d for d in intervals(result.time, indicated) if d[1] > start]
    begun = [d for d in detections if d[0] >= start or any(d[1] > a for a, _ in faults)]
    starts, ends, false = _evaluated_detections(faults, begun, end, delay_limit=spec.delay_limit)
    inside = sum(max(0.0, min(b, d) - max(a, c)) for a, b in faults for c, d in begun)
    outside = sum(d - max(c, start) for c, d in begun) - inside
    return FaultDetection(
        observer,
        max(end - start, 0.0),
        len(faults),
        len(starts),
        len(begun),
        false,
        tuple(starts),
        tuple(ends),
        max(outside, 0.0),
        tuple(position_errors(result, spec, observer)),
        indicated is not None,
    )


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value

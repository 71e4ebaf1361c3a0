"""What one observer is worth in one run: errors by phase and at balises, slip indications, certificate, telegrams,
cost.

Reads results; runs nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, nan
from typing import Any

import numpy as np

from cosim.choice.allowance import Allowance, UsedAllowance, used_allowance
from cosim.evaluation.balise_gaps import rows_before
from cosim.evaluation.event_counts import USED
from cosim.evaluation.indicators import IndicatorStatistics, indicator_statistics, on_intervals
from cosim.evaluation.metrics import PhaseMetrics, phase_metrics
from cosim.evaluation.roles import Quantity, estimate, estimation_error
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import BaliseRecord, Result
from fmu_observer.certificates.finding import Finding
from fmus.tables.plain_data import jsonable

WHOLE = "whole run"
SEEN_GAP = "longest gap seen"
"""Condition of the finding about gaps."""


@dataclass(frozen=True)
class _ErrorAtBalises:
    """Errors just before telegrams are used: how far the estimate had drifted.

    Args:
        count: telegrams. mean: signed. rms, max_abs: of the same errors, in the unit of the error.
    """

    count: int
    mean: float
    rms: float
    max_abs: float


@dataclass(frozen=True)
class ObserverScore:
    """One observer in a benchmark.

    Args:
        name: of the observer. label: to show. model: shipped observer or FMU.
        origin: ``scenario`` where the scenario says how it is set, else ``defaults``.
        settings: what was assumed of it, in words.
        failure: why there are no numbers, or why they end early; None where all is well.
        whole: errors over the whole evaluated run. phases: in each phase of the scenario.
        speed_at_balises, position_at_balises: errors just before telegrams are used [m/s], [m].
        indicator: what the slip indicator said. false_alarms: indications that began outside the low-adhesion zones.
        certificate: the gap certified, held against the longest expected and, as its condition, the longest seen; None
            where nothing is known about gaps, or there are no balises.
        telegrams: what became of them, by outcome. costs: per communication step, one for each repetition [us].
        used: how much of the allowance it uses; None where positions are not known.
        kind: ``FMU`` or ``block``.
        in_loop: whether it acts on the train in the scenario.
    """

    name: str
    label: str
    model: str
    origin: str
    settings: tuple[str, ...] = ()
    failure: str | None = None
    whole: PhaseMetrics | None = None
    phases: tuple[PhaseMetrics, ...] = ()
    speed_at_balises: _ErrorAtBalises | None = None
    position_at_balises: _ErrorAtBalises | None = None
    indicator: IndicatorStatistics | None = None
    false_alarms: int | None = None
    certificate: Finding | None = None
    telegrams: Mapping[str, int] = field(default_factory=dict)
    costs: tuple[float, ...] = ()
    used: UsedAllowance | None = None
    kind: str = ""
    in_loop: bool = False

    @property
    def cost(self) -> float | None:
        """Median cost per communication step [us]."""
        return float(np.median(self.costs)) if self.costs else None

    @property
    def speed_rms(self) -> float | None:
        """Root mean square of the speed error over the whole evaluated run [m/s]."""
        return None if self.whole is None or self.whole.speed is None else self.whole.speed.rms

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        data: dict[str, Any] = jsonable(self)
        data["cost_us"] = self.cost
        data["certificate"] = None if self.certificate is None else self.certificate.to_dict()
        return data


def measured(result: Result, spec: ReportSpec, name: str, allowance: Allowance) -> dict[str, Any]:
    """Errors, indications and telegrams of one observer, as arguments of `ObserverScore`.

    Args:
        result: the run. spec: roles; `name` is one of its observers. allowance: what its position may be off.
    """
    time = result.time
    if not len(time):
        return {}
    whole = Phase(WHOLE, float(time[0]), float(time[-1]))
    alone = ReportSpec(**{**vars(spec), "observers": [name], "phases": [whole]})
    own = ReportSpec(**{**vars(spec), "observers": [name]})
    found: dict[str, Any] = {
        "whole": phase_metrics(result, alone)[0],
        "phases": tuple(phase_metrics(result, own)) if spec.phases else (),
        "speed_at_balises": error_at_balises(result, spec, name, "speed"),
        "position_at_balises": error_at_balises(result, spec, name, "position"),
        "telegrams": telegram_outcomes(result.events, name),
        "used": used_allowance(result, spec, name, allowance),
    }
    statistics = indicator_statistics(result, own)
    if statistics:
        found |= {"indicator": statistics[0], "false_alarms": false_alarms(result, spec, name)}
    return found


def error_at_balises(result: Result, spec: ReportSpec, name: str, quantity: Quantity) -> _ErrorAtBalises | None:
    """Errors of an observer on the row before each telegram that it used, from `evaluate_after` on; None without any.

    A row pair of the same time stands at each delivery, before and after; of an observer that could not be stopped
    there the last row before it counts.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
        name: of the observer's component.
        quantity: ``speed`` or ``position``.
    """
    error = estimation_error(result, spec, name, quantity)
    times = [
        e.delivered_at for e in result.events if e.outcomes.get(name) in USED and e.delivered_at >= spec.evaluate_after
    ]
    if error is None or not times:
        return None
    errors = error[rows_before(result.time, np.array(times))]
    if not np.all(np.isfinite(errors)):
        return _ErrorAtBalises(len(errors), inf, inf, inf)
    largest = float(np.max(np.abs(errors)))
    scale = largest or 1.0  # so that the square of a diverged estimate does not overflow
    rms = scale * float(np.sqrt(np.mean((errors / scale) ** 2)))
    return _ErrorAtBalises(len(errors), float(np.mean(errors)), rms, largest)


def divergence(whole: PhaseMetrics | None, tolerable: float) -> str | None:
    """Why the numbers of an observer mean nothing although it ran to the end, in words, or None.

    Args:
        whole: errors over the whole run; None without any. tolerable: speed error beyond which they do [m/s].
    """
    speed = None if whole is None else whole.speed
    if speed is None or not speed.max_abs > tolerable:
        return None
    return f"diverged: its speed error reached {speed.max_abs:.3g} m/s, the train no more than {tolerable:.3g} m/s"


def false_alarms(result: Result, spec: ReportSpec, name: str) -> int | None:
    """How often the slip indicator came on outside the low-adhesion zones; None where no zones are known.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
        name: of the observer's component.
    """
    values = estimate(result, name, "slip_indicator")
    if values is None or not spec.zones:
        return None
    begun = [a for a, _ in on_intervals(result.time, values) if a >= spec.evaluate_after]
    return sum(not any(start <= a <= end for start, end in spec.zones) for a in begun)


def telegram_outcomes(events: Sequence[BaliseRecord], name: str) -> dict[str, int]:
    """What became of the telegrams at one receiver, by outcome.

    Args:
        events: the telegrams.
        name: of the receiver.
    """
    counts: dict[str, int] = {}
    for event in events:
        outcome = event.outcomes.get(name)
        if outcome is not None:
            counts[outcome] = counts.get(outcome, 0) + 1
    return counts


def longest_gap(events: Sequence[BaliseRecord], start: float) -> float | None:
    """Longest time between two true balises, or from the start to the first one [s]; None without any.

    Args:
        events: the telegrams.
        start: begin of the run [s].
    """
    stamps = sorted(e.stamp for e in events if e.kind == "true")
    return float(np.diff([start, *stamps]).max()) if stamps else None


def gap_certified(limit: float, expected: float | None, seen: float | None) -> Finding:
    """What the gains are certified for, beside the gaps of the run.

    Args:
        limit: gaps that vary are certified up to here [s]; inf where every gap is. expected: longest gap to expect
            before the run [s], None where it cannot be known. seen: longest that occurred [s], None for none.
    """
    covers_expected, covers_seen = (None if gap is None else gap <= limit for gap in (expected, seen))
    occurred = Finding(SEEN_GAP, nan if seen is None else seen, "s", "exact", "the recording", covers_seen)
    return Finding("mixed gaps", limit, "s", "sufficient", "", covers_expected, conditions=(occurred,), demand=expected)

"""The largest finding of the page of a run names what lies near it, and says that nothing does only where so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cosim.evaluation.spec import Phase, ReportSpec
from cosim.report.page.run_marks import run_marks
from cosim.report.page.run_verdict import largest_finding, observer_statuses
from cosim.results.result import BaliseRecord, Result

SPEC = ReportSpec(
    true_position="train.position", true_speed="train.speed", observers=["obs"], phases=[Phase("all", 0.0, 20.0)]
)
WORST = 12.0
"""Time of the largest error [s]."""


def finding(*stamps: float, zone: float | None = None, phase: float | None = None, latency: float = 0.0) -> str:
    """The largest finding of a run of 20 s with telegrams, a zone that ends and a phase that begins."""
    table = np.zeros(201, [(name, "f8") for name in ("time", "train.speed", "train.position", "obs.speed")])
    table["time"] = np.arange(201) / 10.0
    table["train.speed"] = table["obs.speed"] = 10.0
    table["obs.speed"][120] = 10.5
    result = Result(table, [], events=[BaliseRecord(t, t + latency, f"I{k}", 0.0, 0.0) for k, t in enumerate(stamps)])
    phases = [Phase("first", 0.0, phase), Phase("second", phase, 20.0)] if phase is not None else SPEC.phases
    spec = replace(SPEC, phases=phases, zones=[(0.0, zone)] if zone is not None else [])
    return largest_finding(result, spec, observer_statuses(result, spec), run_marks(result, spec))


def test_a_telegram_at_the_instant_a_zone_that_ended_and_a_phase_that_began_are_named() -> None:
    said = finding(3.0, 12.03, zone=11.0, phase=10.5)
    assert "at 12 s: " in said
    assert "low adhesion until 1.00 s before (0 to 11 s)" in said
    assert "phase second began 1.50 s before (10.5 to 20 s)" in said
    assert "balise I1 at 0 m, at that instant" in said


TIMES = st.integers(1, 199).map(lambda tenth: tenth / 10.0)


@given(stamp=TIMES, zone=TIMES, phase=TIMES, latency=st.sampled_from([0.0, 0.05, 0.5]))
def test_nothing_is_said_to_lie_near_only_where_nothing_does(
    stamp: float, zone: float, phase: float, latency: float
) -> None:
    near = zone >= WORST - 3.0 or 0.0 <= WORST - phase <= 3.0 or stamp - 0.1 <= WORST <= stamp + latency + 0.1
    assert ("No fault" in finding(stamp, zone=zone, phase=phase, latency=latency)) is not near


def test_a_telegram_on_its_way_is_named_with_both_instants() -> None:
    said = finding(3.0, 11.7, latency=0.35)
    assert "balise I1 was passed at 11.7 s, and its telegram came at 12.05 s" in said

"""Error control by step doubling: the tolerance is kept, times are exact, nothing is told twice."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled_runs import Balises, Listener, Motion, Pushed, Staircase, block, positions, run
from hypothesis import example, given, settings
from hypothesis import strategies as st
from linear_runs import run_cut
from mock_slaves import Counter, component
from test_fmus.masses import Chain, cuts

from cosim.balises.telegram import Channel, FalseTelegram
from cosim.errors import CouplingError
from cosim.master.control.doubling import DoublingStep, _between

CHAIN = Chain.two(damping=0.1)


def doubling(tolerance: float, order: int = 2, smallest: float | None = None) -> Any:
    return lambda system: DoublingStep(system, tolerance, order, smallest)


@pytest.mark.parametrize(("inputs", "order"), [("hold", 2), ("extrapolate", 3)])
def test_a_smaller_tolerance_gives_a_smaller_error(inputs: str, order: int, tmp_path: Path) -> None:
    """An error of tol in every step of length h adds up to tol/h at most, times the growth of the whole (below e
    here).
    """
    cut = cuts(CHAIN)["displacement-displacement"]
    errors, steps = [], []
    for tolerance in (1e-3, 1e-4, 1e-5):
        seen = run_cut(cut, CHAIN, tmp_path, 0.1, 10, inputs=inputs, control=doubling(tolerance, order))
        statistics = seen.master.control.statistics
        np.testing.assert_array_equal(seen.table["time"], [k * 0.1 for k in range(11)])
        assert statistics.forced == 0
        assert statistics.worst <= 1.0
        assert seen.error < np.e * tolerance / statistics.shortest
        errors.append(seen.error)
        steps.append(statistics.accepted)
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]
    assert steps[0] < steps[1] < steps[2]


def test_long_steps_where_nothing_happens(tmp_path: Path) -> None:
    quiet = Chain.two(damping=8.0)  # at rest after a few seconds
    seen = run_cut(cuts(quiet)["displacement-displacement"], quiet, tmp_path, 0.5, 60, control=doubling(1e-4))
    statistics = seen.master.control.statistics
    assert statistics.shortest < 0.02
    assert seen.master.control._level == 0  # the last steps are whole communication steps
    assert statistics.rejected < 0.2 * statistics.accepted


def test_where_the_smallest_step_does_not_reach_it_is_reported(tmp_path: Path) -> None:
    seen = run_cut(
        cuts(CHAIN)["displacement-displacement"], CHAIN, tmp_path, 0.1, 10, control=doubling(1e-8, smallest=0.025)
    )
    control = seen.master.control
    assert control.statistics.forced > 0
    assert control.statistics.shortest == pytest.approx(0.025)
    assert control.summary()["first_forced_at"] == 0.0
    assert "set a smaller master.smallest_step" in control.warnings()[0]


def test_it_needs_states() -> None:
    class Stateless(Counter):
        pass

    parts = [component(Stateless(), "counter")]
    parts[0].description.coSimulation.canGetAndSetFMUstate = False
    parts[0].capabilities = type(parts[0].capabilities)()
    with pytest.raises(CouplingError, match=r"Error control .* steps back, .* cannot save their state: counter"):
        run(parts, [], 0.1, 5, control=doubling(1e-3))


def test_a_system_that_is_exact_is_not_changed_by_steps_that_are_taken_back() -> None:
    """Constant acceleration, the balises found by rollback: rows, telegrams and counts as with fixed steps."""
    parts = [block(Staircase(), "steps"), block(Pushed(), "plant"), block(Listener(), "listener")]
    pairs = [("steps.push", "plant.push"), ("plant.speed", "listener.speed")]
    balises = Balises(positions(3.3, 7.1, 11.0), receivers=["listener"])
    seen = run(parts, pairs, 0.1, 15, balises, control=doubling(1e-6))
    again = [block(Motion(), "plant"), block(Listener(), "listener")]
    reported = run(
        again, [("plant.speed", "listener.speed")], 0.1, 15, Balises(positions(3.3, 7.1, 11.0), receivers=["listener"])
    )
    assert seen["listener.heard"][-1] == reported["listener.heard"][-1] == 3.0
    assert [e.identity for e in seen.events] == [e.identity for e in reported.events]
    assert seen.master.control.statistics.rejected > 0
    assert seen["plant.position"][np.searchsorted(seen.time, [e.stamp - 1e-9 for e in seen.events])] == pytest.approx(
        [3.3, 7.1, 11.0], abs=1e-9
    )


@pytest.mark.parametrize("version", [2, 3])
def test_telegrams_on_their_way_are_neither_lost_nor_delivered_twice(version: int) -> None:
    """Late, overtaking and missed telegrams: with steps taken back the same ones arrive, at the same times."""

    def telegrams(**how: Any) -> Any:
        parts = [block(Motion(), "plant"), block(Listener(), "listener", version)]
        channel = Channel(
            latency=0.12, latency_jitter=0.15, missed_fraction=0.3, seed=3, false_telegrams=(FalseTelegram(0.9, 2.0),)
        )
        balises = Balises(positions(*(0.7 * k for k in range(1, 28))), receivers=["listener"], channel=channel)
        starts = {"plant": {"a": 2.0}}  # what the listener integrates is not what it holds: steps are rejected
        return run(parts, [("plant.speed", "listener.speed")], 0.1, 15, balises, starts=starts, **how)

    fixed, doubled = telegrams(), telegrams(control=doubling(1e-4))
    assert doubled.master.control.statistics.rejected > 0
    assert doubled.master.balises.passed == fixed.master.balises.passed > 20
    for seen in (fixed, doubled):
        assert {e.kind for e in seen.events} == {"true", "missed", "false"}
    kinds = [{e.identity: e.kind for e in seen.events} for seen in (fixed, doubled)]
    assert kinds[0] == kinds[1]
    arrivals = [sorted(e.delivered_at for e in seen.events if e.kind == "true") for seen in (fixed, doubled)]
    # an FMI 2 receiver that takes one telegram a step is told of a second one at the end of the step, which is shorter
    # here
    assert arrivals[1] == pytest.approx(arrivals[0], abs=1e-9 if version == 3 else 0.1)
    assert {e.outcomes["listener"] for e in doubled.events if e.kind != "missed"} <= {"accepted", "replayed"}
    assert doubled["listener.heard"][-1] == fixed["listener.heard"][-1]


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e2), st.integers(0, 12))
@example(t=-0.622, h=1.622, level=0)
@settings(max_examples=60)
def test_parts_of_a_step_meet_exactly(t: float, h: float, level: int) -> None:
    until = t + h
    ends = [_between(t, until, place, level + 1) for place in range(2**level)]
    assert ends[0][0] == t
    assert ends[-1][2] == until
    assert all(a[2] == b[0] for a, b in pairwise(ends))
    halves = _between(t, until, 0, level + 2)
    assert halves[2] == ends[0][1]

"""The wheel that jams and skids: distances in closed form, edges between communication points, all three causes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import outputs, started

from plant_models import PLANTS
from plant_models.hybrid import Runtime

STATED = PLANTS["wheel_fault"]()
DRAWN = PLANTS["wheel_fault"](cause="drawn")
ADHESION = PLANTS["wheel_fault"](cause="adhesion")
JAM, SKID = -1.0, 1.0


def _fault(i: int, onset: float, length: float, depth: float = 1.0, kind: float = JAM) -> dict[str, float]:
    names = ("onset", "length", "depth", "kind")
    return {f"fault_{name}[{i}]": v for name, v in zip(names, (onset, length, depth, kind), strict=True)}


def _driven(system: Any, inputs: list[float], **changes: float) -> Runtime:
    u0 = np.concatenate([inputs, np.zeros(len(system.input_signals) - 4)])
    return started(system, None, None, u0, **changes)


# -- given ------------------------------------------------------------------------------------------------------------


@given(
    speed=st.floats(0.0, 60.0),
    onset=st.floats(0.0, 1.0),
    length=st.floats(0.0, 1.0),
    depth=st.floats(0.0, 1.0),
    kind=st.sampled_from([JAM, SKID]),
    step=st.sampled_from([0.01, 0.05, 0.25, 2.5]),
)
@settings(max_examples=25)
def test_the_distance_is_exact_wherever_the_edges_lie(
    speed: float, onset: float, length: float, depth: float, kind: float, step: float
) -> None:
    runtime = _driven(STATED, [speed, 0.0, 1e9, 0.0], **_fault(1, onset, length, depth, kind))
    for k in range(1, round(2.5 / step) + 1):
        runtime.advance(k * step)
    expected = speed * (2.5 + kind * depth * length)
    # 250 additions of 150 m round to 1e-11 m; the edge is found to some ulp of the time
    assert outputs(runtime)["wheel_distance"] == pytest.approx(expected, abs=1e-9)


def test_a_jam_and_a_skid_are_what_the_outputs_say() -> None:
    faults = {**_fault(1, 1.0, 0.5, 0.8), **_fault(2, 2.0, 0.5, 0.25, SKID)}
    runtime = _driven(STATED, [20.0, -1.0, 1e9, 0.0], **faults, jam_loss=0.5, skid_loss=0.4)
    seen = {}
    for t in (0.99, 1.0, 1.49, 1.5, 2.0, 2.5):
        runtime.advance(t)
        y = outputs(runtime)
        seen[t] = (y["wheel_speed"], y["active"], y["depth"], y["effort_loss"], y["faults_unfinished"])
    rolling = (20.0, 0.0, 0.0, 0.0)
    assert seen[0.99] == (*rolling, 2.0)
    assert seen[1.0] == seen[1.49] == pytest.approx((4.0, 1.0, -0.8, 0.4, 2.0))
    assert seen[1.5] == (*rolling, 1.0)
    assert seen[2.0] == pytest.approx((25.0, 1.0, 0.25, 0.1, 1.0))
    assert seen[2.5] == (*rolling, 0.0)


def test_from_the_position_only_faults_feel_the_held_speed() -> None:
    wheel = PLANTS["wheel_fault"](distance_from="position")
    runtime = started(wheel, None, None, [0.0, 0.0, 1e9, 0.0, 5.0], **_fault(1, 1.0, 0.5, 1.0))
    for k in range(1, 41):  # the train: position 5 + t^2, speed 2 t
        runtime.u[0] = 2.0 * 0.05 * (k - 1)
        runtime.advance(0.05 * k)
        runtime.u[4] = 5.0 + (0.05 * k) ** 2
        lost = sum(0.05 * 2.0 * 0.05 * (j - 1) for j in range(21, 31) if j <= k)
        # the jam is missing, by ten held speeds; the train's own distance is exact
        assert outputs(runtime)["wheel_distance"] == pytest.approx(runtime.u[4] - lost, abs=1e-12)
    with pytest.raises(ValueError, match=r"unknown distance_from 'rail'; choose one of: speed, position"):
        PLANTS["wheel_fault"](distance_from="rail")


def test_a_micro_jam_is_in_the_distance_and_in_no_sample() -> None:
    runtime = _driven(STATED, [30.0, 0.0, 1e9, 0.0], **_fault(1, 0.101, 0.003))
    speeds = []
    for k in range(1, 21):
        runtime.advance(0.05 * k)
        speeds.append(outputs(runtime)["wheel_speed"])
    assert set(speeds) == {30.0}
    assert outputs(runtime)["wheel_distance"] == pytest.approx(30.0 * (1.0 - 0.003), abs=1e-10)


@pytest.mark.parametrize(("released_at", "end"), [(1.1, 1.246), (1.9, 2.0), (0.5, 1.146)])
def test_a_released_brake_frees_a_jammed_wheel_after_the_release_time(released_at: float, end: float) -> None:
    # released before the jam: its clock begins with the jam
    runtime = _driven(STATED, [10.0, 0.0, 1e9, 0.0], **_fault(1, 1.0, 1.0))
    runtime.advance(released_at)
    runtime.u[3] = 1.0
    runtime.advance(3.0)
    assert outputs(runtime)["wheel_distance"] == pytest.approx(10.0 * (3.0 - (end - 1.0)), abs=1e-9)
    assert outputs(runtime)["faults_unfinished"] == 0.0


def test_a_released_brake_does_not_end_a_skid() -> None:
    runtime = _driven(STATED, [10.0, 0.0, 1e9, 1.0], **_fault(1, 1.0, 1.0, 0.5, SKID))
    runtime.advance(3.0)
    assert outputs(runtime)["wheel_distance"] == pytest.approx(35.0, abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({**_fault(1, 1.0, 1.0), **_fault(2, 1.5, 1.0)}, r"fault 2 overlaps one before it.*fault_onset\[2\] = 1.5"),
        (_fault(1, 1.0, -0.2), r"fault_length\[1\] must be a finite number, at least 0 s"),
        (_fault(1, 1.0, 1.0, 1.2), r"fault_depth\[1\] must be a finite number, at least 0 and at most 1"),
        (_fault(3, 1.0, 1.0, 1.0, 0.0), r"fault 3 is neither jam nor skid.*fault_kind\[3\] = 0"),
        ({"release_time": 0.0}, r"release_time must be a finite number, at least 1e-06 s"),
    ],
)
def test_faults_that_are_none_are_refused_in_words(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        started(STATED, None, **changes)


def test_faults_that_touch_do_not_overlap_and_unused_ones_never_do() -> None:
    started(STATED, None, **_fault(1, 1.0, 1.0), **_fault(2, 2.0, 1.0), **_fault(3, 1.5, 0.0))


def test_unknown_causes_and_counts_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"Unknown cause 'luck'; choose one of: adhesion, .*stated, .*or write file.py"
    ):
        PLANTS["wheel_fault"](cause="luck")
    with pytest.raises(ValueError, match="fault_count must be at least 1, got 0"):
        PLANTS["wheel_fault"](fault_count=0)


# -- drawn ------------------------------------------------------------------------------------------------------------


def _intervals(effort: float, seconds: float, **changes: float) -> list[tuple[float, float, float]]:
    """Onset, end and depth of every fault drawn, read off the memory at each draw."""
    runtime = _driven(DRAWN, [10.0, effort, 1e9, 0.0], **changes)
    found = []
    for k in range(round(seconds / 0.1) + 1):
        runtime.advance(0.1 * k)
        onset, end, sign, depth = runtime.x[2:6]
        if onset >= 0.0 and (not found or found[-1][0] != onset):
            found.append((float(onset), float(end), float(sign * depth)))
    return found


def test_lengths_depths_and_gaps_of_drawn_jams_have_the_distributions_declared() -> None:
    faults = np.array(_intervals(-1.0, 1200.0, jam_rate=0.5, mean_length=0.4, seed=3.0))
    lengths, depths = faults[:, 1] - faults[:, 0], -faults[:, 2]
    n = len(faults)
    gaps = faults[1:, 0] - faults[:-1, 1]  # from the end of one to the onset of the next; up to a draw period is lost
    assert n > 400
    # four standard errors of a mean; the exponential distribution has its mean as standard deviation
    assert lengths.mean() == pytest.approx(0.4, abs=4.0 * 0.4 / np.sqrt(n))
    assert depths.mean() == pytest.approx(0.6, abs=4.0 * 0.8 / np.sqrt(12.0 * n))
    assert depths.min() >= 0.2
    assert depths.max() <= 1.0
    assert gaps.min() >= 0.0
    assert gaps.mean() == pytest.approx(2.0 + 0.05, abs=4.0 * 2.0 / np.sqrt(n) + 0.05)


def test_jams_come_while_braking_skids_while_pulling_and_none_while_coasting() -> None:
    assert {np.sign(depth) for *_, depth in _intervals(-1.0, 60.0, jam_rate=2.0)} == {-1.0}
    assert {np.sign(depth) for *_, depth in _intervals(1.0, 60.0, skid_rate=2.0)} == {1.0}
    assert _intervals(0.0, 60.0, jam_rate=2.0, skid_rate=2.0) == []


def test_a_drawn_jam_ends_with_its_effort() -> None:
    runtime = _driven(DRAWN, [10.0, -1.0, 1e9, 0.0], jam_rate=1e3, mean_length=1e3, longest_length=1e3, least_depth=1.0)
    runtime.advance(1.0)
    assert outputs(runtime)["depth"] == -1.0
    runtime.u[1] = 0.0
    assert outputs(runtime)["depth"] == 0.0
    runtime.u[1] = -1.0  # taken back for no time: still locked
    assert outputs(runtime)["depth"] == -1.0
    runtime.u[1] = 0.0
    runtime.advance(1.0 + 0.147)
    runtime.u[1] = -1.0  # for the release time: free, until the next one is drawn
    assert outputs(runtime)["depth"] == 0.0


def test_equal_seeds_give_equal_faults_and_a_restored_run_goes_on_with_them() -> None:
    def run(seed: float, restore: bool = False) -> float:
        runtime = _driven(DRAWN, [10.0, -1.0, 1e9, 0.0], jam_rate=1.0, seed=seed)
        runtime.advance(7.03)
        if restore:
            kept = runtime.snapshot()
            runtime.advance(11.0)
            runtime.restore(kept)
        runtime.advance(20.0)
        return outputs(runtime)["wheel_distance"]

    assert run(1.0) == run(1.0) == run(1.0, restore=True)
    assert run(1.0) != run(2.0)


def test_depths_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ValueError, match="most_depth must not lie below least_depth"):
        started(DRAWN, None, least_depth=0.9, most_depth=0.5)


# -- adhesion ---------------------------------------------------------------------------------------------------------


def test_too_much_brake_locks_the_wheel_in_the_lock_time_and_a_wheel_that_may_roll_does_in_the_release_time() -> None:
    runtime = _driven(ADHESION, [20.0, -10.0, 5.0, 0.0])
    runtime.advance(0.05)
    assert outputs(runtime)["depth"] == pytest.approx(-0.5, abs=1e-12)
    runtime.advance(1.0)
    assert outputs(runtime)["depth"] == -1.0
    # the lock takes 0.1 s, in which the wheel turns half as far as it would
    assert outputs(runtime)["wheel_distance"] == pytest.approx(20.0 * 0.05, abs=1e-9)
    runtime.u[1] = -4.5  # below the limit and above sliding: still locked
    runtime.advance(2.0)
    assert outputs(runtime)["depth"] == -1.0
    runtime.u[1] = -3.9  # below sliding, 0.8 of the limit
    runtime.advance(2.0 + 0.073)
    assert outputs(runtime)["depth"] == pytest.approx(-0.5, abs=1e-9)
    runtime.advance(3.0)
    assert outputs(runtime)["depth"] == 0.0
    runtime.u[1] = -4.5  # the same demand does not lock a wheel that rolls
    runtime.advance(4.0)
    assert outputs(runtime)["depth"] == 0.0
    assert outputs(runtime)["wheel_distance"] == pytest.approx(20.0 * (0.05 + 0.073 + 2.0 - 0.146), abs=1e-9)


def test_a_released_brake_frees_a_locked_wheel_although_it_is_demanded() -> None:
    runtime = _driven(ADHESION, [20.0, -10.0, 5.0, 0.0])
    runtime.advance(1.0)
    runtime.u[3] = 1.0
    runtime.advance(1.2)
    assert outputs(runtime)["depth"] == 0.0


def test_too_much_traction_spins_the_wheel() -> None:
    runtime = _driven(ADHESION, [20.0, 10.0, 5.0, 0.0], spin_depth=0.4, skid_loss=0.5)
    runtime.advance(1.0)
    found = outputs(runtime)
    assert found["depth"] == pytest.approx(0.4)
    assert found["wheel_speed"] == pytest.approx(28.0)
    assert found["effort_loss"] == pytest.approx(0.2)
    runtime.u[1] = -10.0  # from spinning to locked, through rolling
    runtime.advance(2.0)
    assert outputs(runtime)["depth"] == -1.0
    runtime.u[1] = 0.0
    runtime.advance(3.0)
    assert outputs(runtime)["depth"] == 0.0


def test_a_sliding_share_above_one_is_refused() -> None:
    with pytest.raises(ValueError, match="sliding_share must be at most 1"):
        started(ADHESION, None, sliding_share=1.1)

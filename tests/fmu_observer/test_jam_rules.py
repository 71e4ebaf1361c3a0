"""Jam rules: the printed ones rule by rule and their latch-up, the repaired ones and the theorem of
docs/theses/jam_detection.md.
"""

from __future__ import annotations

from collections import namedtuple
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from jam_members import PERIOD, Members
from scipy.linalg import expm, solve_discrete_lyapunov

from fmu_observer.design.jam_recovery import estimate_noise, held_position_error, recovery_bounds
from fmu_observer.design.quasi_lpv_published import SECTION_3_3_4, SECTION_5_3_1
from fmu_observer.detection.jam_detector import RULES, JamDetector, _PrintedRules
from fmu_observer.detection.jam_rules import Passing, Reading
from fmu_observer.detection.repaired_jam_rules import (
    HELD,
    TRUSTED,
    UNCONFIRMED,
    RepairedRules,
    _agreement_limit,
    certain_fault,
)
from fmu_observer.observers.train import QuasiLpvUio
from fmu_observer.observers.train.quasi_lpv_uio import speed_errors
from plant_models.hybrid import Runtime

SHARED = {"odometer_period": PERIOD, "threshold": 0.9, "residual_gain": 2.3, "arming_delay": 0.0}
PRINTED = SimpleNamespace(**SHARED, rule_4=0.0, rule_delay=1.0)
P = SimpleNamespace(**SHARED, **{s.name: s.start for s in RepairedRules.parameters})
RuleMemory: Any = namedtuple("RuleMemory", [s.name for s in RepairedRules.memory])
PrintedMemory: Any = namedtuple("PrintedMemory", [s.name for s in _PrintedRules.memory])
ARMED = RuleMemory(TRUSTED, 0.0, 0.0, 9.0, 0.0, 20.0, 9.0, 0.0, 99.0, -99.0, 0.0, 20.0)  # while braking
THETA = 0.9 / 2.3


def after(before: Any, evaluated: Any) -> Any:
    """A judgement whose memory is all of it."""
    return evaluated._replace(memory=before._replace(**evaluated.memory))


def printed(readings: list[float], speed: float, p: Any = PRINTED) -> list[tuple[float, float]]:
    """(F, R) in force at each sample beside an estimate that stays."""
    memory = PrintedMemory(*(0.0 for _ in _PrintedRules.memory))
    found = []
    for y in readings:
        memory = after(memory, _PrintedRules().at_sample(memory, Reading(y, speed, 2.3 * (y - speed), -1.0), p)).memory
        found.append((float(memory.fault_state), float(memory.recovering_state)))
    return found


def repaired(before: Any, y: float, speed: float, effort: float = -1.0, p: Any = P) -> Any:
    reported = Reading(y, speed, p.residual_gain * (y - speed), effort)
    return after(before, RepairedRules().at_sample(before, reported, p))


# -- printed
# --------------------------------------------------------------------------------------------------------


def test_the_printed_rules_take_effect_a_sample_late() -> None:
    #         falls     beyond eps  still  rises   falls   falls
    assert printed([20.0, 19.0, 18.9, 19.9, 19.8, 19.7], 20.0) == [(0, 0), (0, 0), (1, 0), (1, 0), (1, 1), (0, 0)]


def test_without_the_delay_they_take_effect_at_the_sample_that_shows_it() -> None:
    at_once = SimpleNamespace(**SHARED, rule_4=0.0, rule_delay=0.0)
    reported = printed([20.0, 19.0, 18.9, 19.9, 19.8, 19.7], 20.0, at_once)
    assert reported == [(0, 0), (1, 0), (1, 0), (1, 1), (0, 0), (0, 0)]


def test_the_printed_fault_stays_for_ever_where_the_reading_only_falls() -> None:
    """The latch-up: the wheel rolls, and nothing ends the fault."""
    falling = [20.0 - 0.18 * k for k in range(100)]
    assert printed(falling, 20.0)[-1] == (1.0, 0.0)


def test_rule_4_calls_a_rise_a_fault_and_rule_5_a_standing_wheel() -> None:
    rising = [20.0, 19.9, 19.95, 19.9, 19.85, 19.8]
    assert (1.0, 1.0) not in printed(rising, 19.9)
    assert (1.0, 1.0) in printed(rising, 19.9, SimpleNamespace(**SHARED, rule_4=1.0, rule_delay=1.0))
    memory = PrintedMemory(1.0, 1.0, 1.0, 1.0, 0.5, 9.0)  # rule 3 and rule 5 at once: the later one counts
    evaluated = _PrintedRules().at_sample(memory, Reading(0.0, 0.1, -0.2, -1.0), PRINTED)
    assert evaluated.memory["next_fault_state"] == 1.0


def test_the_printed_rules_know_no_balises() -> None:
    memory = PrintedMemory(*(0.5 for _ in _PrintedRules.memory))
    assert _PrintedRules().at_balise(memory, Passing(4.0, 200.0, 9.0, 200.0, 0.0, 0.0, 1.0), PRINTED).memory == {}


# -- repaired, sample by sample
# ------------------------------------------------------------------------------------


def test_a_fault_begins_at_the_sample_that_shows_it() -> None:
    for gap, expected in ((THETA - 1e-6, TRUSTED), (THETA + 1e-6, HELD)):
        evaluated = repaired(ARMED, 20.0 - gap, 20.0)
        assert evaluated.memory.odometer_mode == expected
        assert evaluated.onset == (expected == HELD)


def until(memory: Any, mode: float, y: float, speed: float, effort: float, p: Any = P) -> int:
    """Samples of one reading until a mode is reached; 0 where it is not within `hold_limit`."""
    for k in range(1, 80):
        memory = repaired(memory, y, speed, effort, p).memory
        if memory.odometer_mode == mode:
            return k
    return 0


@pytest.mark.parametrize(
    ("offset", "effort", "lasting"),
    [(-2, -1.0, 75), (2, -1.0, 6), (2, 1.0, 75), (-2, 1.0, 6), (2, 0.0, 75), (-2, 0.0, 75)],
)
def test_faults_of_both_signs_begin_and_those_against_the_effort_are_short(
    offset: int, effort: float, lasting: int
) -> None:
    """1.2 s of what the effort does not cause, 15 s of what it does; then the odometer is followed, and not trusted."""
    armed = ARMED._replace(effort_time=99.0 * effort)
    evaluated = repaired(armed, 20.0 + offset, 20.0, effort)
    assert (evaluated.memory.odometer_mode, evaluated.onset, evaluated.restart) == (HELD, 1.0, 0.0)
    assert until(armed, UNCONFIRMED, 20.0 + offset, 20.0, effort) == lasting + 1
    without = SimpleNamespace(**{**vars(P), "sign_rule": 0.0})
    assert until(armed, UNCONFIRMED, 20.0 + offset, 20.0, effort, without) == 76


def test_a_hold_that_balises_began_ends_in_trust_where_samples_against_the_effort_last() -> None:
    """What balises corrected the speed by was a mean over the way, and at no jump of the wheel."""
    driven = ARMED._replace(odometer_mode=HELD, effort_time=99.0, last_odometer=18.0)
    for refutations, ends in ((2.0, TRUSTED), (1.0, UNCONFIRMED)):
        assert until(driven._replace(refutations=refutations), ends, 18.0, 20.0, 1.0) == 6


@pytest.mark.parametrize("offset", [-2.0, 2.0])
def test_an_odometer_that_is_not_proven_is_held_to_lie_for_a_second(offset: float) -> None:
    """The jump may be the end of a fault; the position is then what the odometer makes of it."""
    young = ARMED._replace(proven_time=4.0)
    assert until(young, UNCONFIRMED, 20.0 + offset, 20.0, 0.0) == 7
    assert until(young._replace(proven_time=8.0), UNCONFIRMED, 20.0 + offset, 20.0, 0.0) == 11
    last = repaired(young, 20.0 + offset, 20.0, 0.0).memory._replace(hold_time=1.0)
    evaluated = repaired(last, 20.0 + offset, 20.0, 0.0)
    assert (evaluated.restart, evaluated.withdrawn) == (1.0, 1.0)
    proven = repaired(last._replace(proven_time=20.0, hold_time=14.8), 20.0 + offset, 20.0, 0.0)
    assert (proven.restart, proven.withdrawn) == (1.0, 0.0)


def test_an_odometer_is_proven_by_rolling_by_its_start_and_by_balises_and_not_for_longer_than_the_next_stop() -> None:
    start = RuleMemory(*(float(s.start) for s in RepairedRules.memory))
    assert repaired(start, 20.0, 20.1).memory.proven_time == 20.0
    memory = repaired(start, 15.0, 20.0).memory  # it contradicts the speed that the start was told
    assert memory.proven_time == 0.0
    for _ in range(99):
        memory = repaired(memory, 15.0, 15.0).memory
    assert memory.proven_time == pytest.approx(19.8)
    assert repaired(memory, 15.0, 15.0).memory.proven_time == pytest.approx(20.0)
    assert at_balise(memory, passing(200.0)).memory.proven_time == 20.0
    assert repaired(ARMED, 0.1, 0.0).memory.proven_time == 0.0
    assert repaired(ARMED, 0.0, 9.0).memory.proven_time == 20.0  # a wheel that locks


def test_before_faults_are_evaluated_an_odometer_that_is_not_proven_is_followed_where_it_jumps() -> None:
    young = ARMED._replace(proven_time=3.0, faults=1000.0, settled=0.0)
    assert repaired(young, 25.0, 20.0).restart == 1.0
    assert repaired(young._replace(proven_time=20.0), 25.0, 20.0).restart == 0.0
    assert repaired(young._replace(last_odometer=25.0), 25.0, 20.0).restart == 0.0


def test_nothing_is_evaluated_before_it_is_armed_or_near_standstill() -> None:
    for before in (ARMED._replace(faults=1000.0, settled=0.0), ARMED._replace(faults=3.0, settled=0.0)):
        assert repaired(before, 15.0, 20.0).memory.odometer_mode == TRUSTED
    late = SimpleNamespace(**{**vars(P), "arming_delay": 60.0})
    assert repaired(ARMED, 15.0, 20.0, p=late).memory.odometer_mode == TRUSTED
    assert repaired(ARMED, 0.0, 0.49).memory.odometer_mode == TRUSTED
    settling = ARMED._replace(faults=1000.0, settled=0.0)
    for _ in range(5):
        settling = repaired(settling, 20.0, 20.0).memory
    assert settling.faults == 0.0
    assert repaired(settling, 15.0, 20.0).memory.odometer_mode == HELD


def test_agreement_widens_with_the_time_held_and_takes_two_samples() -> None:
    for held, gap, expected in ((1.0, 0.45, TRUSTED), (1.0, 0.55, HELD), (4.0, 0.75, TRUSTED)):
        memory = ARMED._replace(odometer_mode=HELD, hold_time=held - PERIOD, last_odometer=20.0 - gap)
        first = repaired(memory, 20.0 - gap, 20.0)
        assert first.memory.odometer_mode == HELD
        second = repaired(first.memory, 20.0 - gap, 20.0)
        assert second.memory.odometer_mode == expected
        assert second.restart == (expected == TRUSTED)
    assert float(_agreement_limit(2.0, P)) == pytest.approx(0.9 + 2.3 * 0.1 * 2.0)


def test_a_wheel_that_jumps_does_not_roll() -> None:
    memory = ARMED._replace(odometer_mode=HELD, hold_time=5.0, agreeing=1.0, last_odometer=19.0)
    jumped = repaired(memory, 20.0, 20.0)  # 1 m/s in a sample: it agrees, and the row begins anew
    assert (jumped.memory.odometer_mode, jumped.memory.agreeing) == (HELD, 1.0)


def test_one_sample_too_fast_while_braking_moves_nothing() -> None:
    """A reading 20 % too high for 0.2 s is kept out, and the wheel is believed again at the second rolling sample."""
    memory, reported = ARMED, []
    for y in (24.0, 19.8, 19.6):
        evaluated = repaired(memory, y, 20.0)
        memory = evaluated.memory
        reported.append((memory.odometer_mode, float(evaluated.restart)))
    assert reported == [(HELD, 0.0), (HELD, 0.0), (TRUSTED, 1.0)]


@pytest.mark.parametrize("before", [-9.0, 0.0, 0.8])
def test_a_driven_wheel_that_was_braked_of_late_may_have_jammed(before: float) -> None:
    evaluated = repaired(ARMED._replace(effort_time=before), 19.0, 20.0, effort=1.0)
    assert (evaluated.memory.odometer_mode, evaluated.onset, evaluated.restart) == (HELD, 1.0, 0.0)


def test_a_brake_that_is_released_in_a_jam_believes_nothing() -> None:
    """Readings of a run on the line Amsterdam - Utrecht: a jam of 92 % and 0.3 s while the effort changes its sign.

    The second reading is a mean of the jam and of what follows it; the wheel is driven, and slower than the estimate.
    """
    memory, estimate, reported = ARMED._replace(last_odometer=22.11), 22.15, []
    for y, effort in ((14.74, -1307.0), (17.05, 7003.0), (22.11, 14278.0), (21.97, 20538.0)):
        evaluated = repaired(memory, y, estimate, effort)
        memory = evaluated.memory
        reported.append((memory.odometer_mode, float(evaluated.restart)))
    assert reported == [(HELD, 0.0), (HELD, 0.0), (HELD, 0.0), (TRUSTED, 1.0)]


def test_a_wheel_that_is_driven_for_twice_the_release_time_has_not_jammed() -> None:
    """From a second and a period after the change on, slow samples count; as many again, and the estimate gives up."""
    memory, reported = ARMED._replace(odometer_mode=HELD, hold_time=0.2), []
    for k in range(11):
        memory = repaired(memory, 19.0 + 0.01 * k, 22.0, effort=1.0).memory
        reported.append((memory.odometer_mode, float(memory.against)))
    assert reported == [*((HELD, float(max(0, k - 5))) for k in range(1, 11)), (UNCONFIRMED, 6.0)]


def test_a_hold_ends_at_its_limit_and_is_not_called_healthy() -> None:
    evaluated = repaired(ARMED._replace(odometer_mode=HELD, hold_time=P.hold_limit - PERIOD), 5.0, 20.0)
    memory = evaluated.memory
    assert (memory.odometer_mode, evaluated.restart, memory.faults) == (UNCONFIRMED, 1.0, 1000.0)
    rules = RepairedRules()
    assert (rules.fault(evaluated.memory), rules.recovering(evaluated.memory), rules.discarded(evaluated.memory)) == (
        1,
        1,
        0,
    )
    for _ in range(99):
        memory = repaired(memory, 5.0, 5.0).memory
    assert memory.odometer_mode == UNCONFIRMED
    memory = repaired(memory, 5.0, 5.0).memory  # 100 samples are the 20 s of trust_time
    assert (memory.odometer_mode, memory.faults) == (TRUSTED, 0.0)


# -- noise
# ----------------------------------------------------------------------------------------------------------

DESIGNS = {"as_published": SECTION_3_3_4, "as_published_5_3_1": SECTION_5_3_1}


@pytest.mark.parametrize("preset", DESIGNS)
@pytest.mark.parametrize("deviation", [0.05, 0.1])
def test_noise_that_is_stated_is_not_taken_for_faults(preset: str, deviation: float) -> None:
    """Wheels that roll, with the noise that is told: at most what is beyond four deviations, 1.1 an hour of samples.

    2.2 hours: the chance of more than 9 is 4e-4 at that rate (Poisson). The thresholds of the print alone have 40 and
    2767 in the design of chapter 5, 29 in that of section 3.3.4 at 0.1 m/s.
    """
    members, count, rng = 100, 400, np.random.default_rng(2)
    run = Members(members, -0.68, preset, **{**NO_DRAG, "odometer_noise": 4.0 * deviation})
    v = wheel(rng, members, count * PERIOD)
    run.x[1], run.x[2], run.x[7] = v[0], 0.12, 0.12
    onsets, mode = 0, np.full(members, TRUSTED)
    for k in range(count):
        run.sample(v[k] + deviation * rng.standard_normal(members))
        onsets += int(((run.rule("odometer_mode") == HELD) & (mode != HELD)).sum())
        mode = run.rule("odometer_mode").copy()
    assert onsets <= 9
    assert (run.rule("faults") == 0.0).all()  # all were armed


def test_noise_that_is_stated_does_not_keep_an_odometer_from_being_proven() -> None:
    """20 s without a residual that noise does not explain; below eps / 2, 1.6 deviations, there are none such."""
    members, rng, deviation = 100, np.random.default_rng(3), 0.05
    run = Members(members, -0.68, "as_published_5_3_1", **{**NO_DRAG, "odometer_noise": 4.0 * deviation})
    run.set_rules(odometer_mode=UNCONFIRMED, faults=1000.0, samples=99.0)
    v = wheel(rng, members, 40.0)
    run.x[1], run.x[2], run.x[7] = v[0], 0.12, 0.12
    for k in range(len(v)):
        run.sample(v[k] + deviation * rng.standard_normal(members))
    assert (run.rule("odometer_mode") == TRUSTED).all()
    assert (run.rule("proven_time") >= run.p.trust_time - 1e-9).all()


@pytest.mark.parametrize("threshold", [0.4, 0.9])
@pytest.mark.parametrize("noise", [0.0, 0.08, 0.15, 0.4])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_fault_that_is_larger_than_noise_hides_is_seen_at_its_first_sample(
    threshold: float, noise: float, sign: float
) -> None:
    p = SimpleNamespace(**{**vars(P), "threshold": threshold, "odometer_noise": noise})
    for nu in np.linspace(-noise, noise, 9):
        evaluated = repaired(ARMED, 20.0 + sign * (certain_fault(p) + 1e-9) + nu, 20.0, p=p)
        assert evaluated.memory.odometer_mode == HELD
        assert repaired(ARMED, 20.0 + nu, 20.0, p=p).memory.odometer_mode == TRUSTED
    # At an estimate that was just set to a reading: independent noise of both.
    both = np.sqrt(2.0) * noise
    assert repaired(ARMED, 20.0 + sign * both * (1.0 - 1e-9), 20.0, p=p).memory.odometer_mode == TRUSTED


@pytest.mark.parametrize("preset", DESIGNS)
def test_the_noise_of_an_estimate_is_that_of_the_stationary_covariance(preset: str) -> None:
    """SciPy's exponential and Lyapunov equation; the printed gains make less noise than a reading has."""
    observer = QuasiLpvUio()
    p = observer.unpack_parameters(observer.start_parameters(preset))
    drifts, gains = speed_errors(p)
    F, G = [], []
    for A, K in zip(drifts, gains, strict=True):
        flown = expm(np.block([[A, K], [np.zeros((1, 4))]]) * PERIOD)
        F.append(flown[:3, :3] - np.outer(flown[:3, 3], [1.0, 0.0, 0.0]))
        G.append(flown[:3, 3])
    P = solve_discrete_lyapunov(0.5 * (F[0] + F[1]), np.outer(0.5 * (G[0] + G[1]), 0.5 * (G[0] + G[1])))
    noise = estimate_noise(drifts, gains, p)
    assert noise == pytest.approx(np.sqrt(P[0, 0]), rel=1e-3)  # products of mean and mean of products
    assert 0.5 < noise < 0.7
    assert estimate_noise(drifts, -gains, p) == np.inf


# -- repaired, at balises
# ------------------------------------------------------------------------------------------


def passing(way: float, believed: float = 200.0, **changed: float) -> Passing:
    return Passing(5.0, 200.0, way, believed, 0.0, 0.0, 1.0)._replace(**changed)


def at_balise(before: Any, reported: Passing) -> Any:
    return after(before, RepairedRules().at_balise(before, reported, P))


@pytest.mark.parametrize(("way", "expected"), [(197.1, True), (196.9, False), (202.9, True), (203.1, False)])
def test_the_way_of_the_odometer_is_right_within_1_m_and_1_percent(way: float, expected: bool) -> None:
    held = ARMED._replace(odometer_mode=HELD)
    evaluated = at_balise(held, passing(way))
    assert (evaluated.memory.odometer_mode == TRUSTED) == expected
    assert evaluated.restart == expected


def test_a_refuted_hold_corrects_the_speed_by_its_mean_error_and_halves_the_clock() -> None:
    evaluated = at_balise(ARMED._replace(odometer_mode=HELD, hold_time=9.0), passing(180.0, 210.0))
    assert evaluated.shift == pytest.approx(-2.0)  # 10 m too far in 5 s
    assert evaluated.memory.hold_time == 2.5


def test_an_odometer_that_is_believed_must_be_refuted_twice() -> None:
    first = at_balise(ARMED, passing(180.0)).memory
    assert first.odometer_mode == TRUSTED
    assert at_balise(first, passing(200.0)).memory.refutations == 0.0
    assert at_balise(first, passing(180.0)).memory.odometer_mode == HELD
    unconfirmed = ARMED._replace(odometer_mode=UNCONFIRMED)
    assert at_balise(unconfirmed, passing(180.0)).memory.odometer_mode == HELD
    assert at_balise(unconfirmed, passing(200.0)).memory.odometer_mode == TRUSTED


@pytest.mark.parametrize("changed", [{"known": 0.0}, {"duration": 0.5}, {"duration": 9.5}])
def test_a_way_with_a_change_in_it_says_nothing(changed: dict[str, float]) -> None:
    """No balise before; too short; longer than the mode has been what it is (9 s)."""
    held = ARMED._replace(odometer_mode=HELD, hold_time=3.0)
    evaluated = at_balise(held, passing(100.0, **changed))
    assert evaluated.memory[:5] == held[:5]
    assert evaluated.shift == 0.0


# -- the theorem
# ----------------------------------------------------------------------------------------------------


def wheel(rng: np.random.Generator, members: int, seconds: float) -> np.ndarray:
    """True speeds at the samples, shape (samples, members): braking at 0.3 to 1.2 m/s2, never to rest."""
    t = PERIOD * np.arange(round(seconds / PERIOD))
    rate, phase = rng.uniform(0.05, 0.2, members), rng.uniform(0.0, 6.0, members)
    return np.asarray(
        200.0 - (0.68 + rate) * t[:, None] - 0.05 * (np.cos(phase) - np.cos(0.1 * t[:, None] + phase)) / 0.1
    )


NO_DRAG = {"davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0, "odometer_noise": 0.02}


def test_a_by_agreement_it_is_believed_at_the_second_rolling_sample() -> None:
    """2000 jams of random length and depth; the model is wrong by delta at most."""
    members, rng = 2000, np.random.default_rng(0)
    onset_error, noise = 0.3, 0.02
    run = Members(members, -0.68, **NO_DRAG)
    run.set_rules(faults=0.0, settled=9.0, samples=99.0, proven_time=20.0)
    end = rng.integers(2, 60, members)  # samples until the wheel rolls
    depth = rng.uniform(0.05, 1.0, members)
    error = rng.uniform(-onset_error, onset_error, members)
    model_error = rng.uniform(-1.0, 1.0, members) * run.p.disturbance_bound
    v = 150.0 - (0.68 + 0.1) * PERIOD * np.arange(80)
    run.x[1] = v[0] + error
    run.x[2] = run.x[11 - 4] = 0.0
    run.x[2] = run.x[7] = 0.1 - model_error
    bounds = recovery_bounds(*speed_errors(run.p), run.p, onset_error=onset_error)
    assert bounds.agrees
    believed = np.full(members, -1)
    for k in range(80):
        now = v[k] * np.where(k < end, 1.0 - depth, 1.0) + rng.uniform(-noise, noise, members)
        held = (believed < 0) & (k > 0)
        assert (np.abs(run.x[1] - v[k])[held] <= onset_error + run.p.disturbance_bound * k * PERIOD + 1e-9).all()
        run.sample(now)
        if k == 0:
            assert (run.rule("odometer_mode") == HELD).all()
        believed = np.where((believed < 0) & (run.rule("odometer_mode") == TRUSTED), k, believed)
    late = (believed - end + 1) * PERIOD
    assert (believed > 0).all()
    assert late.max() <= bounds.agreement + 1e-9
    # Where the estimate is too low by more than theta the first sample shows it; the bound is met, not only kept.
    assert np.isclose(late, bounds.agreement).mean() > 0.5


@pytest.mark.parametrize("members", [500, 10000])
def test_b_from_every_state_it_is_believed_for_good_within_the_bound(members: int) -> None:
    """Observers whose estimate and memory are anything, beside wheels that roll."""
    rng, noise = np.random.default_rng(1), 0.02
    run = Members(members, -0.68, **NO_DRAG)
    bounds = recovery_bounds(
        *speed_errors(run.p), run.p, onset_error=0.3, disturbance_error=1.0, rate_error=0.2, curvature=5e-4
    )
    assert bounds.settles
    v = wheel(rng, members, bounds.any_state + 5.0)
    run.x[1] = v[0] + rng.uniform(-20.0, 20.0, members)
    run.x[2], run.x[3] = rng.uniform(-1.0, 1.0, members), rng.uniform(-0.2, 0.2, members)
    run.x[7], run.x[8] = run.x[2], run.x[3]
    run.set_rules(
        odometer_mode=rng.integers(0, 3, members),
        hold_time=rng.uniform(0.0, 15.0, members),
        agreeing=rng.integers(0, 5, members),
        settled=rng.integers(0, 9, members),
        faults=rng.choice([0.0, 1.0, 2.0, 3.0, 1000.0], members),
        last_odometer=v[0] + rng.uniform(-20.0, 20.0, members),
        samples=rng.integers(0, 99, members),
        effort_time=rng.uniform(-9.0, 9.0, members),
    )
    last = np.zeros(members)
    for k in range(len(v)):
        run.sample(v[k] + rng.uniform(-noise, noise, members))
        last = np.where(run.rule("odometer_mode") > TRUSTED, (k + 1) * PERIOD, last)
    assert last.max() <= bounds.any_state
    assert last.max() > run.p.trust_time  # some went all the way
    assert np.percentile(last, 99.0) < 60.0  # the bound, 107 s, is of the worst that could follow the worst
    assert (np.abs(run.x[1] - v[-1])).max() < 0.3


def test_b_holds_from_stop_to_stop() -> None:
    """Ten minutes at rest leave a disturbance as it was; from a departure on the settling time counts anew.

    Errors of disturbance and rate at the stop are any within the bounds of the theorem.
    """
    members, rng, noise = 200, np.random.default_rng(4), 0.02
    run = Members(members, -0.7, **NO_DRAG)
    bounds = recovery_bounds(*speed_errors(run.p), run.p, onset_error=0.3, curvature=0.0)
    run.x[1], run.x[2], run.x[3] = 0.0, rng.uniform(-0.6, 0.6, members), rng.uniform(-0.2, 0.2, members)
    run.set_rules(faults=0.0, settled=9.0, samples=99.0)
    learnt = run.x[2].copy()
    for _ in range(3000):
        run.sample(rng.uniform(-noise, noise, members))
    np.testing.assert_array_equal(run.x[2], learnt)
    assert np.abs(run.x[3]).max() < 1e-12
    run.effort, late = 0.7, 0.0
    for k in range(round((bounds.any_state + 5.0) / PERIOD)):
        v = 0.7 * PERIOD * k
        run.sample(v + rng.uniform(-noise, noise, members))
        large = run.p.residual_gain * np.abs(run.x[6]) > 0.5 * run.p.threshold
        late = k * PERIOD if large.any() else late
    assert (run.rule("odometer_mode") == TRUSTED).all()
    assert late <= bounds.any_state - run.p.trust_time


@pytest.mark.parametrize("preset", ["as_published", "as_published_5_3_1"])
def test_b_holds_for_a_speed_that_changes_from_period_to_period(preset: str) -> None:
    """Errors of followed odometers, with noise at its worst and scheduling at any speeds, by SciPy's exponentials."""
    observer, noise, members, count = QuasiLpvUio(), 0.02, 200, 200
    p = observer.unpack_parameters(observer.start_parameters(preset))._replace(odometer_noise=noise)
    drifts, gains = speed_errors(p)
    bounds = recovery_bounds(drifts, gains, p, onset_error=0.2, curvature=0.0)
    shares = np.linspace(0.0, 1.0, 6)
    F, G = [], []
    for s in shares:
        A, K = ((1.0 - s) * pair[0] + s * pair[1] for pair in (drifts, gains))
        flown = expm(np.block([[A, K], [np.zeros((1, 4))]]) * PERIOD)
        F.append(flown[:3, :3] - np.outer(flown[:3, 3], [1.0, 0.0, 0.0]))
        G.append(flown[:3, 3])
    rng = np.random.default_rng(3)
    chosen = rng.integers(0, len(shares), (members, count))
    F, G = np.array(F), np.array(G)
    response = np.array([(np.linalg.matrix_power(F[3], count - 1 - k) @ G[3])[0] for k in range(count)])
    error = rng.choice([-1.0, 1.0], (members, 3)) * [noise, 1.0, 0.2]
    largest = np.zeros(count)
    for k in range(count):
        now = chosen[:, k]
        error = np.einsum("mab,mb->ma", F[now], error) + noise * np.sign(response[k]) * G[now]
        largest[k] = p.residual_gain * (np.abs(error[:, 0]).max() + noise)
    after = np.arange(1, count + 1) * PERIOD > bounds.settle_time
    assert bounds.settles
    assert largest[after].max() < 0.5 * p.threshold
    assert 0.75 * bounds.steady_residual < largest[-1] <= bounds.steady_residual + 1e-5  # what is left of the start


def test_the_position_strays_by_no_more_than_its_bound_while_the_model_runs_alone() -> None:
    run = Members(1, -0.68, **NO_DRAG)
    run.set_rules(odometer_mode=HELD, faults=0.0, samples=99.0, proven_time=20.0)
    run.x[1], run.x[2], run.x[7] = 150.3, 0.1, 0.1
    run.x[2] += 0.1  # delta: the model brakes too much or too little
    true, way = 150.0 - 0.78 * PERIOD * np.arange(60), 0.0
    for k in range(50):
        run.sample(np.zeros(1))
        way += PERIOD * (true[k] - 0.5 * 0.78 * PERIOD)
        bound = held_position_error((k + 1) * PERIOD, run.p, 0.3)
        assert abs(float(run.x[0][0]) - way) <= bound + 1e-9


@pytest.mark.parametrize("design", [SECTION_3_3_4, SECTION_5_3_1])
def test_where_noise_is_too_much_the_bounds_say_so(design: Any) -> None:
    run = Members(1, 0.0, odometer_noise=0.5, threshold=design.threshold, residual_gain=design.residual_gain)
    bounds = recovery_bounds(*speed_errors(run.p), run.p, onset_error=0.3)
    assert (bounds.agrees, bounds.settles, bounds.any_state) == (False, False, np.inf)
    drifts, gains = speed_errors(run.p)
    unstable = recovery_bounds(drifts, -gains, run.p, onset_error=0.0)
    assert unstable.steady_residual == np.inf


# -- the block
# ------------------------------------------------------------------------------------------------------


def test_the_presets_of_the_detector_are_the_published_designs() -> None:
    for name, design in (("as_published", SECTION_3_3_4), ("as_published_5_3_1", SECTION_5_3_1)):
        assert JamDetector.presets[name] == {"threshold": design.threshold, "residual_gain": design.residual_gain}


@pytest.mark.parametrize("rules", RULES)
def test_the_block_reports_a_jam(rules: Any) -> None:
    """An estimate that is exact; a wheel that jams from 10 s to 12 s and rolls again."""
    runtime = Runtime(JamDetector(rules))
    runtime.start(0.0)
    reported = []
    settled = [s.name for s in runtime.system.outputs].index("settled_time")
    for k in range(1, 100):
        t = k * PERIOD
        v = 40.0 - 0.9 * t
        y = v * (0.8 if 10.0 <= t - 1e-9 < 12.0 else 1.0)
        runtime.u[:4] = 2.3 * (y - v), y, v, -0.9
        runtime.advance(t)
        reported.append(float(runtime.update_outputs()[0]))
        if k == 40:  # samples from 0 s on, all of them with a residual of zero
            assert runtime.update_outputs()[settled] == pytest.approx(41 * PERIOD)
    on = PERIOD * (1 + np.flatnonzero(reported))
    late = PERIOD if rules == "printed" else 0.0
    assert on[0] == pytest.approx(10.2 + late)
    assert on[-1] == pytest.approx(12.4 if rules == "printed" else 12.2, abs=0.21)


def test_unknown_rules_are_refused() -> None:
    with pytest.raises(ValueError, match="jam_detector: unknown rules 'mine'; choose one of: repaired, printed"):
        JamDetector("mine")  # type: ignore[arg-type]

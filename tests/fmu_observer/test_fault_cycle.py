"""The four-vertex analysis: its closed forms against integration, and both dwell times."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from fmu_observer.certificates.fault_cycle import FaultCycle, first_crossing, overshoot, smallest_effort

A = np.array([[-101.5, 1.0, 0.0], [-2650.0, 0.0, 1.0], [-3750.0, 0.0, 0.0]])  # A_o - K C of 3.2.3
B = np.array([0.1, 0.0, 0.0])
EFFORT = -26.2230234287
START = np.array([0.02, -0.3, 0.5])
CYCLE = FaultCycle(A, B, EFFORT, 0.2, 0.5, 0.503, 0.65, 0.6525)


def integrated(time: float, cycle: FaultCycle = CYCLE) -> np.ndarray:
    """The four phases one after the other, by SciPy."""
    e, t = START.copy(), cycle.start
    for until, sign in (
        (cycle.onset, 0.0),
        (cycle.detection, -1.0),
        (cycle.end, 0.0),
        (cycle.recovery, 1.0),
        (np.inf, 0.0),
    ):
        stop = min(until, time)
        if stop > t:
            drive = sign * B * EFFORT
            e = solve_ivp(lambda _, x, d=drive: A @ x + d, (t, stop), e, method="DOP853", rtol=1e-12, atol=1e-15).y[
                :, -1
            ]
            t = stop
    return e


@pytest.mark.parametrize("time", [0.2, 0.35, 0.5, 0.5015, 0.503, 0.6, 0.651, 0.6525, 0.7, 1.4])
def test_the_error_is_that_of_integration_in_every_phase(time: float) -> None:
    """(3.24), (3.25), (3.27), (3.28) to nine digits of the largest error on the way."""
    assert np.allclose(CYCLE.error(time, START), integrated(time), rtol=1e-9, atol=1e-9 * 2.0)


def test_the_cycle_map_knows_only_the_dwell_times() -> None:
    assert np.allclose(CYCLE.over_the_cycle(START), CYCLE.error(CYCLE.recovery, START), rtol=1e-12)
    later = FaultCycle(A, B, EFFORT, 7.2, 7.5, 7.503, 7.65, 7.6525)
    assert np.allclose(later.over_the_cycle(START), CYCLE.over_the_cycle(START), rtol=1e-9)


def test_the_error_at_which_a_lasting_fault_ends_is_in_the_disturbance_alone() -> None:
    assert CYCLE.steady_error == pytest.approx([0.0, -2.6223, 0.0], abs=1e-4)
    lasting = FaultCycle(A, B, EFFORT, 0.0, 0.0, 30.0, 30.0, 30.0)
    assert np.allclose(lasting.error(29.0, START), CYCLE.steady_error, atol=1e-9)


@pytest.mark.parametrize(("decay", "beta"), [(1.0, 34.0), (1.4, 34.25)])
def test_the_overshoot_is_the_supremum_of_the_norm(decay: float, beta: float) -> None:
    found = overshoot(A, decay)
    assert found == pytest.approx(beta, abs=0.03)  # as printed in the specification
    times = np.geomspace(1e-3, 5.0, 100)
    sizes = [np.linalg.norm(expm(A * t), 2) * np.exp(decay * t) for t in times]
    assert found * 0.999 < max(sizes) <= found * (1.0 + 1e-12)


def test_the_overshoot_of_a_normal_matrix_is_one() -> None:
    assert overshoot(np.diag([-1.0, -3.0]), 0.5) == 1.0


def test_the_usable_dwell_time_is_one() -> None:
    """From it on no error is larger than at t_k, and some time before there is none to be had so cheaply."""
    until = CYCLE.next_start(START, 1.4)
    assert CYCLE.recovery < until < CYCLE.recovery + 3.0
    size = np.linalg.norm(START)
    assert all(np.linalg.norm(CYCLE.error(t, START)) <= size for t in np.linspace(until, until + 5.0, 60))


def test_the_printed_dwell_time_is_useless() -> None:
    cycle = FaultCycle(A, B, EFFORT, 0.0, 0.5, 0.503, 0.646, 0.65)
    assert np.linalg.norm(cycle.printed_phi()) > 1e15
    assert cycle.printed_next_start(START, 1.0) > 30.0
    assert cycle.next_start(START, 1.0) < 5.0


def test_when_a_fault_shows() -> None:
    crossing = first_crossing(A, B, EFFORT, 0.005)
    assert crossing == pytest.approx(2.13e-3, abs=1e-5)
    lasting = FaultCycle(A, B, EFFORT, 0.0, 0.0, 1.0, 1.0, 1.0)
    assert abs(lasting.error(crossing, np.zeros(3))[0]) == pytest.approx(0.005, rel=1e-9)
    peak = max(abs(lasting.error(t, np.zeros(3))[0]) for t in np.linspace(1e-4, 0.2, 200))
    assert peak == pytest.approx(0.0189, abs=1e-4)
    assert first_crossing(A, B, EFFORT, 1.01 * peak) == np.inf


def test_the_loss_of_a_weak_brake_never_shows() -> None:
    weakest = smallest_effort(A, B, 0.005)
    assert 0.1 * weakest == pytest.approx(2.6223 * 0.005 / 0.0189, rel=1e-3)  # 0.69 m/s2
    assert first_crossing(A, B, 1.001 * weakest, 0.005) == pytest.approx(0.0194, abs=1.5e-3)
    assert first_crossing(A, B, 0.999 * weakest, 0.005) == np.inf


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"error_matrix": -A}, "expected a stable one"),
        ({"effort_column": B[:2]}, r"expected \(n, n\) and \(n,\)"),
        ({"end": 0.4}, "in this order"),
        ({"recovery": np.nan}, "expected them finite"),
    ],
)
def test_bad_cycles_are_refused_in_words(wrong: dict[str, object], said: str) -> None:
    good = {
        "error_matrix": A,
        "effort_column": B,
        "effort": EFFORT,
        "start": 0.2,
        "onset": 0.5,
        "detection": 0.503,
        "end": 0.65,
        "recovery": 0.6525,
    }
    with pytest.raises(ValueError, match=said):
        FaultCycle(**{**good, **wrong})  # type: ignore[arg-type]


def test_questions_without_a_result_are_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"expected a time from 0\.2 s on"):
        CYCLE.error(0.1, START)
    with pytest.raises(ValueError, match="the error at t_k is zero"):
        CYCLE.next_start(np.zeros(3), 1.0)
    with pytest.raises(ValueError, match=r"decays at 1\.5 1/s; expected a decay below, got 2"):
        CYCLE.next_start(START, 2.0)

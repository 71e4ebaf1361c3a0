"""The train's Kalman filter against the equations with SciPy's exponentials, and where the odometer lies."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from observer_runner import SystemRunner

from fmu_observer import OBSERVERS
from fmu_observer.certificates.gap_findings import DECREASE, GROWTH
from fmu_observer.observers.train.balise_odometer_transition import transition

MASS, DRAG, EFFORT, PERIOD = 50e3, 800.0, 20e3, 0.1
VALUES = {"mass": MASS, "davis_a": 0.0, "davis_b": DRAG, "davis_c": 0.0, "creep_share": 0.02, "creep_time": 15.0}


def running(**values: float) -> SystemRunner:
    runner = SystemRunner(OBSERVERS["balise_odometer_ekf"](), **(VALUES | values))
    runner.set("u", {"effort": EFFORT, "odometer": 20.0})
    return runner


def exact(elapsed: float, drag: float, densities: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Transition and covariance of the noise over a time, by Van Loan's exponential."""
    A = np.zeros((4, 4))
    A[0, 1] = A[1, 2] = 1.0
    A[1, 1], A[3, 3] = -drag / MASS, -1.0 / VALUES["creep_time"]
    both = scipy.linalg.expm(np.block([[-A, np.diag([0.0, *densities, 0.0])], [np.zeros((4, 4)), A.T]]) * elapsed)
    F = both[4:, 4:].T
    return F, F @ both[:4, 4:]


def drift(speed: float, acceleration: float) -> float:
    """How fast an unknown acceleration diffuses that is one of 1 per cent for 500 m and a fifth of the effort for 10 s:
    a process of correlation time T and variance s does so with 2 s / T.
    """
    return 2.0 * (9.81 * 0.01) ** 2 / (500.0 / speed) + 2.0 * (0.2 * acceleration) ** 2 / 10.0


# The filter adds noise as if there were no drag, wrong by a share of slope times period, 1.6e-3, of what is added; its
# transition is a series, wrong by (1.6e-3)^4 / 24.
@pytest.mark.parametrize(("drag", "tolerance"), [(1e-9, 1e-10), (DRAG, 1e-4)])
def test_it_is_the_kalman_filter_of_the_linear_train(drag: float, tolerance: float) -> None:
    densities = (1e-3, 1e-4)
    runner = running(
        acceleration_density=densities[0], disturbance_density=densities[1], odometer_gate=100.0, davis_b=drag
    )
    runner.runtime.start(0.0)
    readings = 20.0 + 0.1 * np.sin(np.arange(100))
    x = np.array([0.0, 1.0, 0.0, 0.0])
    P, last = np.diag([100.0**2, 2.0**2, 0.1**2, 0.1**2]), 0.0
    steps = [(k * PERIOD, "odometer", readings[k]) for k in range(60)] + [(3.0441, "balise", 60.0)]
    steady = EFFORT / MASS
    for t, kind, measured in sorted(steps):
        if kind == "balise":
            runner.runtime.advance(t)
            runner.balise(measured)
        elif t > 0.0:
            runner.set("u", {"odometer": measured})
            runner.runtime.advance(t)
        F, _ = exact(t - last, drag, densities)
        once, twice = F[0, 1], F[0, 2]
        x = F @ x + steady * np.array([twice, once, 0.0, 0.0])
        F, QN = exact(t - last, drag, (densities[0], densities[1] + drift(x[1], EFFORT / MASS)))
        QN[3, 3] = (VALUES["creep_share"] * x[1]) ** 2 * (1.0 - F[3, 3] ** 2)
        P, last = F @ P @ F.T + QN, t
        row = np.array([[1.0, 0, 0, 0]] if kind == "balise" else [[0, 1.0, 0, 1.0]])
        S = row @ P @ row.T + (0.5**2 if kind == "balise" else 0.1**2)
        K = P @ row.T / S
        x, P = x + (K * (measured - row @ x)).ravel(), (np.eye(4) - K @ row) @ P
    found = runner.runtime.x
    upper = np.array([P[i, j] for i in range(4) for j in range(i, 4)])
    np.testing.assert_allclose(found[:4], x, rtol=tolerance, atol=tolerance)
    np.testing.assert_allclose(found[4:14], upper, rtol=20 * tolerance, atol=tolerance)


def test_a_locked_wheel_is_not_believed_and_the_reading_after_it_is() -> None:
    runner = running()
    runner.set("x", {"estimated_speed": 20.0})
    runner.runtime.start(0.0)
    reported, nis, likelihood = {}, [], {}
    for k in range(1, 200):
        t = k * PERIOD
        speed = 20.0 + (EFFORT - DRAG * 20.0) / MASS * t
        runner.set("u", {"odometer": 0.0 if 8.05 < t < 8.95 else speed})
        runner.runtime.advance(t)
        values = runner.outputs()
        reported[round(t, 1)] = (values["odometer_fault"], values["speed"] - speed)
        nis.append(values["nis"])
        likelihood[round(t, 1)] = values["innovation_likelihood"]
    assert [fault for t, (fault, _) in reported.items() if 8.05 < t < 8.95] == [1.0] * 9
    assert max(nis) <= 4.0**2  # of readings that were used: the gate is at four standard deviations
    during = [likelihood[round(8.0 + 0.1 * i, 1)] for i in range(10)]
    assert len(set(during)) == 1  # refused readings say nothing of how likely the others were
    assert not any(fault for t, (fault, _) in reported.items() if 2.0 < t < 8.0 or t > 9.05)
    # the true drag falls short of the linear one of the test's speed by 0.06 m/s in 20 s
    assert max(abs(error) for t, (_, error) in reported.items() if t > 5.0) < 0.1


def test_an_old_reading_is_moved_by_the_acceleration_since() -> None:
    """Readings are those of 0.4 s ago, on a train that gains 0.4 m/s each second."""
    off = {}
    for age in (0.0, 0.4):
        runner = running(davis_b=0.0, reading_age=age, odometer_deviation=0.01)
        runner.set("x", {"estimated_speed": 20.0})
        runner.set("u", {"odometer": 20.0 - 0.4 * 0.4})
        runner.runtime.start(0.0)
        for k in range(1, 300):
            runner.set("u", {"odometer": 20.0 + 0.4 * (k * PERIOD - 0.4)})
            runner.runtime.advance(k * PERIOD)
        off[age] = runner.outputs()["speed"] - (20.0 + 0.4 * 299 * PERIOD)
    assert off[0.4] == pytest.approx(0.0, abs=1e-6)
    assert off[0.0] < -0.01  # part of the 0.16 m/s, the rest is taken for creep


def test_a_train_that_stands_is_not_believed_to_run_backwards() -> None:
    runner = running(odometer_gate=100.0)
    runner.set("x", {"estimated_speed": 0.1, "estimated_creep": 1.0})
    runner.set("u", {"odometer": 0.0, "effort": 0.0})
    runner.runtime.start(0.0)
    assert runner.state("estimated_speed") == 0.0


def test_the_gate_of_telegrams_gets_three_standard_deviations() -> None:
    runner = running()
    x = np.zeros(runner.runtime.system.state_count)
    x[4] = 7.0**2
    assert runner.runtime.system.own_bound(runner.runtime.system.unpack_states(x), None) == pytest.approx(21.0)


def test_the_certificate_is_that_of_the_riccati_equation() -> None:
    """A balise at each reading: the settled filter is that of one equation with both measurements."""
    system = OBSERVERS["balise_odometer_ekf"]()
    values = {"acceleration_density": 1e-3, "disturbance_density": 1e-4, "davis_b": 0.0, "davis_c": 0.0}
    found = next(system.findings(PERIOD, values))
    F, QN = exact(PERIOD, 0.0, (1e-3, 1e-4 + drift(20.0, 0.3)))  # judged where the wheels creep as they may
    fade = np.exp(-PERIOD / 20.0)
    F[3, 3], QN[3, 3] = fade, (0.01 * 20.0) ** 2 * (1.0 - fade**2)
    C, RN = np.array([[0, 1.0, 0, 1.0], [1.0, 0, 0, 0]]), np.diag([0.1**2, 0.5**2])
    P = scipy.linalg.solve_discrete_are(F.T, C.T, QN, RN)
    K = P @ C.T @ np.linalg.inv(C @ P @ C.T + RN)
    after = (np.eye(4) - K @ C) @ P
    M = (np.eye(4) - K @ C) @ F
    assert found.numbers[GROWTH] == pytest.approx(np.abs(np.linalg.eigvals(M)).max(), rel=1e-6)
    root = scipy.linalg.sqrtm(after).real
    decrease = 1.0 - np.linalg.eigvalsh(root @ M.T @ np.linalg.inv(after) @ M @ root).max()
    assert found.numbers[DECREASE] == pytest.approx(decrease, rel=1e-3)
    assert np.array(found.lyapunov_matrix) == pytest.approx(np.linalg.inv(after), rel=1e-4, abs=1e-3)


def test_a_covariance_of_zero_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="balise_deviation"):
        running(balise_deviation=0.0).runtime.start(0.0)


def test_a_wheel_that_transmits_less_creeps_less() -> None:
    """Half of the effort, a fourth of the variance; none, none."""
    found = {}
    for share in (0.0, 0.5, 1.0, 2.0):
        p = OBSERVERS["balise_odometer_ekf"]()
        values = p.unpack_parameters(p.start_parameters())
        effort = -share * float(values.creep_effort) * float(values.mass)
        found[share] = float(transition(0.1, 20.0, effort, values).QN[3, 3])
    assert found[0.0] == 0.0
    assert found[0.5] == pytest.approx(0.25 * found[1.0], rel=1e-12)
    assert found[2.0] == found[1.0] > 0.0


def test_readings_at_rest_say_nothing_of_position_and_disturbance() -> None:
    """Ten minutes at a platform with a reading that trembles: neither place nor disturbance moves."""
    runner = running(davis_a=2000.0)
    runner.set("x", {"estimated_speed": 0.0, "estimated_position": 50.0, "estimated_disturbance": 0.02})
    runner.set("u", {"odometer": 0.0, "effort": -30e3})
    runner.runtime.start(0.0)
    readings = np.maximum(0.05 * np.random.default_rng(1).standard_normal(6000), 0.0)
    for k, reading in enumerate(readings):
        runner.set("u", {"odometer": float(reading)})
        runner.runtime.advance((k + 1) * PERIOD)
    counted = float(readings.sum() * PERIOD)
    assert runner.state("estimated_disturbance") == pytest.approx(0.02, abs=1e-3)
    assert runner.state("estimated_position") == pytest.approx(50.0, abs=0.2 * counted)  # a fifth of what is read


def test_readings_that_are_refused_for_long_are_believed_again() -> None:
    """The estimate stands, the train does not: no gate without a way back, and the way is honest about the position."""
    runner = running(odometer_recover=15.0)
    runner.set("x", {"estimated_speed": 0.0})
    runner.set("u", {"odometer": 18.0, "effort": -30e3})
    runner.runtime.start(0.0)
    reported = {}
    for k in range(1, 400):
        runner.runtime.advance(k * PERIOD)
        values = runner.outputs()
        reported[round(k * PERIOD, 1)] = (values["speed"], values["odometer_fault"])
    assert [fault for t, (_, fault) in reported.items() if t < 14.85] == [1.0] * 148
    assert reported[14.9][1] == reported[20.0][1] == 0.0
    assert reported[14.9][0] == pytest.approx(18.0, abs=1e-9)
    # 18 m/s for 15 s are 270 m that it may be off, and the first one of 100 m
    assert runner.outputs()["position_std"] > 270.0

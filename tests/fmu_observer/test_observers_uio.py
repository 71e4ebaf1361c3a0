"""The unknown-input observer: the printed matrices, the gains, and balises at their own stamps."""

import numpy as np
import pytest
from observer_runner import DAVIS_B, DAVIS_C, MASS, SystemRunner
from scipy.linalg import expm
from uio_gains import UioCovariances, uio_gains

from fmu_observer.design.uio_design import discretise, uio_matrices
from fmu_observer.observers.train import DiscreteUio

SLOPE = (DAVIS_B + DAVIS_C * 50.0 / 3.6) / MASS
PRINTED_AD = np.array(
    [
        [1.0, 0.1, 0.1, 0.005, 0.005, 0.0002],
        [0.0, 0.9999, 0.0, 0.1, 0.0, 0.005],
        [0.0, 0.0, 1.0, 0.0, 0.1, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.1],
        [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    ]
)
PRINTED_BD = 1e-5 * np.array([0.0056, 0.1111, 0.0, 0.0, 0.0, 0.0])
PRINT_ROUNDING = 5e-5  # four decimals; the largest difference is 3.8e-5


def observability_rank(A: np.ndarray) -> int:
    C = np.eye(6)[:2]
    return int(np.linalg.matrix_rank(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(6)])))


def test_the_corrected_matrix_gives_the_printed_discretisation() -> None:
    Ad, Bd = discretise(*uio_matrices(MASS, SLOPE), 0.1)
    assert np.abs(Ad - PRINTED_AD).max() == pytest.approx(3.8e-5, abs=0.1e-5)
    np.testing.assert_allclose(Ad, PRINTED_AD, atol=PRINT_ROUNDING)
    np.testing.assert_allclose(Bd, PRINTED_BD, atol=1e-5 * PRINT_ROUNDING)


def test_the_printed_matrix_neither_matches_nor_is_observable() -> None:
    A, B = uio_matrices(MASS, SLOPE)
    assert observability_rank(A) == 6
    printed = A.copy()
    printed[1, 2], printed[1, 3] = 1.0, 0.0
    assert observability_rank(printed) == 4
    assert np.abs(discretise(printed, B, 0.1)[0] - PRINTED_AD).max() == pytest.approx(0.1, abs=0.01)


def test_the_observer_between_samples_is_the_discrete_model() -> None:
    observer = DiscreteUio()
    runner = SystemRunner(observer)
    runner.runtime.start(0.0)
    x = np.array([3.0, 12.0, -0.4, 0.2, 0.05, -0.1])
    runner.runtime.x[:6] = x
    runner.set("u", {"effort": 40e3})
    runner.runtime.advance(0.0999)
    Ad, Bd = discretise(*uio_matrices(MASS, SLOPE), 0.0999)
    # RK4 is nearly exact here
    np.testing.assert_allclose(runner.runtime.x[:6], Ad @ x + Bd * (40e3 - 900.0), atol=1e-11)


def test_declared_gains_are_those_of_the_design() -> None:
    designed = uio_gains(UioCovariances(), SLOPE)
    declared = {s.name: np.array(s.start) for s in DiscreteUio().parameters}
    np.testing.assert_allclose(declared["odometer_gain"], designed[0], atol=5e-6)  # rounded to five digits
    np.testing.assert_allclose(declared["balise_gain"], designed[1], atol=5e-6)


def test_the_design_is_the_stationary_kalman_filter() -> None:
    """Iterating the covariance of the balise channel from afar ends at the gain."""
    covariances = UioCovariances(balise_gap=0.7, slip_noise=0.3)
    shift, gap = np.diag([1.0, 1.0], 1), 0.7
    F = expm(shift * gap)
    g = np.array([gap**5 / 20, gap**4 / 8, gap**3 / 6, gap**4 / 8, gap**3 / 3, gap**2 / 2, gap**3 / 6, gap**2 / 2, gap])
    Q = 0.3 * g.reshape(3, 3)  # closed form of white noise through three integrators
    P, K = 100.0 * np.eye(3), np.zeros(3)
    for _ in range(200):
        P = F @ P @ F.T + Q
        K = P[:, 0] / (P[0, 0] + covariances.balise_noise)
        P = P - np.outer(K, P[0])
    np.testing.assert_allclose(uio_gains(covariances, SLOPE)[1][[0, 2, 4]], K, rtol=1e-8)


def test_a_balise_acts_at_its_own_stamp() -> None:
    """One balise between two odometer samples against the exact product of the linear maps."""
    observer = DiscreteUio()
    runner = SystemRunner(observer)
    x = np.array([1.0, 12.0, 0.3, 0.1, 0.0, 0.0])
    runner.runtime.x[:6] = x
    runner.set("u", {"odometer": 12.0, "effort": 900.0})
    runner.runtime.start(0.0)
    runner.runtime.advance(0.0637)
    runner.balise(0.9)
    runner.runtime.advance(0.1)
    A, _ = uio_matrices(MASS, SLOPE)
    gains = {s.name: np.array(s.start) for s in observer.parameters}
    x = x - gains["odometer_gain"] * (x[1] - 12.0)
    x = expm(A * 0.0637) @ x
    x = x - gains["balise_gain"] * (x[0] - 0.9)
    x = expm(A * 0.0363) @ x
    x = x - gains["odometer_gain"] * (x[1] - 12.0)
    np.testing.assert_allclose(runner.runtime.x[:6], x, atol=1e-11)


def test_speed_is_odometer_speed_plus_slip_speed() -> None:
    runner = SystemRunner(DiscreteUio())
    runner.runtime.x[:3] = [0.0, 12.0, -0.25]
    assert runner.outputs()["speed"] == 11.75

"""The high-gain observer with a Riccati-like gain, against a Kalman filter written the other way round."""

import numpy as np
import pytest
from own_condition import own_condition
from sampled_runner import SampledRunner, chain, true_motion
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.observers.generic.sampled import RiccatiHighGain

TORQUE, THETA, R, T = 0.2, 1.5, 0.2, 0.1
START = (1.0, 0.5)


def covariance_filter(end: float) -> tuple[np.ndarray, np.ndarray]:
    """Estimate and inv(S) from ``dP = F P + P F' + Q_theta`` and the gain form of the update, F by central
    differences.
    """
    model = pendulum()
    truth = true_motion(model, START, (TORQUE,), end)
    u, Q = np.array([TORQUE]), np.diag([THETA**2, THETA**4])

    def slope(x: np.ndarray) -> np.ndarray:
        steps = 1e-6 * np.eye(2)
        return np.stack([(model.flow(x + h, u) - model.flow(x - h, u)) / 2e-6 for h in steps], axis=1)

    def flow(_t: float, z: np.ndarray) -> np.ndarray:
        x, P = z[:2], z[2:].reshape(2, 2)
        F = slope(x)
        return np.r_[model.flow(x, u), (F @ P + P @ F.T + Q).ravel()]

    z = np.r_[0.0, 0.0, np.eye(2).ravel()]
    for k in range(round(end / T) + 1):
        x, P = z[:2], z[2:].reshape(2, 2)
        K = P[:, 0] / (P[0, 0] + R / T)
        x = x - K * (x[0] - truth(k * T)[0])
        P = P - np.outer(K, P[0])
        z = np.r_[x, P.ravel()]
        if k < round(end / T):
            z = solve_ivp(flow, (0.0, T), z, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return z[:2], z[2:].reshape(2, 2)


def test_it_is_an_extended_kalman_filter_in_information_form() -> None:
    end = 1.0
    runner = SampledRunner(RiccatiHighGain(), true_motion(pendulum(), START, (TORQUE,), end), (TORQUE,))
    runner.follow(T * np.arange(1, round(end / T) + 1))
    estimate, P = covariance_filter(end)
    s11, s12, s22 = runner.runtime.x[2:5]
    np.testing.assert_allclose(runner.runtime.x[:2], estimate, atol=1e-6)  # RK4 at 5 ms against the rate of S
    np.testing.assert_allclose(np.linalg.inv([[s11, s12], [s12, s22]]), P, rtol=1e-6, atol=1e-6)


def test_the_information_stays_positive_definite() -> None:
    runner = SampledRunner(RiccatiHighGain(), true_motion(pendulum(), START, (TORQUE,), 10.0), (TORQUE,))
    for k in range(1, 101):
        runner.sample(k * T)
        s11, s12, s22 = runner.runtime.x[2:5]
        assert np.linalg.eigvalsh([[s11, s12], [s12, s22]])[0] > 0.0


@pytest.mark.parametrize("period", [0.1, 0.8])
def test_the_settled_error_falls_as_the_certificate_says(period: float) -> None:
    """On a linear model, once S has settled, the error moves from sample to sample by the certificate's transition."""
    observer = RiccatiHighGain(chain(2))
    p = observer.unpack_parameters(observer.start_parameters())
    flow = expm(chain(2).A * period)
    settled = np.linalg.inv(flow) @ observer.vertex_error(chain(2).A, chain(2).A, p).transition(period) @ flow
    runner = SampledRunner(observer, true_motion(chain(2), (1.0, 1.0), (), 40.0), (), sample_period=period)
    errors = []
    count = {0.1: 40, 0.8: 10}[period]
    for k in range(1, count + 1):
        runner.sample(k * period)
        errors.append(runner.error())
    # what is left of the settling of S, and of RK4 at 5 ms
    np.testing.assert_allclose(errors[-1], settled @ errors[-2], atol=2e-3 * float(np.abs(errors[-2]).max()))


def test_a_linear_model_has_no_longest_period() -> None:
    """With F exact ``e' S e`` falls at every period: Kalman."""
    assert next(RiccatiHighGain(chain(2)).findings(1.0)).condition(CONSTANT_GAP).limit == np.inf


def test_slopes_that_differ_from_the_believed_one_have_a_longest_period() -> None:
    certificate = next(RiccatiHighGain().findings(0.1))
    assert 0.5 < certificate.limit <= certificate.condition(CONSTANT_GAP).limit < 2.0
    far = next(RiccatiHighGain().findings(1.5))
    assert not far.holds
    assert far.numbers[GROWTH] > 1.0


def test_the_period_is_evaluated_by_the_condition() -> None:
    observer = RiccatiHighGain()
    assert own_condition(observer).holds
    assert own_condition(observer, {"sample_period": 0.2}).numbers["gap"] == 0.2


@pytest.mark.parametrize("name", ["theta", "state_weight", "output_weight", "sample_period"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_weights_that_leave_no_riccati_equation_are_refused_by_name(name: str, value: float) -> None:
    """A negative theta was certified, for only its square counts, and a weight of zero ended in the words of a
    solver.
    """
    with pytest.raises(ValueError, match=f"'{name}' to certify must be at least"):
        next(RiccatiHighGain().findings(0.3, {name: value}))

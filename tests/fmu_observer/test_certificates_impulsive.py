"""Errors that flow and are reset: reduction, limits against closed forms, and certificates against exact simulation."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sampled_runner import SampledRunner, chain, true_motion
from scipy.linalg import expm, solve_discrete_are

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, DECREASE, GROWTH
from fmu_observer.certificates.impulsive_error import ImpulsiveError, _row_echelon
from fmu_observer.certificates.riccati_error import RiccatiError
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.certificates.small_gain import independent_gap_limit
from fmu_observer.observers.generic.sampled import (
    ExponentialGain,
    HeldInnovation,
    HybridImpulsive,
    MultirateSylvester,
    OutputPredictor,
)
from fmu_observer.observers.generic.sampled.hybrid_impulsive import _hybrid_gains

BISECTION = 5e-4  # relative: twice the tolerance of the search for the aperiodic limit, and the grid of the check
SHIFT = np.array([[0.0, 1.0], [0.0, 0.0]])
C = np.array([[1.0, 0.0]])


def test_a_decaying_innovation_is_the_sampled_error() -> None:
    drift = np.array([[0.0, 1.0], [0.0, -0.02]])
    sampled = SampledError.of(drift.tolist(), (6.0, 9.0), 6.0)
    impulsive = ImpulsiveError.with_innovation(drift, np.array([[6.0], [9.0]]), np.array([[6.0]]), C, (0, 1))
    np.testing.assert_allclose(impulsive.transition(0.3), sampled.transition(0.3), rtol=1e-13)
    np.testing.assert_allclose(impulsive.transitions(1.0, 7)[1], sampled.transitions(1.0, 7)[1], rtol=1e-13)
    one, other = (certify_sampled_error((error,), 0.3, "any") for error in (sampled, impulsive))
    assert one.condition(CONSTANT_GAP).limit == pytest.approx(other.condition(CONSTANT_GAP).limit, rel=1e-9)
    assert one.limit == pytest.approx(other.limit, rel=BISECTION)
    assert one.numbers[DECREASE] == pytest.approx(other.numbers[DECREASE], rel=1e-3)  # of the solver


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), size=st.integers(2, 5), rank=st.integers(1, 5), gap=st.floats(0.01, 1.0))
def test_the_reduced_transition_has_the_eigenvalues_of_the_whole_one(
    seed: int, size: int, rank: int, gap: float
) -> None:
    generator = np.random.default_rng(seed)
    rank = min(rank, size)
    G = generator.normal(size=(size, size))
    R = generator.normal(size=(size, rank)) @ generator.normal(size=(rank, size))
    error = ImpulsiveError.of(G, R)
    assume(error.size == rank and np.abs(error.kept).max() < 30.0)  # reduction of an almost lower rank loses digits
    np.testing.assert_allclose(error.spread @ error.kept, R, atol=1e-9 * max(1.0, np.abs(error.kept).max()))
    whole = np.abs(np.linalg.eigvals(expm(G * gap) @ R)).max()
    assert error.spectral_radius(gap) == pytest.approx(whole, rel=1e-6)


def test_the_echelon_keeps_components() -> None:
    rows, pivots = _row_echelon(np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]]))
    assert pivots == [0, 1]
    np.testing.assert_array_equal(rows, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    ("G", "R", "message"),
    [
        (np.eye(2), np.eye(3), "of one size"),
        (np.zeros((2, 3)), np.zeros((2, 3)), "square"),
        (np.eye(2), np.zeros((2, 2)), "nothing to certify"),
    ],
)
def test_bad_error_equations_are_refused(G: np.ndarray, R: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ImpulsiveError.of(G, R)


def test_vertices_that_read_different_components_are_refused() -> None:
    one, other = (ImpulsiveError.of(-np.eye(2), np.diag(kept)) for kept in ((1.0, 0.0), (0.0, 1.0)))
    with pytest.raises(ValueError, match="same components"):
        certify_sampled_error((one, other), 0.1, "any")


# -- limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("theta", [1.0, 8.0])
@pytest.mark.parametrize("make", [ExponentialGain, OutputPredictor])
def test_double_integrator_limits(make: type[ExponentialGain], theta: float) -> None:
    certificate = next(make(chain(2)).findings(0.1 / theta, {"theta": theta}))
    # independently measured; the last digit is read
    assert theta * certificate.condition(CONSTANT_GAP).limit == pytest.approx(4.9999, abs=1e-3)
    assert theta * certificate.limit == pytest.approx(4.0, rel=1e-3)


def test_four_state_limit() -> None:
    certificate = next(ExponentialGain(chain(4)).findings(0.5, {"theta": 1.0, "high_gain": (4.0, 6.0, 4.0, 1.0)}))
    assert certificate.condition(CONSTANT_GAP).limit == pytest.approx(
        1.283, abs=1e-3
    )  # independently measured to that digit


@pytest.mark.parametrize("theta", [1.0, 5.0])
def test_held_innovation_of_a_double_integrator_ends_at_one(theta: float) -> None:
    """``tr = 2 - 2x - x^2/2``, ``det = 1 - 2x + x^2/2`` with x = theta gap: ``1 + tr + det = 4 - 4x`` vanishes at x =
    1.
    """
    observer = HeldInnovation(chain(2))
    certificate = next(observer.findings(0.5 / theta, {"theta": theta}))
    assert theta * certificate.condition(CONSTANT_GAP).limit == pytest.approx(
        1.0, abs=2e-4
    )  # an eigenvalue at -1: half of the digits
    assert certificate.holds
    x = 0.7
    Phi = np.array([[1.0 - 2.0 * x - 0.5 * x * x, x], [-x, 1.0]])
    assert next(observer.findings(x, {"theta": 1.0})).numbers[GROWTH] == pytest.approx(
        np.abs(np.linalg.eigvals(Phi)).max(), rel=1e-9
    )


@pytest.mark.parametrize("width", [2, 3])
def test_a_wide_chain_has_the_limits_of_a_narrow_one(width: int) -> None:
    certificate = next(ExponentialGain(chain(2, width)).findings(0.5, {"theta": 2.0}))
    assert 2.0 * certificate.condition(CONSTANT_GAP).limit == pytest.approx(4.9999, abs=1e-3)


def test_the_printed_gains_of_two_measurements_decay_as_measured() -> None:
    """Gains of (2.42): eigenvalues of ``At - L Ct`` are -0.2017 +- 0.0041i."""
    L = (0.4034, 0.0, 0.0, 0.4020, 0.0407, 0.0, 0.0, 0.0404)
    observer = ExponentialGain(chain(2, 2))
    p = observer.unpack_parameters(observer.start_parameters())._replace(theta=1.0, high_gain=np.array(L))
    limit = observer.vertex_error(observer.model.A, p).continuous_limit
    assert limit is not None
    values = np.linalg.eigvals(limit)
    pair = values[np.abs(values.imag) > 0.0]
    np.testing.assert_allclose(pair.real, [-0.2017] * 2, atol=5e-5)
    np.testing.assert_allclose(np.abs(pair.imag), [0.0041] * 2, atol=5e-5)


@pytest.mark.parametrize("gap", [0.05, 0.4, 1.1])
def test_a_pure_jump_is_a_discrete_observer(gap: float) -> None:
    """With the whole correction at once z is zero, and the error moves by ``exp(A gap) (I - F C)``."""
    L, H, F = _hybrid_gains(np.array([[2.0], [1.0]]), 2.0, 1.0)
    observer = HybridImpulsive(chain(2))
    gains = {"flow_gain": L, "flow_matrix": H, "jump_gain": F}
    whole = expm(SHIFT * gap) @ (np.eye(2) - F @ C)
    assert next(observer.findings(gap, gains)).numbers[GROWTH] == pytest.approx(
        np.abs(np.linalg.eigvals(whole)).max(), abs=1e-12
    )


# -- Riccati ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.02, 0.3, 2.0])
def test_the_settled_riccati_gain_is_scipys(gap: float) -> None:
    F = np.array([[0.0, 1.0], [0.6, -0.2]])
    Q, r = np.diag([2.0, 5.0]), 0.3
    error = RiccatiError.of(F, F, C, Q, np.array([[r]]), (0, 1))
    both = expm(np.block([[-F, Q], [np.zeros((2, 2)), F.T]]) * gap)
    flow = both[2:, 2:].T
    P = solve_discrete_are(flow.T, C.T, flow @ both[:2, 2:], np.array([[r / gap]]))
    K = P @ C.T / (C @ P @ C.T + r / gap)
    np.testing.assert_allclose(error.transition(gap), flow @ (np.eye(2) - K @ C), atol=1e-9)
    gaps, matrices = error.transitions(2.0, 100)
    np.testing.assert_allclose(matrices[np.searchsorted(gaps, gap - 1e-9)], error.transition(gap), atol=1e-9)


def test_the_riccati_transition_at_short_gaps_is_the_continuous_one() -> None:
    error = RiccatiError.of(SHIFT, SHIFT, C, np.eye(2), np.eye(1), (0, 1))
    slope = (error.transition(1e-6) - np.eye(2)) / 1e-6
    np.testing.assert_allclose(slope, error.continuous_limit, atol=1e-4)
    assert np.linalg.eigvals(error.continuous_limit).real.max() < 0.0


# -- never contradicted
# -------------------------------------------------------------------------------------------------

MODEL = chain(3, slope=-0.3)
LINEAR = {
    "exponential_gain": ExponentialGain(MODEL),
    "output_predictor": OutputPredictor(MODEL),
    "held_innovation": HeldInnovation(MODEL),
    "hybrid_impulsive": HybridImpulsive(MODEL),
}


@pytest.mark.parametrize("name", LINEAR)
@settings(max_examples=40)
@given(
    relative=st.lists(st.floats(0.001, 1.0), min_size=5, max_size=40),
    start=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda e: max(map(abs, e)) > 0.1),
)
def test_the_certified_function_falls_at_every_admissible_gap(
    name: str, relative: list[float], start: tuple[float, ...]
) -> None:
    """Exact error by SciPy's exponential of the observer's own equations, gaps on no grid."""
    observer = LINEAR[name]
    limit = 0.999 * next(observer.findings(0.1)).limit
    certificate = next(observer.findings(limit))
    assert certificate.holds
    P = np.array(certificate.lyapunov_matrix)
    error = observer.vertex_error(MODEL.drifts[0], observer.unpack_parameters(observer.start_parameters()))
    assert isinstance(error, ImpulsiveError)
    zeta = np.r_[np.array(start), 0.0]
    levels = []
    for gap in relative:
        levels.append(float(zeta[:3] @ P @ zeta[:3]))
        zeta = expm(error.generator * (gap * limit)) @ (error.reset @ zeta)
    assert all(after < before for before, after in pairwise(levels))


@pytest.mark.parametrize("name", LINEAR)
def test_the_error_equations_are_those_of_the_observer_that_runs(name: str) -> None:
    """On a linear model: the runtime's error before every sample against SciPy's exponential of generator and reset."""
    observer = LINEAR[name]
    error = observer.vertex_error(MODEL.drifts[0], observer.unpack_parameters(observer.start_parameters()))
    assert isinstance(error, ImpulsiveError)
    motion = true_motion(MODEL, (1.0, -0.5, 0.3), (), 4.0)
    runner = SampledRunner(observer, motion, ())
    runner.sample(0.0)
    zeta, t = np.r_[-1.0, 0.5, -0.3, 0.0], 0.0
    for gap in (0.2, 0.7, 0.05, 0.4, 0.9):
        zeta, t = expm(error.generator * gap) @ (error.reset @ zeta), t + gap
        np.testing.assert_allclose(runner.error(t), zeta[:3], atol=1e-7)  # RK4 at 5 ms
        runner.sample(t)


def test_independent_samples_by_small_gain_of_one_loop() -> None:
    """``dz = -z + w``, ``dw = -k z``: the gain of -k/(s + 1) peaks at k, so the gap may be pi/(2k)."""
    limit = independent_gap_limit(np.array([[-1.0]]), np.eye(1), np.array([[-3.0]]), np.zeros((1, 1)))
    assert limit == pytest.approx(np.pi / 6.0, rel=2e-3)  # the margin taken for the grid
    assert independent_gap_limit(np.eye(1), np.eye(1), np.eye(1), np.eye(1)) == 0.0
    assert independent_gap_limit(-np.eye(1), np.eye(1), np.zeros((1, 1)), np.zeros((1, 1))) == np.inf


def test_scaling_helps_independent_samples() -> None:
    """A one-way coupling, however strong, does not shorten the gaps."""
    C_, D = np.zeros((2, 1)), np.array([[-1.0, 100.0], [0.0, -1.0]])
    limit = independent_gap_limit(-np.eye(1), np.zeros((1, 2)), C_, D)
    assert limit == pytest.approx(np.pi / 2.0, rel=0.1)


@settings(max_examples=8)
@given(seed=st.integers(0, 10**6))
def test_samples_at_their_own_instants_never_contradict_the_small_gain_limit(seed: int) -> None:
    observer = MultirateSylvester()
    A, B, read, own = observer.error_matrices(observer.unpack_parameters(observer.start_parameters()))
    r = len(A)
    limit = independent_gap_limit(A, B, read, own)
    assert next(observer.findings(0.999 * limit)).holds
    assert not next(observer.findings(1.001 * limit)).holds
    generator = np.block([[A, B], [read, own]])
    numbers = np.random.default_rng(seed)
    zeta, due, t = numbers.normal(size=r + 2), numbers.uniform(0.0, limit, 2), 0.0
    start = np.abs(zeta).max()
    while t < 60.0:
        i = int(due.argmin())
        zeta, t = expm(generator * (due[i] - t)) @ zeta, float(due[i])
        zeta[r + i] = 0.0
        due[i] += limit * numbers.uniform(0.3, 1.0)
    assert np.abs(zeta).max() < 1e-3 * start

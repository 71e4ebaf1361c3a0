"""What reaches a residual: closed forms, frequency grids, SciPy's simulation, and the printed designs."""

from __future__ import annotations

from math import exp, inf, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from fmu_observer.design.quasi_lpv_published import PUBLISHED, SECTION_3_3_4, SECTION_5_3_1, SEEN, QuasiLpvDesign
from fmu_observer.design.residual_analysis import (
    _level_crossings,
    bands_above,
    h_infinity_norm,
    minimum_fault,
    minimum_gain,
    pulse_ratio,
    sudden_fault,
)
from fmu_observer.design.residual_channel import ResidualChannel, decoupled_channel, residual_channel
from fmu_observer.models.train.coupled_vehicles_model import coupled_vehicles
from fmu_observer.observers.generic.continuous import DecouplingUio, ProportionalIntegralUio
from plant_models.hybrid import scalar_names

LAG = ResidualChannel(np.array([[-2.0]]), np.array([[3.0]]), np.array([[1.0]]), np.array([[0.0]]))
HIGH_PASS = ResidualChannel(np.array([[-2.0]]), np.array([[-2.0]]), np.array([[1.0]]), np.array([[1.0]]))  # s / (s + 2)


def from_disturbance(design: QuasiLpvDesign, vertex: int) -> ResidualChannel:
    D = np.array(design.disturbance)[:, None]
    A, K = design.vertices[vertex], design.gains[vertex]
    return residual_channel(A, K, SEEN, on_states=D, residual_gain=design.residual_gain)


def from_fault(design: QuasiLpvDesign, vertex: int) -> ResidualChannel:
    A, K = design.vertices[vertex], design.gains[vertex]
    return residual_channel(A, K, SEEN, on_measurements=-np.eye(1), residual_gain=design.residual_gain)


def random_channel(seed: int, q: int = 2, k: int = 2) -> ResidualChannel:
    generator = np.random.default_rng(seed)
    A = generator.normal(size=(4, 4))
    A -= (np.linalg.eigvals(A).real.max() + generator.uniform(0.05, 1.0)) * np.eye(4)
    return ResidualChannel(
        A, generator.normal(size=(4, k)), generator.normal(size=(q, 4)), generator.normal(size=(q, k))
    )


# -- closed forms -----------------------------------------------------------------------------------------------------


def test_a_lag_and_a_high_pass() -> None:
    assert h_infinity_norm(LAG) == pytest.approx(1.5, rel=1e-6)
    assert minimum_gain(LAG, 0.0, 2.0) == pytest.approx(3.0 / sqrt(8.0), rel=1e-6)
    assert h_infinity_norm(HIGH_PASS) == pytest.approx(1.0, rel=1e-6)
    assert minimum_gain(HIGH_PASS) == pytest.approx(0.0, abs=1e-12)
    assert minimum_gain(HIGH_PASS, 2.0) == pytest.approx(sqrt(0.5), rel=1e-6)
    [(low, high)] = bands_above(HIGH_PASS, sqrt(0.5))
    assert (low, high) == (pytest.approx(2.0, rel=1e-6), inf)
    assert bands_above(HIGH_PASS, 1.2) == []
    assert bands_above(LAG, 1.0) == [(0.0, pytest.approx(sqrt(5.0), rel=1e-6))]


@settings(max_examples=12, deadline=None)
@given(st.floats(1e-4, 0.6), st.floats(0.1, 100.0))
def test_the_peak_of_a_resonance(damping: float, omega: float) -> None:
    """``1 / (2 zeta sqrt(1 - zeta^2))``, however narrow."""
    A = np.array([[0.0, omega], [-omega, -2.0 * damping * omega]])
    channel = ResidualChannel(A, np.array([[0.0], [omega]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    peak = 1.0 / (2.0 * damping * sqrt(1.0 - damping**2))
    assert h_infinity_norm(channel) == pytest.approx(peak, rel=1e-6)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000))
def test_gains_of_random_channels_agree_with_a_grid(seed: int) -> None:
    channel = random_channel(seed)
    omega = np.r_[0.0, np.geomspace(1e-3, 1e3, 6000), inf]
    singular = np.linalg.svd(channel.response(omega), compute_uv=False)
    norm, least = h_infinity_norm(channel), minimum_gain(channel)
    assert singular[:, 0].max() <= norm * (1.0 + 1e-7)
    assert norm <= singular[:, 0].max() * (1.0 + 1e-3)  # 230 points a decade, damping of 0.05 or more
    assert least * (1.0 - 1e-7) <= singular[:, -1].min()
    assert singular[:, -1].min() <= least * (1.0 + 1e-2) + 1e-3
    level = 0.5 * (least + norm)
    inside = np.zeros(len(omega), dtype=bool)
    for low, high in bands_above(channel, level):
        inside |= (omega >= low) & (omega <= high)
    clear = np.abs(singular[:, -1] - level) > 1e-6 * level
    np.testing.assert_array_equal(inside[clear], (singular[:, -1] >= level)[clear])


def test_degenerate_channels() -> None:
    unstable = ResidualChannel(np.eye(1), np.eye(1), np.eye(1), np.zeros((1, 1)))
    assert h_infinity_norm(unstable) == inf
    assert pulse_ratio(unstable, 1.0) == inf
    assert pulse_ratio(unstable, 1.0, 1.0) == pytest.approx(sqrt((exp(2.0) - 4.0 * exp(1.0) + 5.0) / 2.0), rel=1e-9)
    silent = ResidualChannel(-np.eye(2), np.zeros((2, 1)), np.eye(2), np.zeros((2, 1)))
    assert h_infinity_norm(silent) == 0.0
    assert minimum_gain(random_channel(1, q=1, k=2)) == 0.0  # two faults in one residual can cancel
    assert len(_level_crossings(LAG, 2.0)) == 0


@pytest.mark.parametrize("length", [0.3, 2.0, 50.0])
@pytest.mark.parametrize("horizon", [inf, 60.0])
def test_a_pulse_agrees_with_a_simulation(length: float, horizon: float) -> None:
    channel = from_fault(SECTION_3_3_4, 0)
    A, B, C, D = channel.matrices

    def energy(end: float, f: float, start: np.ndarray) -> tuple[float, np.ndarray]:
        def flow(_t: float, x: np.ndarray) -> np.ndarray:
            return np.append(A @ x[:-1] + B[:, 0] * f, float((C @ x[:-1])[0] + D[0, 0] * f) ** 2)

        x = solve_ivp(flow, (0.0, end), np.append(start, 0.0), method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
        return float(x[-1]), x[:-1]

    during, left = energy(length, 1.0, np.zeros(3))
    after, _ = energy(min(horizon, 120.0) - length, 0.0, left)  # time constants of 3 s
    assert pulse_ratio(channel, length, horizon) == pytest.approx(sqrt((during + after) / length), rel=1e-7)


# -- the channels are those of the observers --------------------------------------------------------------------------


def residuals(observer: Any, s: np.ndarray, t: np.ndarray, E: np.ndarray, F: np.ndarray) -> np.ndarray:
    """Residuals of an observer beside its plant, both from rest, under a signal that is linear between the times."""
    model, n = observer.model, observer.model.order
    p = observer.start_parameters()
    start = np.concatenate([np.zeros(n), np.zeros(observer.state_count)])
    at = lambda now: np.interp(now, t, s)  # noqa: E731

    def inputs(now: float, x: np.ndarray) -> np.ndarray:
        y = model.measured(x[:n]) + F[:, 0] * at(now)
        return np.concatenate([np.zeros(len(model.inputs)), y])

    def flow(now: float, x: np.ndarray) -> np.ndarray:
        moved = model.flow(x[:n], np.zeros(len(model.inputs))) + E[:, 0] * at(now)
        return np.concatenate([moved, observer.state_derivative(now, x[n:], inputs(now, x), p)])

    x = solve_ivp(flow, (0.0, t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-12, max_step=t[1]).y.T
    reported = np.array(
        [observer.output_vector(now, row[n:], inputs(now, row), p) for now, row in zip(t, x, strict=True)]
    )
    names = scalar_names(observer.outputs)
    return reported[:, [names.index(f"residual_{m.name}") for m in model.measurements]]


def test_the_channel_of_the_proportional_integral_observer() -> None:
    observer = ProportionalIntegralUio("coupled_vehicles", rho=1)
    t = np.linspace(0.0, 1.0, 21)
    s = np.cumsum(np.random.default_rng(5).normal(size=21)) * 0.1
    s -= s[0]
    E, F = np.array([[0.0], [0.0], [1.0]]), np.array([[0.3], [-1.0]])
    L = observer.start_parameters()[:8].reshape(4, 2)
    channel = residual_channel(observer.A_e, L, observer.C_e, np.vstack([E, np.zeros((1, 1))]), F)
    exact = lsim(channel.matrices, s[:, None], t)[1]
    np.testing.assert_allclose(residuals(observer, s, t, E, F), exact, atol=1e-7)


def test_the_channel_of_the_decoupling_observer() -> None:
    observer, model = DecouplingUio(), coupled_vehicles()
    t = np.linspace(0.0, 1.0, 21)
    s = np.cumsum(np.random.default_rng(6).normal(size=21)) * 0.1
    s -= s[0]
    E, F = np.array([[0.0], [0.5], [1.0]]), np.array([[0.3], [-1.0]])
    K = observer.start_parameters()[:6].reshape(3, 2)
    exact = lsim(decoupled_channel(model, K, E, F).matrices, s[:, None], t)[1]
    # the observer starts at z = 0, which is its right start for a plant at rest
    np.testing.assert_allclose(residuals(observer, s, t, E, F), exact, atol=1e-7)
    unknown = decoupled_channel(model, K, on_states=model.H)
    assert h_infinity_norm(unknown) < 1e-12


# -- the printed designs ----------------------------------------------------------------------------------------------


def test_the_printed_gains_have_the_poles_of_the_specification() -> None:
    expected = {
        "section_3_3_4": ([-0.3512 + 0.8812j, -0.45], [-0.3517 + 0.8805j, -0.4494]),
        "section_5_3_1": ([-1.7057, -0.3550 + 0.0544j], [-1.6960, -0.3539 + 0.0671j]),
    }
    for name, pairs in expected.items():
        for error, poles in zip(PUBLISHED[name].errors, pairs, strict=True):
            found = np.linalg.eigvals(error)
            for pole in poles:
                assert np.abs(found - pole).min() < 1e-4


@pytest.mark.parametrize(
    ("design", "vertex", "norm", "edge"),
    [
        (SECTION_3_3_4, 0, 0.02965, 0.7172),
        (SECTION_3_3_4, 1, 0.02961, 0.7171),
        (SECTION_5_3_1, 0, 1.513, 1.759),
        (SECTION_5_3_1, 1, 1.523, 1.749),
    ],
)
def test_norms_and_bands_of_the_printed_gains(design: QuasiLpvDesign, vertex: int, norm: float, edge: float) -> None:
    """Independent numbers: 0.02965 and 0.02961, 1.513 and 1.523; gamma holds above 0.717 and 1.75 rad/s only."""
    assert h_infinity_norm(from_disturbance(design, vertex)) == pytest.approx(norm, rel=5e-4)
    channel = from_fault(design, vertex)
    [(low, high)] = bands_above(channel, design.sensitivity)
    assert (low, high) == (pytest.approx(edge, rel=5e-4), inf)
    assert minimum_gain(channel) < 1e-12


@pytest.mark.parametrize(
    ("design", "ratios"),
    [
        (SECTION_3_3_4, {0.2: 2.33, 1.0: 2.31, 2.0: 2.07, 3.0: 1.72, 5.0: 1.11}),
        (SECTION_5_3_1, {0.2: 3.08, 0.6: 2.61, 1.0: 2.26, 1.4: 1.98, 2.0: 1.68, 5.0: 1.02}),
    ],
)
def test_pulses_through_the_printed_gains(design: QuasiLpvDesign, ratios: dict[float, float]) -> None:
    """Independent simulations, of 0.01 s steps and a finite horizon: they lie up to 1.5 % from the closed integrals."""
    for length, ratio in ratios.items():
        assert pulse_ratio(from_fault(design, 0), length) == pytest.approx(ratio, rel=1.5e-2)


def test_the_smallest_fault_that_a_threshold_sees() -> None:
    assert minimum_fault(0.65, 2.32) == pytest.approx(0.2802, abs=5e-5)
    assert minimum_fault(1.5, 2.32) == pytest.approx(0.6466, abs=5e-5)
    for bad in ((0.0, 1.0), (1.0, -1.0)):
        with pytest.raises(ValueError, match="must be finite and positive"):
            minimum_fault(*bad)


def test_the_smallest_sudden_fault() -> None:
    """``s / (s + 2)`` shows it at once and less later; a lag of gain 1.5 shows it late; by hand."""
    assert sudden_fault(HIGH_PASS, 3.0) == pytest.approx(3.0, rel=1e-12)
    assert sudden_fault(LAG, 3.0) == pytest.approx(2.0, rel=1e-6)
    assert sudden_fault(LAG, 3.0, length=0.5) == pytest.approx(2.0 / (1.0 - exp(-1.0)), rel=1e-2)  # of 500 points
    silent = ResidualChannel(-np.eye(1), np.zeros((1, 1)), np.eye(1), np.zeros((1, 1)))
    assert sudden_fault(silent, 1.0) == inf
    assert sudden_fault(from_fault(SECTION_5_3_1, 0), 0.65) == pytest.approx(0.65 / 3.36, rel=1e-9)
    for channel, threshold, length in ((random_channel(0), 1.0, inf), (LAG, 0.0, inf), (LAG, 1.0, 0.0)):
        with pytest.raises(ValueError, match="Sudden fault"):
            sudden_fault(channel, threshold, length)


# -- refusals ---------------------------------------------------------------------------------------------------------


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"give on_states of shape \(3, k\), on_measurements of shape \(1, k\)"):
        residual_channel(SECTION_3_3_4.vertices[0], SECTION_3_3_4.gains[0], SEEN)
    with pytest.raises(ValueError, match=r"on_measurements has shape \(2, 1\), expected \(1, 1\)"):
        residual_channel(SECTION_3_3_4.vertices[0], SECTION_3_3_4.gains[0], SEEN, on_measurements=np.ones((2, 1)))
    with pytest.raises(ValueError, match=r"band \[2.0, 1.0\] rad/s must be in order"):
        minimum_gain(LAG, 2.0, 1.0)
    with pytest.raises(ValueError, match="2 signals, expected one"):
        pulse_ratio(random_channel(0), 1.0)
    with pytest.raises(ValueError, match=r"horizon 0.5 s must be at least the length"):
        pulse_ratio(LAG, 1.0, 0.5)
    with pytest.raises(ValueError, match=r"Residual channel: B has shape|D has shape"):
        ResidualChannel(np.eye(2), np.ones((2, 1)), np.ones((1, 2)), np.ones((2, 1)))


def test_a_frequency_far_away_is_the_feedthrough() -> None:
    np.testing.assert_allclose(HIGH_PASS.response(np.array([inf, 2.0 * pi * 1e9])).real, np.ones((2, 1, 1)), atol=1e-8)

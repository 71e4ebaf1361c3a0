"""Robust residual generators: designs recomputed, the family over the decay rate, what the print cannot have."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from fmu_observer.certificates.polytope import polytope_stability
from fmu_observer.design.quasi_lpv_published import PUBLISHED, SECTION_3_3_4, SECTION_5_3_1, SEEN, QuasiLpvDesign
from fmu_observer.design.residual_analysis import h_infinity_norm
from fmu_observer.design.robust_residual import (
    InfeasibleResidualDesign,
    ResidualProblem,
    common_bands,
    design_robust_residual,
    gain_size,
    proven_attenuation,
    proven_sensitivity,
)
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.train.gains.robust_train import design_quasi_lpv_gains

SOLVER = 2e-3  # relative: what the strictness asked of the solver costs


def printed(design: QuasiLpvDesign, residual_gain: float | None = None) -> ResidualProblem:
    D = np.array(design.disturbance)[:, None]
    M = design.residual_gain if residual_gain is None else residual_gain
    return ResidualProblem(design.vertices, SEEN, D, M, decay=0.0, alpha=design.alpha)


def chapter_5(decay: float, **changes: Any) -> ResidualProblem:
    """Set D with D = e1, alpha = 0.2 and M = 0.3."""
    return replace(
        ResidualProblem(SECTION_5_3_1.vertices, SEEN, np.eye(3)[:, :1], 0.3, decay=decay, alpha=0.2), **changes
    )


@pytest.mark.parametrize(
    ("decay", "attenuation", "gain"),
    [(0.1, 0.138, (3.06, -1.10, -0.11)), (0.2, 0.203, (2.78, -1.75, -0.32)), (0.3, 0.404, (2.48, -1.90, -0.46))],
)
def test_the_family_over_the_decay_rate(decay: float, attenuation: float, gain: tuple[float, ...]) -> None:
    """The independent numbers, to their digits; then what they claim, by other means."""
    design = design_robust_residual(chapter_5(decay))
    assert design.attenuation == pytest.approx(attenuation, abs=6e-4)
    np.testing.assert_allclose(design.gains[0, :, 0], gain, atol=8e-3)
    assert min(design.margins.values()) > 0.0
    assert design.size <= 0.2
    norms = [h_infinity_norm(channel) for channel in design.problem.disturbance_channels(design.gains)]
    assert max(norms) <= design.attenuation  # what holds for every motion of the speed holds for a speed that stays
    found = polytope_stability(design.problem.vertices - design.gains @ SEEN)
    assert found.decay >= decay
    assert f"lambda = {design.attenuation:.4g}" in design.explain()
    assert 0.3 * 0.3 < design.sensitivity(1.0) < 0.3 * 0.5


def test_without_a_decay_rate_the_integrators_vanish() -> None:
    """The printed first step: the smaller sigma, the smaller lambda, and the smaller the integrators."""
    gains = [np.abs(design_robust_residual(chapter_5(decay)).gains[0, :, 0]) for decay in (0.05, 0.01, 0.001)]
    ratios = np.array([[gain[1] / gain[0], gain[2] / gain[0]] for gain in gains])
    assert np.all(np.diff(ratios, axis=0) < 0.0)
    assert ratios[-1, 0] < 1e-2
    assert ratios[-1, 1] < 1e-4


@pytest.mark.parametrize(("residual_gain", "alpha"), [(2.3, 9.69), (1.0, 1.370)])
def test_the_size_that_the_printed_gains_need(residual_gain: float, alpha: float) -> None:
    """Independent: alpha = 9.69 at M = 2.3 and lambda = 0.031, where the print has 1; 1.370 at M = 1."""
    problem = printed(SECTION_3_3_4, residual_gain)
    assert gain_size(problem, SECTION_3_3_4.gains, 0.031) == pytest.approx(alpha, rel=SOLVER)


def test_what_the_printed_gains_prove() -> None:
    """Independent: 0.02967, for 0.031 in the print; 1.51 or more, for 0.1 in the print, which is not attainable."""
    assert proven_attenuation(printed(SECTION_3_3_4), SECTION_3_3_4.gains) == pytest.approx(0.02967, rel=SOLVER)
    found = proven_attenuation(printed(SECTION_5_3_1), SECTION_5_3_1.gains)
    assert 1.5229 <= found <= 1.53
    assert gain_size(printed(SECTION_5_3_1), SECTION_5_3_1.gains, 0.1) == inf
    unstable = proven_attenuation(printed(SECTION_5_3_1), -SECTION_5_3_1.gains)
    assert unstable == inf


@pytest.mark.parametrize("design", PUBLISHED.values(), ids=PUBLISHED)
def test_no_sensitivity_over_all_frequencies(design: QuasiLpvDesign) -> None:
    """Both printed gammas, 1.58 and 2.32, hold in a band only: at rest the integrators take the fault away."""
    problem = printed(design)
    found = proven_sensitivity(problem, design.gains)
    assert found.proven == 0.0
    assert found.ceiling < 1e-9
    assert "over a band" in found.explain()
    [(low, high)] = common_bands(problem, design.gains, design.sensitivity)
    assert (low, high) == (pytest.approx(0.7172 if design is SECTION_3_3_4 else 1.7594, abs=1e-4), inf)


def test_a_sensitivity_that_can_be_had_is_proven() -> None:
    """An observer without integrators: the gain at rest is ``M |1 - L / (L - a)|``, the least over all frequencies."""
    problem = ResidualProblem(np.array([[-2.0]]), np.eye(1), np.eye(1), 2.0)
    found = proven_sensitivity(problem, np.array([[[1.0]]]))
    assert found.ceiling == pytest.approx(2.0 * 2.0 / 3.0, rel=1e-6)
    assert found.proven == pytest.approx(found.ceiling, rel=SOLVER)
    assert found.proven <= found.ceiling
    assert "||r|| > 1.333 ||f||" in found.explain()


def test_an_attenuation_that_is_too_strong() -> None:
    with pytest.raises(
        InfeasibleResidualDesign, match=r"the attenuation \(3.56\) is too strong.*lambda = 0.1376"
    ) as reported:
        design_robust_residual(chapter_5(0.1), attenuation=0.12)
    error = reported.value
    assert error.nearest_attenuation == pytest.approx(0.1376, rel=SOLVER)
    assert error.nearest_decay is not None
    assert error.nearest_alpha is not None
    assert design_robust_residual(chapter_5(error.nearest_decay)).attenuation <= 0.12
    assert design_robust_residual(chapter_5(0.1, alpha=1.01 * error.nearest_alpha)).attenuation <= 0.12
    assert design_robust_residual(chapter_5(0.1), attenuation=0.14).attenuation <= 0.14


def test_a_decay_that_the_size_forbids() -> None:
    with pytest.raises(
        InfeasibleResidualDesign, match=r"size of the gains \(3.58\) stands against the decay"
    ) as reported:
        design_robust_residual(chapter_5(0.8))
    error = reported.value
    assert error.nearest_alpha is not None
    assert error.nearest_decay is not None
    assert 0.3 < error.nearest_decay < 0.8
    assert design_robust_residual(chapter_5(0.8, alpha=1.01 * error.nearest_alpha)).gains.shape == (2, 3, 1)


def test_what_cannot_be_asked() -> None:
    blind = chapter_5(0.1, C=np.array([[0.0, 1.0, 0.0]]))
    with pytest.raises(UnobservableError, match="Robust residual, vertex 2"):
        design_robust_residual(blind)
    for changes, message in (
        ({"residual_gain": 0.0}, "residual_gain must be finite and positive"),
        ({"decay": -1.0}, "decay must be finite and not negative"),
        ({"alpha": np.nan}, "alpha must be finite and positive"),
        ({"disturbance": np.zeros((3, 1))}, "a disturbance that acts on a state"),
        ({"C": np.eye(2)}, r"C has shape \(2, 2\), expected \(2, 3\)"),
        ({"vertices": np.ones((2, 3, 2))}, r"vertices have shape \(2, 3, 2\), expected \(N, n, n\)"),
    ):
        with pytest.raises(ValueError, match=message):
            replace(chapter_5(0.1), **changes)
    with pytest.raises(ValueError, match=r"gains has shape \(3, 1\), expected \(2, 3, 1\)"):
        proven_attenuation(chapter_5(0.1), np.ones((3, 1)))
    with pytest.raises(ValueError, match="attenuation must be finite and positive"):
        design_robust_residual(chapter_5(0.1), attenuation=0.0)


# -- the polytope -----------------------------------------------------------------------------------------------------


def test_the_decay_of_one_vertex_is_its_abscissa() -> None:
    A = np.array([[-1.0, 3.0, 0.0], [0.0, -2.0, 1.0], [0.0, 0.0, -0.5]])
    found = polytope_stability([A])
    assert found.decay == pytest.approx(0.5, abs=1e-4)
    P = found.lyapunov_matrix
    assert np.linalg.eigvalsh(A.T @ P + P @ A + 2.0 * found.decay * P).max() < 0.0
    bound = polytope_stability([A], decay=0.3)
    assert bound.decay == 0.3
    times = np.linspace(0.0, 10.0, 60)
    sizes = [np.linalg.norm(expm(A * t), 2) * np.exp(0.3 * t) for t in times]
    assert max(sizes) <= bound.overshoot


def test_two_stable_vertices_need_no_common_function() -> None:
    """Switching between them grows, so that there can be none."""
    one, other = np.array([[-0.1, 1.0], [-10.0, -0.1]]), np.array([[-0.1, 10.0], [-1.0, -0.1]])
    assert polytope_stability([one]).holds
    found = polytope_stability([one, other])
    assert not found.holds
    assert found.abscissa == pytest.approx(-0.1)
    assert not polytope_stability([one], decay=0.2).holds


def test_the_printed_gains_cover_the_speed_range() -> None:
    """The vertices differ by 0.0096 1/s in one coefficient, so that little is lost against the slowest pole."""
    for design in PUBLISHED.values():
        found = polytope_stability(design.errors)
        assert 0.97 * -found.abscissa < found.decay < -found.abscissa
        assert found.holds
        assert design.gains[1, 0, 0] - design.gains[0, 0, 0] == pytest.approx(0.01 if design is SECTION_3_3_4 else 0.0)


def test_scaled_coordinates_and_refusals() -> None:
    A = np.array([[-1.0, 1e6], [0.0, -1.0]])
    P = polytope_stability([A], scaling=[1.0, 1e6]).lyapunov_matrix
    assert np.linalg.eigvalsh(A.T @ P + P @ A).max() < 0.0
    with pytest.raises(ValueError, match=r"shapes none; expected finite ones"):
        polytope_stability([])
    with pytest.raises(ValueError, match=r"scaling \[1.0\], expected 2 positive numbers"):
        polytope_stability([A], scaling=[1.0])


# -- the train observer -----------------------------------------------------------------------------------------------


def test_gains_for_the_train_observer() -> None:
    """The same question as `chapter_5`, in the units of M = 3.36. The page on these observers certifies the gains."""
    davis = {"davis_b": 5.7e-3, "davis_c": -2.4e-4, "residual_gain": 3.36}
    values, design = design_quasi_lpv_gains(0.2, alpha=0.2 * (3.36 / 0.3) ** 2, parameters=davis)
    equal = design_robust_residual(chapter_5(0.2))
    np.testing.assert_allclose(design.gains, equal.gains, rtol=1e-6)
    assert design.attenuation == pytest.approx(equal.attenuation * 3.36 / 0.3, rel=1e-6)
    assert values["gain_high"] == tuple(design.gains[1, :, 0])
    heavy = {"mass": 1e5, "davis_b": 570.0, "davis_c": -24.0, "residual_gain": 3.36}
    np.testing.assert_allclose(
        design_quasi_lpv_gains(0.2, parameters=heavy)[0]["gain_low"], values["gain_low"], rtol=0.02
    )

"""Certified limits against independently measured numbers and closed forms."""

from typing import Any

import numpy as np
import pytest

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, DECREASE, GROWTH
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.observers.train import DifferentiatorCdo, MultirateCdo, TakagiSugenoCdo

READING = 0.01  # relative: the independent measurement is given to two or three digits


def double_integrator(theta: float) -> SampledError:
    return SampledError.of([[0.0, 1.0], [0.0, 0.0]], (2.0 * theta, theta**2), 2.0 * theta)


@pytest.mark.parametrize(
    ("decay", "constant", "aperiodic"),
    [
        (3.0, 0.286, 0.286),
        (6.0, 0.50, 0.496),
        (8.0, 0.73, 0.713),
        (9.9, 0.985, 0.779),
        (12.0, 1.28, 0.740),
        (15.0, None, 0.637),
    ],
)
def test_printed_takagi_sugeno_gains_by_decay(decay: float, constant: float | None, aperiodic: float) -> None:
    certificate = next(TakagiSugenoCdo().findings(0.25, {"innovation_decay": decay}))
    if constant is not None:
        assert certificate.condition(CONSTANT_GAP).limit == pytest.approx(constant, rel=READING)
    assert certificate.limit == pytest.approx(aperiodic, rel=READING)
    assert certificate.holds


def test_published_gains_grow_the_error_at_their_design_gap() -> None:
    certificate = next(TakagiSugenoCdo().findings(0.5, preset="as_published"))
    assert certificate.numbers[GROWTH] == pytest.approx(2.7226, abs=5e-5)  # independently measured to that digit
    assert not certificate.holds
    assert certificate.numbers[DECREASE] < 0.0
    assert "(as_published)" in certificate.explain()


@pytest.mark.parametrize("theta", [1.0, 2.0, 8.0, 30.0])
def test_double_integrator_limits_scale_with_theta(theta: float) -> None:
    certificate = certify_sampled_error((double_integrator(theta),), 0.1 / theta, "double integrator")
    assert theta * certificate.condition(CONSTANT_GAP).limit == pytest.approx(5.0, rel=READING)
    assert theta * certificate.limit == pytest.approx(4.0, rel=READING)


def test_constant_limit_is_the_root_of_the_closed_form() -> None:
    """-1 is an eigenvalue of Phi where ``2 + 2 e^(-2x) - x + q + x q = 0``, ``q = (1 - e^(-2x))/2``,
    ``x = theta tau``.
    """
    x = first_unstable_gap((double_integrator(1.0),), 20.0)
    q = 0.5 * (1.0 - np.exp(-2.0 * x))
    assert 2.0 + 2.0 * np.exp(-2.0 * x) - x + q + x * q == pytest.approx(0.0, abs=1e-6)


def test_contraction_at_half_a_second() -> None:
    assert double_integrator(8.0).spectral_radius(0.5) == pytest.approx(0.4995, abs=1e-4)
    assert double_integrator(8.0).spectral_radius(2.0) == pytest.approx(6.7, rel=READING)


@pytest.mark.parametrize("observer", [DifferentiatorCdo(), MultirateCdo()], ids=lambda o: o.name)
@pytest.mark.parametrize(("gap", "holds"), [(0.3, True), (0.49, True), (0.51, False), (0.63, False)])
def test_high_gain_observers_hold_up_to_four_over_theta(observer: DifferentiatorCdo, gap: float, holds: bool) -> None:
    assert next(observer.findings(gap)).holds is holds


def test_no_limit_within_the_horizon_is_infinite() -> None:
    certificate = next(DifferentiatorCdo().findings(5.0, {"theta": 0.01}))
    assert certificate.condition(CONSTANT_GAP).limit == np.inf
    assert certificate.limit == np.inf
    assert certificate.holds


@pytest.mark.parametrize("gains", [{"theta": 0.0}, {"high_gain": (-2.0, -1.0)}], ids=["none", "wrong sign"])
def test_no_correction_or_a_wrong_one_has_no_stable_gap(gains: dict[str, float | tuple[float, float]]) -> None:
    certificate = next(DifferentiatorCdo().findings(0.5, gains))
    assert (certificate.condition(CONSTANT_GAP).limit, certificate.limit, certificate.holds) == (0.0, 0.0, False)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"theta": -1.0}, r"'theta' to certify must be at least 0 1/s, got \[-1.0\]"),
        ({"mass": 0.0}, r"'mass' to certify must be at least 1 kg"),
        ({"theta": "eight"}, r"'theta' to certify needs 1 finite number\(s\), got 'eight'"),
        ({"high_gain": (2.0, float("nan"))}, r"'high_gain' to certify needs 2 finite number\(s\)"),
        ({"high_gain": (2.0, 1.0, 0.5)}, r"'high_gain' to certify needs 2 finite number\(s\)"),
    ],
)
def test_values_that_cannot_be_are_refused(value: dict[str, Any], message: str) -> None:
    """A negative mass was once found unstable, a mass of zero divided by."""
    with pytest.raises(ValueError, match=message):
        next(DifferentiatorCdo().findings(0.5, value))


def test_transitions_on_a_grid_are_the_single_ones() -> None:
    error = double_integrator(3.0)
    gaps, matrices = error.transitions(1.3, 37)
    for k in (0, 1, 17, 36):
        np.testing.assert_allclose(matrices[k], error.transition(gaps[k]), rtol=1e-11, atol=1e-13)

"""Gains of the augmented observers: design, certificates, noise; against scratch computations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from fmu_observer.certificates.aperiodic import aperiodic_limit
from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.design.augmented_gains import (
    UNIT_POLES,
    _noise_to_speed,
    _sampled_errors,
    augmented_matrix,
    design_for_gap,
    position_gains,
)
from fmu_observer.observers.train import AugmentedHighGainCdo, AugmentedTakagiSugenoCdo
from fmu_observer.observers.train.augmented_observer import AugmentedTrainObserver
from fmu_observer.observers.train.augmented_takagi_sugeno_cdo import BALISES_BESIDE_FIXES, BALISES_ONLY, FIXES

BINOMIAL = (4.0, 6.0, 4.0, 1.0)
both = pytest.mark.parametrize("make", [AugmentedHighGainCdo, AugmentedTakagiSugenoCdo])


def by_hand(gains: np.ndarray, decay: float, gap: float, slope: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Transition over a gap and the influence of the innovation's noise, by SciPy's exponential."""
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4], block[4, 4] = np.diag(np.ones(3), 1), -np.asarray(gains), -decay
    block[1, 1] = -slope
    exponential = expm(block * gap)
    return exponential[:4, :4] + np.outer(exponential[:4, 4], [1.0, 0.0, 0.0, 0.0]), exponential[:4, 4]


def test_limits_of_the_binomial_gains() -> None:
    error = _sampled_errors(BINOMIAL, 4.0, (0.0,))
    constant = first_unstable_gap(error, 20.0)
    assert constant == pytest.approx(1.283, abs=5e-4)  # spec 5.6
    for gap, stable in ((1.28, True), (1.29, False)):
        transition, _ = by_hand(np.array(BINOMIAL), 4.0, gap)
        assert bool(np.abs(np.linalg.eigvals(transition)).max() < 1.0) is stable
    assert aperiodic_limit(error, 20.0) == pytest.approx(0.978, abs=2e-3)  # as the docstring says


@given(poles=st.lists(st.floats(-4.0, -0.3), min_size=4, max_size=4), slope=st.floats(0.0, 0.01))
def test_position_gains_place_the_poles(poles: list[float], slope: float) -> None:
    gains = position_gains(poles, slope)
    closed = augmented_matrix(slope) - np.outer(gains, [1.0, 0.0, 0.0, 0.0])
    # coefficients; roots are ill-conditioned
    np.testing.assert_allclose(np.poly(closed), np.poly(poles), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("poles", [(-1.0, -1.0, -1.0), (-1.0, -1.0, 0.0, -1.0), (-1.0, np.nan, -1.0, -1.0)])
def test_bad_poles_are_refused(poles: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="expected 4 finite poles with negative real parts"):
        position_gains(poles)


@settings(max_examples=4, deadline=None)
@given(gap=st.floats(0.05, 4.0), margin=st.floats(0.05, 0.5))
def test_a_design_is_certified_for_its_gap_and_its_margin(gap: float, margin: float) -> None:
    design = design_for_gap(gap, (0.0, 2e-3), margin)
    assert design.certificate.holds
    assert design.certificate.limit == pytest.approx((1.0 + margin) * gap, rel=0.01)  # drag and bisection
    assert design.decay == design.gains[0]
    # Never contradicted: random products of the exact transitions vanish.
    product = np.eye(4)
    for length in np.random.default_rng(0).uniform(0.0, gap, 400):
        product = by_hand(np.array(design.gains), design.decay, length)[0] @ product
    assert np.abs(product).max() < 1e-3


@pytest.mark.parametrize(("gap", "margin"), [(0.0, 0.1), (-1.0, 0.1), (np.inf, 0.1), (0.5, 0.0), (0.5, np.nan)])
def test_bad_gaps_and_margins_are_refused(gap: float, margin: float) -> None:
    with pytest.raises(ValueError, match="expected a positive gap"):
        design_for_gap(gap, margin=margin)


def test_the_shipped_gains_are_those_of_the_design() -> None:
    np.testing.assert_allclose(BALISES_ONLY, design_for_gap(0.5).gains, rtol=1e-4)  # the limit is bisected to 2e-4
    np.testing.assert_allclose(BALISES_BESIDE_FIXES, position_gains(1.5 * np.array(UNIT_POLES)), rtol=1e-5)
    np.testing.assert_allclose(FIXES, position_gains(0.7 * np.array(UNIT_POLES)), rtol=1e-5)


def test_noise_to_speed_is_that_of_a_long_run() -> None:
    gains = position_gains((-0.5, -0.5, -0.5, -0.5))
    transition, influence = by_hand(gains, float(gains[0]), 0.1)
    error, speeds = np.zeros(4), []
    for n in np.random.default_rng(1).standard_normal(200_000):
        error = transition @ error - influence * n  # the sign of a measured position
        speeds.append(error[1])
    expected = _noise_to_speed(_sampled_errors(gains.tolist(), float(gains[0]), (0.0,))[0], 0.1)
    # 200000 samples, correlated over about 1 / (0.5 1/s 0.1 s) = 20 of them: one per cent
    assert np.std(speeds) == pytest.approx(expected, rel=0.03)
    assert _noise_to_speed(_sampled_errors(BINOMIAL, 4.0, (0.0,))[0], 1.5) == np.inf


LIMITS = {  # [s], balise gaps that the docstrings name
    AugmentedHighGainCdo: {"gps_and_balises": 0.652, "gps": 1.398, "balises": 0.559},
    AugmentedTakagiSugenoCdo: {"gps_and_balises": 0.664, "gps": 1.424, "balises": 0.550, "odometer_trusted": np.inf},
}
MIXED = {AugmentedHighGainCdo: "limit 0.12 s", AugmentedTakagiSugenoCdo: "limit 0.2506 s"}


@both
def test_every_preset_is_certified_for_what_it_is_for(make: type[AugmentedTrainObserver]) -> None:
    observer = make()
    assert set(observer.presets) == set(LIMITS[make])
    for preset, limit in LIMITS[make].items():
        certificate = next(observer.findings(0.5, preset=preset))
        assert certificate.holds
        assert certificate.limit == pytest.approx(limit, abs=1e-3)
        assert certificate.limit <= certificate.condition(CONSTANT_GAP).limit
        assert ("'gps' samples" if preset == "gps" else "'balise' samples") in certificate.explain()
    reported = next(observer.findings(0.5)).explain()
    assert f"fixes and balises in any order certified for gaps up to 0.1 s ({MIXED[make]})" in reported
    for gap, kinds in ((0.3, "fixes and balises in any order"), (2.5, "fixes alone")):
        certificate = next(observer.findings(0.5, {"fix_period": gap}))
        assert not certificate.holds
        assert f"{kinds} NOT certified for gaps up to {gap} s" in certificate.explain()


def test_gains_that_are_too_high_are_not_certified() -> None:
    certificate = next(AugmentedHighGainCdo().findings(0.5, {"theta_balise": 3.0}, "balises"))
    assert not certificate.holds
    assert certificate.numbers[GROWTH] > 1.0
    assert certificate.condition(CONSTANT_GAP).limit == pytest.approx(1.283 / 3.0, rel=2e-3)
    assert not next(AugmentedHighGainCdo().findings(0.5, {"odometer_period": 1.0}, "balises")).holds
    assert not next(AugmentedHighGainCdo().findings(0.5, {"theta_balise": 0.0, "theta_gps": 0.0})).holds


@both
@pytest.mark.parametrize("seed", range(3))
def test_certified_mixtures_do_converge(make: type[AugmentedTrainObserver], seed: int) -> None:
    """Random orders of fixes and balises with random gaps up to fix_period, by scratch transitions of the gains in
    use.
    """
    observer = make()
    p = observer.unpack_parameters(observer.start_parameters())
    generator, product = np.random.default_rng(seed), np.eye(4)
    for _ in range(2000):
        gains, decay = observer.gains_of(("balise", "gps")[generator.integers(2)], p)
        product = by_hand(np.array(gains), float(decay), generator.uniform(0.0, 0.1))[0] @ product
    assert np.abs(product).max() < 1e-6


def test_an_unknown_first_stage_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown first_stage 'radar'; choose one of: multirate, differentiator"):
        AugmentedHighGainCdo("radar")  # type: ignore[arg-type]

"""Gap-aware designs: certified for the gaps asked for, never contradicted over random gaps, and bad input in words."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import SteadyMotion, in_step
from own_condition import other_gains
from scipy.linalg import expm

from fmu_observer import OBSERVERS
from fmu_observer.certificates.gap_findings import GROWTH
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.design.certified_gains import rounded_down
from fmu_observer.observers.train import DifferentiatorCdo, MultirateCdo, TrainObserver
from fmu_observer.observers.train.gains.gap_aware import (
    GainDesign,
    _noise_amplification,
    balise_gaps,
    design_adaptive,
    design_high_gain,
    design_takagi_sugeno,
)

TRACK = (100.0, (5.0, 14.0))
DESIGNS: dict[str, Callable[[], GainDesign]] = {
    "high gain": cache(lambda: design_high_gain(*TRACK)),
    "balises": cache(lambda: design_takagi_sugeno(*TRACK)),
    "odometer": cache(lambda: design_takagi_sugeno(*TRACK, trust="odometer")),
}


@pytest.mark.parametrize("make", DESIGNS.values(), ids=DESIGNS)
def test_a_design_is_certified_with_its_margin_by_the_observer_itself(make: Callable[[], GainDesign]) -> None:
    design = make()
    observer: TrainObserver = OBSERVERS[design.observer]()  # type: ignore[assignment]
    assert design.gaps.longest == pytest.approx(20.0)
    assert next(observer.findings(1.1 * design.gaps.longest, design.parameters)).holds
    assert design.margin >= 0.1
    assert design.certificate.explain().startswith(f"{design.observer} (")


def test_the_largest_theta_is_taken() -> None:
    theta = DESIGNS["high gain"]().parameters["theta"]
    assert theta == pytest.approx(4.0 / 22.0, rel=0.01)  # three digits, and what the drag takes
    assert not next(OBSERVERS["differentiator_cdo"]().findings(22.0, {"theta": 1.02 * theta})).holds  # type: ignore[attr-defined]
    assert design_high_gain(*TRACK, observer=MultirateCdo()).parameters == {"theta_2": theta}


def test_another_shape_of_gain_has_another_limit() -> None:
    observer, shape = DifferentiatorCdo(), {"high_gain": (3.0, 2.25)}
    advice = other_gains(observer, 10.0, shape)
    theta = float(advice.removeprefix("theta at most ").split()[0])
    assert next(observer.findings(10.0, {**shape, "theta": theta})).holds
    assert not next(observer.findings(10.0, {**shape, "theta": 1.02 * theta})).holds


def test_both_families_say_what_they_cost() -> None:
    balises, odometer = DESIGNS["balises"]().noise, DESIGNS["odometer"]().noise
    assert balises.slip == 0.0
    assert odometer.slip == pytest.approx(1.0, rel=1e-6)
    assert odometer.speed == 0.0 < balises.speed
    assert "1 m/s of odometer slip 1 m/s" in DESIGNS["odometer"]().explain()
    assert "Gaps up to 20 s occur, certified are 22.12 s" in DESIGNS["high gain"]().explain()


@pytest.mark.parametrize("make", DESIGNS.values(), ids=DESIGNS)
@settings(max_examples=10, deadline=None)
@given(relative=st.lists(st.floats(0.05, 1.0), min_size=4, max_size=12), seed=st.integers(0, 99))
def test_a_certified_design_never_diverges(make: Callable[[], GainDesign], relative: list[float], seed: int) -> None:
    design = make()
    motion = SteadyMotion(speed=10.0)
    runner = in_step(OBSERVERS[design.observer](), motion)  # type: ignore[arg-type]
    runner.set("p", {n: v for name, v in design.parameters.items() for n, v in _scalars(runner.system, name, v)})
    runner.set("p", {"internal_step": 0.02})  # theta times it: 4e-3
    runner.runtime.x[:2] += np.random.default_rng(seed).normal(size=2)
    runner.runtime.start(0.0)
    runner.balise(0.0)
    P = np.array(design.certificate.lyapunov_matrix)
    levels = []
    for gap in (design.gaps.longest * share for share in relative):
        e = runner.runtime.x[:2] - [motion.position(runner.runtime.t), motion.speed]
        levels.append(np.sqrt(e @ P @ e))
        runner.runtime.advance(runner.runtime.t + gap)
        runner.balise(motion.position(runner.runtime.t))
    # integration of the chattering differentiator: 7 N on 90 t over a gap of 20 s moves 0.02 m, weighed by P
    leeway = 0.03 * np.sqrt(P[0, 0]) + 0.002 * np.sqrt(P[1, 1])
    assert all(after <= before + leeway for before, after in pairwise(levels))


def _scalars(system: object, name: str, value: float) -> list[tuple[str, float]]:
    signal = next(s for s in system.parameter_signals if s.name == name)  # type: ignore[attr-defined]
    return [(scalar, value) for scalar in signal.scalar_names]


# -- the adapting gain
# --------------------------------------------------------------------------------------------------


def test_an_adapting_rule_is_certified_for_every_change_of_speed() -> None:
    design = design_adaptive(*TRACK, acceleration=0.7)
    assert next(OBSERVERS["adaptive_gain_cdo"]().findings(22.0, design.parameters)).holds  # type: ignore[attr-defined]
    assert design.parameters["assumed_acceleration"] == 0.7
    assert design.parameters["theta_max"] == pytest.approx(design.parameters["ratio"] * 14.0 / 100.0)
    assert design.parameters["theta_max"] > 1.5 * DESIGNS["high gain"]().parameters["theta"]


def test_spacings_that_differ_are_part_of_what_is_assumed() -> None:
    design = design_adaptive([0.0, 90.0, 200.0, 300.0], (8.0, 14.0), acceleration=0.4)
    assert design.parameters["expected_spacing"] == 100.0
    assert design.parameters["assumed_spacing_error"] == pytest.approx(0.1)
    assert design.gaps.longest == pytest.approx(110.0 / 8.0)


def test_where_no_rule_is_certified_the_constant_gain_is_named() -> None:
    with pytest.raises(ValueError, match=r"no rule is certified for gaps up to 50 s .* a constant theta of 0\.0727 is"):
        design_adaptive(100.0, (2.0, 14.0), acceleration=0.7)


# -- noise
# --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.5, 6.0, 11.0])
def test_the_amplification_is_that_of_a_simulated_error(gap: float) -> None:
    """Monte Carlo over 40000 balises: standard deviations to 0.5 % each, more where balises are close; 3 % are
    allowed.
    """
    theta = 0.4
    K1, K2 = 2.0 * theta, theta**2
    error = SampledError.of([[0.0, 1.0], [0.0, 0.0]], (K1, K2), K1)
    generator = np.array([[0.0, 1.0, -K1], [0.0, 0.0, -K2], [0.0, 0.0, -K1]])
    moves = np.stack([expm(generator * t)[:2] for t in np.linspace(0.0, gap, 16)])
    noise, e, found = np.random.default_rng(1).normal(size=40000), np.zeros(2), []
    for n in noise:
        course = moves @ [*e, e[0] - n]
        found.append(course)
        e = course[-1]
    expected = np.std(found, axis=0).max(axis=0)
    amplification = _noise_amplification([(error, gap)])
    assert (amplification.position, amplification.speed) == pytest.approx(expected, rel=0.03)
    assert amplification.slip == 0.0


def test_the_amplification_scales_with_the_gain() -> None:
    """In units of 1 / theta nothing changes: position alike, speed as theta."""
    found = [
        _noise_amplification([(SampledError.of([[0.0, 1.0], [0.0, 0.0]], (2.0 * k, k * k), 2.0 * k), 3.0 / k)])
        for k in (1.0, 8.0)
    ]
    assert found[1].position == pytest.approx(found[0].position)
    assert found[1].speed == pytest.approx(8.0 * found[0].speed)


def test_an_unstable_gap_has_no_amplification() -> None:
    with pytest.raises(ValueError, match=r"the error grows at a constant gap of 0\.7 s"):
        _noise_amplification([(SampledError.of([[0.0, 1.0], [0.0, 0.0]], (16.0, 64.0), 16.0), 0.7)])


# -- input
# --------------------------------------------------------------------------------------------------------------


def test_gaps_come_from_the_extremes() -> None:
    gaps = balise_gaps([0.0, 40.0, 140.0], (5.0, 20.0))
    assert (gaps.nearest, gaps.farthest) == (40.0, 100.0)
    assert (gaps.shortest, gaps.longest) == (2.0, 20.0)


@pytest.mark.parametrize(
    ("spacing", "speeds", "message"),
    [
        (100.0, (0.0, 14.0), "0 < slowest <= fastest.*may stand still"),
        (100.0, (14.0, 5.0), "got 14 and 5"),
        (100.0, (5.0, np.inf), "got 5 and inf"),
        (0.0, (5.0, 14.0), r"spacing must be positive and finite \[m\], got 0"),
        (-3.0, (5.0, 14.0), "got -3"),
        ([0.0, 50.0, 50.0], (5.0, 14.0), "balises 2 and 3 both lie at 50 m"),
        ([0.0, 50.0, 20.0], (5.0, 14.0), "number 3 at 20 m follows number 2 at 50 m"),
        ([10.0], (5.0, 14.0), r"at least two positions, got 1"),
        ([0.0, np.nan], (5.0, 14.0), "positive and finite"),
    ],
)
def test_bad_input_is_refused_in_words(spacing: float, speeds: tuple[float, float], message: str) -> None:
    for design in (design_high_gain, design_takagi_sugeno, design_adaptive):
        with pytest.raises(ValueError, match=message):
            design(spacing, speeds)


def test_other_bad_wishes_are_refused_too() -> None:
    with pytest.raises(ValueError, match="unknown trust 'luck'"):
        design_takagi_sugeno(*TRACK, trust="luck")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="margin must not be negative"):
        design_high_gain(*TRACK, margin=-0.1)


@given(st.floats(1e-6, 1e6))
def test_rounding_down_never_rounds_up(value: float) -> None:
    rounded = rounded_down(value)
    assert value * (1.0 - 1e-2) <= rounded <= value
    assert float(f"{rounded:.2e}") == rounded


@settings(max_examples=15)
@given(gap=st.floats(0.01, 90.0))
def test_the_gains_for_a_stranger_are_stable_at_any_gap(gap: float) -> None:
    """The error of the speed decays by itself, and a balise takes a share between 0 and 0.8 of that of the position."""
    certificate = next(OBSERVERS["takagi_sugeno_cdo"]().findings(gap, preset="long_gaps"))
    assert certificate.holds
    expected = max(0.2 + 0.8 * np.exp(-3.0 * gap), np.exp(-1.6 * gap))
    assert certificate.numbers[GROWTH] == pytest.approx(expected, abs=1e-3)  # the drag damps a little more


def test_the_preset_for_long_gaps_is_the_design_that_trusts_the_odometer() -> None:
    designed = design_takagi_sugeno(spacing=100.0, speeds=(5.0, 14.0), trust="odometer").parameters
    for name, value in OBSERVERS["takagi_sugeno_cdo"].presets["long_gaps"].items():
        np.testing.assert_allclose(value, designed[name], rtol=1e-12)

"""The observer whose gain follows the expected gap: spacings where constant gains fail, and its certificate against
journeys.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import DAVIS_A, DAVIS_B, DAVIS_C, INERTIA, MASS, RADIUS, SteadyMotion, SystemRunner, started
from scipy.linalg import eigh, expm

from fmu_observer.certificates.adapting_gain import GainAdaptation, certify_adapting_gain
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.observers.train import AdaptiveGainCdo, DifferentiatorCdo, TrainObserver
from plant_models.hybrid import Runtime

SLOPES = (DAVIS_B / MASS, (DAVIS_B + 2.0 * DAVIS_C * 50.0) / MASS)
STEP = 0.02


class Journey:
    """A train at piecewise constant acceleration: 5 m/s, up to 14, hold, down to 5, hold; 160 s, 1.6 km."""

    def __init__(self) -> None:
        self.starts = [
            (0.0, 0.0, 5.0, 0.5),
            (18.0, 171.0, 14.0, 0.0),
            (100.0, 1319.0, 14.0, -0.5),
            (118.0, 1490.0, 5.0, 0.0),
        ]

    def at(self, t: float) -> tuple[float, float, float]:
        t0, p0, v0, a = [start for start in self.starts if start[0] <= t][-1]
        return p0 + v0 * (t - t0) + 0.5 * a * (t - t0) ** 2, v0 + a * (t - t0), a

    def crossing(self, place: float) -> float:
        t0, p0, v0, a = [start for start in self.starts if start[1] <= place][-1]
        way = place - p0
        return t0 + (way / v0 if a == 0.0 else (np.sqrt(v0 * v0 + 2.0 * a * way) - v0) / a)


def ride(runner: SystemRunner, spacing: float, until: float = 160.0, wheels: float = 0.0) -> np.ndarray:
    """Speed errors every `STEP` with a balise every `spacing` metres; the effort accelerates `wheels` [kg] of inertia
    too.
    """
    journey, errors = Journey(), []
    stamps = iter([float(journey.crossing(place)) for place in np.arange(spacing, journey.at(until)[0], spacing)])
    following = next(stamps, np.inf)
    for k in range(round(until / STEP)):
        _, v, a = journey.at((k + 0.5) * STEP)
        effort = (MASS + wheels) * a + DAVIS_A + DAVIS_B * v + DAVIS_C * v * v
        runner.set("u", {"effort": effort, "odometer": v})
        if k == 0:
            runner.runtime.start(0.0)
        while following <= (k + 1) * STEP:
            runner.runtime.advance(following)
            runner.set("u", {"odometer": journey.at(following)[1]})
            runner.balise(journey.at(following)[0])
            following = next(stamps, np.inf)
        runner.runtime.advance((k + 1) * STEP)
        errors.append(runner.state("estimated_speed") - journey.at((k + 1) * STEP)[1])
        if abs(errors[-1]) > 1e3:
            break
    return np.array(errors)


@pytest.mark.parametrize("spacing", [2.0, 8.7, 25.0, 100.0])
def test_it_follows_where_a_constant_gain_of_8_diverges(spacing: float) -> None:
    """Adhesion force exact, as in the independent measurement: end errors up to 3 mm/s for 2 to 100 m, a start 4 m/s
    wrong.
    """
    adaptive = ride(SystemRunner(AdaptiveGainCdo(), expected_spacing=spacing), spacing)
    assert abs(adaptive[-1]) <= 0.003
    assert np.abs(adaptive).max() < 4.5
    constant = SystemRunner(AdaptiveGainCdo(), theta_min=8.0, theta_max=8.0)
    assert bool(np.abs(ride(constant, spacing)).max() > 1e3) is (spacing >= 8.7)


def test_a_constant_gain_of_2_pays_with_large_transients() -> None:
    errors = ride(SystemRunner(AdaptiveGainCdo(), theta_min=2.0, theta_max=2.0), 25.0)
    assert 10.0 < np.abs(errors).max() < 100.0  # 61 m/s were measured on another journey


@pytest.mark.parametrize("first_stage", ["differentiator", "effort"])
def test_the_differentiator_takes_out_what_the_wheels_inertia_costs(first_stage: str) -> None:
    runner = SystemRunner(AdaptiveGainCdo(first_stage=first_stage), expected_spacing=25.0)  # type: ignore[arg-type]
    runner.set("x", {"estimated_speed": 5.0})
    if first_stage == "differentiator":
        runner.set("x", {"wheel_rate": 5.0 / RADIUS, "wheel_acceleration": 0.5 / RADIUS})
    errors = ride(runner, 25.0, until=17.0, wheels=INERTIA / RADIUS**2)
    bias = INERTIA / RADIUS**2 * 0.5 / MASS  # [m/s2]
    assert abs(errors[-1]) < 4.0 * bias  # a second of it, and some: theta is about 1 1/s
    assert bool(abs(errors[-1]) > 0.2 * bias) is (first_stage == "effort")


# -- the rule
# -----------------------------------------------------------------------------------------------------------


def gains_at(observer: TrainObserver, places: list[float], speed: float, odometer: float | None = None) -> list[float]:
    motion = SteadyMotion(speed=speed, slip_speed=0.0 if odometer is None else odometer - speed)
    runner = started(observer, motion)
    gains = []
    for place in places:
        runner.balise(place)
        gains.append(runner.outputs()["gain"])
    return gains


def test_the_gain_is_ratio_times_speed_over_spacing_within_its_limits() -> None:
    assert gains_at(AdaptiveGainCdo(), [0.0], 12.0) == pytest.approx([2.5 * 12.0 / 50.0])
    assert gains_at(AdaptiveGainCdo(), [0.0], 0.1) == pytest.approx([0.1])
    assert gains_at(AdaptiveGainCdo(), [0.0], 400.0) == pytest.approx([8.0])
    assert gains_at(AdaptiveGainCdo(), [0.0], -12.0) == pytest.approx([0.6])


def test_limits_in_the_wrong_order_run_as_they_are_certified() -> None:
    """theta_max below theta_min is judged as theta_min; NumPy's clip and CasADi's would take the one or the other."""
    runtime = Runtime(AdaptiveGainCdo())
    names = [name for signal in runtime.system.parameter_signals for name in signal.scalar_names]
    runtime.p[[names.index("theta_min"), names.index("theta_max")]] = 5.0, 1.0
    inputs = [name for signal in runtime.system.input_signals for name in signal.scalar_names]
    runtime.u[inputs.index("odometer")] = 10.0
    runtime.start(0.0)
    runtime.trigger("balise")
    outputs = dict(zip((s.name for s in runtime.system.outputs), runtime.update_outputs(), strict=True))
    assert outputs["gain"] == 5.0


def test_the_estimated_speed_does_not_listen_to_a_slipping_wheel() -> None:
    assert gains_at(AdaptiveGainCdo(gain_speed="odometer"), [0.0], 12.0, odometer=24.0) == pytest.approx([1.2])
    assert gains_at(AdaptiveGainCdo(gain_speed="estimated"), [0.0], 12.0, odometer=24.0) == pytest.approx(
        [0.1]
    )  # starts at 1 m/s


def test_the_spacing_is_learnt_from_the_last_two_balises() -> None:
    places = [1000.0, 1100.0, 1102.0, 1302.0, 1102.0]  # one alone, 100 m, a double one, 200 m, 200 m backwards
    expected = [0.6, 0.3, 0.3, 0.15, 0.15]
    assert gains_at(AdaptiveGainCdo(spacing="learnt"), places, 12.0) == pytest.approx(expected)
    assert gains_at(AdaptiveGainCdo(), places, 12.0) == pytest.approx([0.6] * 5)


@pytest.mark.parametrize("option", [{"first_stage": "wish"}, {"gain_speed": "wish"}, {"spacing": "wish"}])
def test_an_unknown_option_is_refused_with_what_there_is(option: dict[str, str]) -> None:
    with pytest.raises(ValueError, match=f"unknown {next(iter(option))} 'wish'; choose one of: "):
        AdaptiveGainCdo(**option)  # type: ignore[arg-type]


# -- the certificate
# ----------------------------------------------------------------------------------------------------


def adaptation(**changes: object) -> GainAdaptation:
    values = {
        "ratio": 2.0,
        "theta_min": 0.12,
        "theta_max": 3.0,
        "spacing": 100.0,
        "high_gain": (2.0, 1.0),
        "drag_slopes": SLOPES,
        "acceleration": 0.7,
        "speed_tolerance": 0.05,
        "spacing_tolerance": 0.05,
    }
    return GainAdaptation(**(values | changes))  # type: ignore[arg-type]


def test_without_any_change_of_speed_it_is_the_constant_gains_certificate() -> None:
    steady = adaptation(acceleration=0.0, speed_tolerance=0.0, spacing_tolerance=0.0)
    certificate = certify_adapting_gain(steady, 10.0, "model")
    assert certificate.limit * 0.12 == pytest.approx(4.0, abs=0.03)  # drag: 0.02 at this theta
    assert certificate.condition(CONSTANT_GAP).limit * 0.12 == pytest.approx(5.0, abs=0.05)
    assert certificate.numbers[GROWTH] == pytest.approx(
        next(DifferentiatorCdo().findings(10.0, {"theta": 0.2})).numbers[GROWTH], rel=0.02
    )
    reference = next(DifferentiatorCdo().findings(20.0, {"theta": 0.12}))
    assert certificate.condition(CONSTANT_GAP).limit == pytest.approx(reference.condition(CONSTANT_GAP).limit, rel=2e-3)
    assert certificate.limit == pytest.approx(reference.limit, rel=5e-3)


def test_a_ratio_beyond_four_is_certified_only_while_the_upper_limit_holds() -> None:
    certificate = certify_adapting_gain(
        adaptation(ratio=4.5, acceleration=0.0, speed_tolerance=0.0, spacing_tolerance=0.0), 1.0, "m"
    )
    assert certificate.holds
    assert certificate.limit * 3.0 == pytest.approx(4.0, abs=0.02)


def test_every_assumption_costs_gap() -> None:
    limits = [
        certify_adapting_gain(adaptation(**change), 1.0, "m").limit
        for change in ({}, {"acceleration": 1.0}, {"speed_tolerance": 0.15}, {"spacing_tolerance": 0.2})
    ]
    assert all(limit < 0.97 * limits[0] for limit in limits[1:])


def journey_of(
    rule: GainAdaptation, max_gap: float, choices: list[tuple[float, float, float, float]]
) -> Iterator[tuple[float, float]]:
    """Gap and gain from its beginning on, of a train within the assumptions; choices: two accelerations, spacing,
    odometer.
    """
    slowest, v, theta = rule.slowest_speed(max_gap), rule.slowest_speed(max_gap), rule.theta_min
    for early, late, place, odometer in choices:
        theta = float(
            np.clip(
                rule.ratio * v * (1.0 + rule.speed_tolerance * odometer) / rule.spacing, rule.theta_min, rule.theta_max
            )
        )
        way, gap, half = rule.spacing * (1.0 + rule.spacing_tolerance * place), 0.0, 0.5 * rule.spacing
        step = max_gap / 2000.0
        while way > 0.0:
            a = rule.acceleration * (early if way > half else late)
            faster = max(v + a * step, slowest)
            moved = 0.5 * (v + faster) * step
            share = min(1.0, way / moved)
            gap, way, v = gap + share * step, way - moved, v + share * (faster - v)
        yield gap, theta


def growth(rule: GainAdaptation, P: np.ndarray, gap: float, theta: float, following: float, slope: float) -> float:
    """Largest growth of ``theta eps' P eps`` over a gap, in any direction, by SciPy's exponential of the error
    equations.
    """
    K1, K2 = theta * rule.high_gain[0], theta**2 * rule.high_gain[1]
    moved = expm(np.array([[0.0, 1.0, -K1], [0.0, -slope, -K2], [0.0, 0.0, -K1]]) * gap)[:2]
    transition = moved[:, :2] + np.outer(moved[:, 2], [1.0, 0.0])
    before, after = (scale * P * np.outer([1.0, 1.0 / scale], [1.0, 1.0 / scale]) for scale in (theta, following))
    return float(eigh(transition.T @ after @ transition, before, eigvals_only=True)[-1])


accelerations = st.one_of(st.sampled_from([-1.0, 0.0, 1.0]), st.floats(-1.0, 1.0))
units = st.one_of(st.sampled_from([-1.0, 1.0]), st.floats(-1.0, 1.0))
RULE = adaptation()
WIDE = adaptation(
    theta_min=0.02, theta_max=8.0, acceleration=1.0, speed_tolerance=0.0, spacing_tolerance=0.0
)  # changes decide here


@cache
def limit() -> float:
    return certify_adapting_gain(RULE, 1.0, "model").limit


@settings(max_examples=40, deadline=None)
@given(
    choices=st.lists(st.tuples(accelerations, accelerations, units, units), min_size=4, max_size=12),
    slope=st.sampled_from(SLOPES),
    share=st.sampled_from([1.0, 0.6, 0.2]),
)
def test_no_journey_contradicts_the_certificate(
    choices: list[tuple[float, float, float, float]], slope: float, share: float
) -> None:
    longest = share * limit()
    certificate = certify_adapting_gain(RULE, longest, "model")
    assert certificate.holds
    steps = list(journey_of(RULE, longest, choices))
    assert max(gap for gap, _ in steps) <= longest * (1.0 + 1e-9)
    P = np.array(certificate.lyapunov_matrix)
    assert all(growth(RULE, P, gap, theta, following, slope) < 1.0 for (gap, theta), (_, following) in pairwise(steps))


def braking(rule: GainAdaptation, max_gap: float, way: float) -> list[tuple[float, float]]:
    """Speed at the balise and gap of trains that brake from it to the slowest speed and keep that; backwards they speed
    up.
    """
    slowest, a = rule.slowest_speed(max_gap), rule.acceleration
    speeds = np.linspace(slowest, np.sqrt(slowest**2 + 2.0 * a * way), 100)
    return [(float(v), float((v - slowest) / a + (way - (v * v - slowest**2) / (2.0 * a)) / slowest)) for v in speeds]


def hardest(rule: GainAdaptation, P: np.ndarray, max_gap: float) -> float:
    """Largest growth over hard braking and hard acceleration, at the corners of spacing, odometer error and drag."""

    def gain(v: float, error: float) -> float:
        return float(np.clip(rule.ratio * v * (1.0 + error) / rule.spacing, rule.theta_min, rule.theta_max))

    slow, found = rule.slowest_speed(max_gap), []
    for way in rule.spacing * (1.0 + rule.spacing_tolerance * np.array([-1.0, 1.0])):
        for error in (-rule.speed_tolerance, rule.speed_tolerance):
            for v, gap in braking(rule, max_gap, float(way)):
                for theta, following in ((gain(v, error), gain(slow, -error)), (gain(slow, -error), gain(v, error))):
                    found += [growth(rule, P, gap, theta, following, slope) for slope in SLOPES]
    return max(found)


@pytest.mark.parametrize("rule", [RULE, WIDE], ids=["narrow", "wide"])
def test_hard_braking_and_hard_acceleration_do_not_contradict_it(rule: GainAdaptation) -> None:
    limit = 0.999 * certify_adapting_gain(rule, 1.0, "model").limit
    P = np.array(certify_adapting_gain(rule, limit, "model").lyapunov_matrix)
    assert 0.5 < hardest(rule, P, limit) < 1.0  # they come near
    assert hardest(rule, P, 1.3 * limit) > 1.0  # and pass it where more is asked


def test_the_bounds_of_speed_times_gap_are_reached_and_no_more() -> None:
    low, high = RULE.expected_share(np.zeros(1), np.full(1, limit()), limit())
    slow = RULE.slowest_speed(limit())
    assert high[0] == pytest.approx(1.05 * max(v * gap / 100.0 for v, gap in braking(RULE, limit(), 105.0)), rel=1e-3)
    assert low[0] == pytest.approx(0.95 * min(slow * gap / 100.0 for _, gap in braking(RULE, limit(), 95.0)), rel=1e-3)
    gap = 4.0  # too short to reach the slowest speed: constant braking, constant acceleration
    low, high = RULE.expected_share(np.full(1, gap), np.full(1, gap), limit())
    assert high[0] == pytest.approx(1.05 * (105.0 + 0.35 * gap**2) / 100.0)
    assert low[0] == pytest.approx(0.95 * (95.0 - 0.35 * gap**2) / 100.0)


def test_the_observer_says_what_it_assumes() -> None:
    certificate = next(AdaptiveGainCdo().findings(10.0, {"assumed_acceleration": 0.5}))
    assert certificate.holds
    assert "acceleration stays within 0.5 m/s2" in certificate.explain()
    assert "balises every 50 m" in certificate.explain()
    assert not next(AdaptiveGainCdo().findings(10.0, {"assumed_acceleration": 1.5})).holds


def test_a_sampled_first_stage_is_evaluated_too() -> None:
    observer = AdaptiveGainCdo(first_stage="multirate")
    assert next(observer.findings(5.0)).holds
    assert "wheel stage" in next(observer.findings(5.0)).explain()
    assert not next(observer.findings(5.0, {"odometer_period": 1.0})).holds

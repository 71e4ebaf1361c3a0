"""Certificates where slopes and weights change within a gap: no sequence of changes may make a certified error grow."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from fmu_observer import OBSERVERS
from fmu_observer.certificates.aperiodic import _common_decrease, certify_sampled_error
from fmu_observer.certificates.gap_findings import DECREASE
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.riccati_error import RiccatiError
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.certificates.switching_error import SwitchingError
from fmu_observer.observers.parameter_values import parameter_values
from fmu_observer.observers.train.takagi_sugeno_cdo import TakagiSugenoCdo
from plant_models.hybrid import Runtime

UNEQUAL = {  # vertex gains between which constant weights are certified up to 1.87 s, and changing ones are not
    "innovation_decay": 4.537,
    "balise_gain_position": [4.537, 6.185],
    "balise_gain_speed": [5.147, 6.282],
    "odometer_gain_speed": [0.527, 2.189],
}
TURN, SPEEDS = 0.15, (51.0, 4.0)  # when in a gap the odometer changes, and between which readings [m/s]


def pair(theta: float, slopes: tuple[float, float], factors: tuple[float, float]) -> tuple[SampledError, SampledError]:
    """Two vertices of a second-order error with different slopes and gains."""
    gains = ((2.0 * theta, theta**2), (2.0 * theta * factors[0], theta**2 * factors[1]))
    first, second = (
        SampledError.of([[0, 1], [0, -s]], gain, 2.0 * theta) for s, gain in zip(slopes, gains, strict=True)
    )
    return first, second


def transition(vertices: tuple[SampledError, ...], instants: list[float], gap: float) -> np.ndarray:
    """Over a gap in which the vertices take turns at `instants`, by SciPy's exponential, shape (n, n)."""
    flow = np.eye(vertices[0].size + 1)
    for i, (begin, end) in enumerate(pairwise([0.0, *sorted(instants), gap])):
        flow = expm(vertices[i % len(vertices)].generator * (end - begin)) @ flow
    return np.asarray((flow @ vertices[0].reset)[:-1, :-1])


@settings(max_examples=25)
@given(
    theta=st.floats(1.0, 10.0),
    slopes=st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 2.0)),
    factors=st.tuples(st.floats(0.6, 1.6), st.floats(0.4, 2.0)),
    share=st.floats(0.05, 1.0),
    turns=st.lists(st.floats(0.0, 1.0), max_size=6),
)
def test_no_changes_within_a_certified_gap_raise_the_lyapunov_function(
    theta: float, slopes: tuple[float, float], factors: tuple[float, float], share: float, turns: list[float]
) -> None:
    vertices = pair(theta, slopes, factors)
    longest = 0.3 / theta
    found = _common_decrease(vertices, longest, switching=True)
    if found.P is None or not found.holds:
        return
    P, gap = found.P, share * longest
    for order in (vertices, vertices[::-1]):
        F = transition(order, [turn * gap for turn in turns], gap)
        assert np.linalg.eigvals(np.linalg.solve(P, F.T @ P @ F)).real.max() < 1.0


@pytest.mark.parametrize("rate", [0.1, 1.0, 2.0])
def test_the_growth_of_a_scalar_error_is_what_can_really_happen(rate: float) -> None:
    """``de/dt = d(t) e``, d within the rate, a sample leaves half: at most ``(exp(2 rate h) - 1) / 4`` of V comes on
    top.
    """
    vertices = [ImpulsiveError.of(np.array([[slope]]), np.array([[0.5]])) for slope in (rate, -rate)]
    gaps = np.linspace(0.05, 1.0, 20)
    found = SwitchingError.between(vertices).growth(np.eye(1), 1.0, gaps) * gaps
    exact = 0.25 * np.expm1(2.0 * rate * gaps)
    assert (found >= exact).all()
    assert (found <= 1.03 * exact).all()


def test_constant_equations_that_stand_up_alone_may_grow_where_they_take_turns() -> None:
    """The case above, found by search: each vertex is stable at every gap up to the limit, their turns within a gap are
    not.
    """
    observer = TakagiSugenoCdo(premise="live")
    gains = observer.unpack_parameters(parameter_values(observer, UNEQUAL, None))
    vertices = tuple(observer._error_at(h, gains) for h in (1.0, 0.0))
    limit = certify_sampled_error(vertices, 1.0, "constant").limit
    growth = max(
        np.abs(np.linalg.eigvals(transition(vertices[::order], [at * limit], 0.999 * limit))).max()
        for at in np.linspace(0.05, 0.95, 19)
        for order in (1, -1)
    )
    assert growth > 1.2
    assert certify_sampled_error(vertices, 1.0, "switching", switching=True).limit < 0.3 * limit


@pytest.mark.parametrize(("premise", "holds"), [("frozen", True), ("live", False), ("estimated", False)])
def test_weights_that_change_within_a_gap_are_certified_as_such(premise: str, holds: bool) -> None:
    certificate = next(TakagiSugenoCdo(premise=premise).findings(1.85, parameters=UNEQUAL))
    assert certificate.holds is holds
    words = "constant over a gap, as frozen ones are" if holds else "changing at any time, by 1.7e+00 1/s"
    assert words in certificate.explain()
    assert "1.6e+00 1/s and 1.1e+00 1/s2 in the balise gains" in certificate.explain() or holds


def test_two_copies_part_where_the_certificate_says_so() -> None:
    """Two copies that differ in their start hear one odometer, which alternates within each gap, and the same
    balises.
    """
    gap, distances = 1.85, []
    one, other = copies = [Runtime(TakagiSugenoCdo(premise="live")) for _ in range(2)]
    for runtime in copies:
        runtime.p[:] = parameter_values(runtime.system, UNEQUAL, None)
        runtime.x[1] = 25.0
        runtime.start(0.0)
    other.x[1] += 0.01
    for k in range(25):
        for end, speed in ((TURN * gap, SPEEDS[0]), (gap, SPEEDS[1])):
            for runtime in copies:
                runtime.u[1] = speed
                runtime.advance(k * gap + end)
        balise = one.x[0]  # the first copy is never corrected: what is left is the error of the other
        for runtime in copies:
            runtime.u[2] = balise
            runtime.trigger("balise")
        distances.append(float(np.abs(other.x[:2] - one.x[:2]).max()))
    assert distances[-1] > 20.0 * distances[3]


def test_shipped_gains_lose_next_to_nothing() -> None:
    """Their slopes differ by some 1e-3 1/s: the bound is of first order in that."""
    frozen, live = (next(TakagiSugenoCdo(premise=premise).findings(0.2)).limit for premise in ("frozen", "live"))
    assert live == pytest.approx(frozen, rel=1e-3)
    at_the_limit = next(OBSERVERS["differentiator_cdo"]().findings(0.5))
    assert at_the_limit.holds
    assert "drag slopes that change within a gap are covered up to 0.4998 s only" in at_the_limit.explain()
    assert "are covered too" in next(OBSERVERS["differentiator_cdo"]().findings(0.49)).explain()


def test_equal_vertices_change_nothing() -> None:
    vertices = pair(4.0, (0.3, 0.3), (1.0, 1.0))
    constant, switching = (certify_sampled_error(vertices, 0.5, "same", switching=s) for s in (False, True))
    assert switching.limit == pytest.approx(constant.limit, rel=1e-3)
    assert switching.numbers[DECREASE] == pytest.approx(constant.numbers[DECREASE], rel=1e-3)


def test_slopes_within_gaps_are_noted_for_observers_of_models() -> None:
    assert (
        "slopes that change within a gap are covered for no gap"
        in next(OBSERVERS["exponential_gain"]().findings(0.3)).explain()
    )


def test_what_cannot_be_evaluated_is_refused() -> None:
    one, other = np.diag([1.0, 0.0]), np.diag([0.5, 0.0])
    flow = np.array([[0.0, -1.0], [0.0, -2.0]])
    with pytest.raises(ValueError, match="share one reset"):
        certify_sampled_error(
            (ImpulsiveError.of(flow, one), ImpulsiveError.of(flow, other)), 0.1, "resets", switching=True
        )
    riccati = RiccatiError.of(np.zeros((1, 1)), np.zeros((1, 1)), np.eye(1), np.eye(1), np.eye(1), (0,))
    with pytest.raises(ValueError, match="flow linearly"):
        certify_sampled_error((riccati,), 0.1, "riccati", switching=True)

"""Law: the end of a search is no result. Each search over a range finds the same in any unit of time and of the states,
or says how far it looked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
import scipy
from test_robust_residual import chapter_5

from fmu_observer.certificates.aperiodic import aperiodic_limit
from fmu_observer.certificates.bounds import largest_gap
from fmu_observer.certificates.fault_cycle import first_crossing, overshoot, smallest_effort
from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.lipschitz_condition import best_thau_bound
from fmu_observer.certificates.printed_bounds.discrete_bounds import centre_of, discrete_bound
from fmu_observer.certificates.printed_bounds.high_gain_theta import binomial_gain, lyapunov_size, theta_from_slopes
from fmu_observer.certificates.printed_bounds.network_bounds import _largest_gain
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.certificates.small_gain import independent_gap_limit
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.design.proposition_4_1 import proposition_design as proposition_4_1
from fmu_observer.design.robust_residual import residual_design as robust_residual
from fmu_observer.design.theorem7 import theorem7_design as theorem7
from fmu_observer.models.known_models import MODELS, find_model, find_takagi_sugeno_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.scaled_slopes import best_scale

TRAIN = find_takagi_sugeno_model("takagi_sugeno_train")
UNITS = [1e-6, 1e-3, 1.0, 1e3, 1e6]
A = np.array([[-1.0, 4.0], [-4.0, -0.5]])
B = np.array([[1.0, 0.5], [0.2, 2.0]])
HELD = ([[0.0, 1.0], [0.0, -0.1]], (2.0, 1.0), 2.0)  # theta = 1, K = (2, 1): a limit of some 4 s


def held(rate: float) -> SampledError:
    """`HELD` in a unit of time in which all of it is `rate` times as fast."""
    drift, gain, decay = HELD
    unit = rate ** np.arange(2)
    return SampledError.of(
        np.asarray(drift) * unit[:, None] / unit * rate, np.asarray(gain) * unit * rate, decay * rate
    )


# name: (found in a unit of time in which all is `rate` times as fast, the power of `rate` that it goes with, how far it
# is looked for)
OF_TIME: dict[str, tuple[Callable[[float], float], int, float]] = {
    "peak of a response": (lambda c: _largest_gain(c * A, c * B), 0, inf),
    "independent gaps": (lambda c: independent_gap_limit(c * A, c * B, c * B, np.zeros((2, 2))), -1, inf),
    "overshoot": (lambda c: overshoot(c * A, 0.5 * c), 0, inf),
    "first crossing": (lambda c: first_crossing(c * A, c * B[:, 0], 1.0, 0.1), -1, inf),
    "smallest effort": (lambda c: smallest_effort(c * A, c * B[:, 0], 0.1), 0, inf),
    "gap of a bound": (lambda c: largest_gap(lambda t: 0.1 + c * t, 0.5), -1, 1e4),
    "first unstable gap": (lambda c: first_unstable_gap([held(c)], 20.0), -1, 20.0),
    "mixtures of gaps": (lambda c: aperiodic_limit((held(c),), 20.0), -1, 20.0),
}


@pytest.mark.parametrize("rate", UNITS)
@pytest.mark.parametrize("what", OF_TIME)
def test_a_search_over_times_has_no_end_of_its_own(what: str, rate: float) -> None:
    find, power, horizon = OF_TIME[what]
    expected = find(1.0) * rate**power
    assert 0.0 < find(1.0) < inf
    width = 1e-6 if horizon == inf else 1e-3  # what is refined to rounding; bisections are 2e-4 wide
    assert find(rate) == (inf if expected > horizon else pytest.approx(expected, rel=width))


WITH_SLOPES = [name for name in MODELS if find_model(name).slopes and len(find_model(name).measurements) == 1]


def in_units(model: ObserverModel, unit: float) -> ObserverModel:
    """The model with its i-th state in units of `unit`^i."""
    sizes = unit ** np.arange(model.order)
    other = lambda M: np.asarray(M) * sizes[None, :] / sizes[:, None]  # noqa: E731
    return replace(model, A=other(model.A), slopes=tuple(map(other, model.slopes)), C=model.C * sizes)


@pytest.mark.parametrize("unit", [1e-4, 1e-2, 1.0, 1e2, 1e4])
@pytest.mark.parametrize("name", WITH_SLOPES)
def test_coordinates_are_sought_in_any_unit_of_the_states(name: str, unit: float) -> None:
    """The condition is one of the error, not of its units; a step of the grid of scales is 6 % wide."""
    model = find_model(name)
    other, sizes = in_units(model, unit), unit ** np.arange(model.order)[:, None]
    poles = -2.0 - 0.25 * np.arange(model.order)
    gain = observer_gain(model.A, model.C, poles, tuple(s.name for s in model.states), name)
    here, there = best_thau_bound(model, gain), best_thau_bound(other, gain / sizes)
    assert there.valid / there.lipschitz == pytest.approx(here.valid / here.lipschitz, rel=0.02)
    T = model.sample_period
    gain = observer_gain(scipy.linalg.expm(centre_of(model) * T), model.C, np.exp(poles * T), (), name)
    near, far = discrete_bound(model, gain, T), discrete_bound(other, gain / sizes, T)
    assert far.bound / far.lipschitz == pytest.approx(near.bound / near.lipschitz, rel=0.05)


def test_the_best_scale_is_sought_beyond_the_grid() -> None:
    grid = np.geomspace(0.1, 100.0, 31)
    for top in (1e-4, 3.0, 2e4):
        assert best_scale(lambda s: 1.0 / (1.0 + abs(np.log(s / top))), A, grid) == pytest.approx(top, rel=0.13)  # noqa: B023
    assert best_scale(lambda s: s / (1.0 + s), A, grid) > 100.0  # tends to 1, and reaches it nowhere
    assert best_scale(lambda _: 1.0, A, grid) == pytest.approx(0.1)


@pytest.mark.parametrize("rate", [1.0, 1e3, 1e6, 1e9])
def test_a_proven_theta_is_found_however_large(rate: float) -> None:
    """All `rate` times as fast, the i-th state in units of rate^i: theta goes with it; a step of the grid is .23 %."""
    model = find_model("pendulum")
    unit = rate ** np.arange(model.order)
    fast = tuple(rate * np.asarray(slope) * unit[:, None] / unit for slope in model.slopes)
    found = theta_from_slopes(replace(model, slopes=fast), binomial_gain(2))
    assert found == pytest.approx(rate * theta_from_slopes(model, binomial_gain(2)), rel=2.4e-3)


@pytest.mark.parametrize(("share", "exists"), [(0.999, True), (1.001, False)])
def test_where_no_theta_is_enough_none_is_found(share: float, exists: bool) -> None:
    """``theta > 2 lmax(P) |s theta|`` holds for all theta or for none."""
    K = binomial_gain(2)
    slope = np.array([[0.0, share / (2.0 * lyapunov_size(K))], [0.0, 0.0]])
    found = theta_from_slopes(replace(find_model("pendulum"), slopes=(slope,)), K)
    assert found == (1.0 if exists else inf)


@pytest.mark.parametrize(
    ("module", "proof", "response", "ask"),
    [
        (theorem7, "_proven", None, lambda: theorem7.design_theorem7(TRAIN, 2.0, 8.0)),
        (proposition_4_1, "margins", {"": -1.0}, lambda: proposition_4_1.design_proposition_4_1(A, B[0], 8.0)),
        (robust_residual, "candidates", (), lambda: robust_residual.design_robust_residual(chapter_5(8.0))),
    ],
)
def test_a_design_that_finds_nothing_says_down_to_what(
    module: Any, proof: str, response: Any, ask: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, proof, lambda *_, **__: response)
    with pytest.raises(ValueError, match=r"down to 0\.008 1/s"):
        ask()

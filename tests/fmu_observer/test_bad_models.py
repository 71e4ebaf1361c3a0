"""Models that cannot be, and pairs that no observer can serve: refused where they are made, in words that name the
fault.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmu_observer import OBSERVERS
from fmu_observer.design.theorem7 import InfeasibleDesign, design_theorem7
from fmu_observer.models.exhibits.inverted_pendulum_on_cart import inverted_pendulum_cart
from fmu_observer.models.known_models import find_model, find_takagi_sugeno_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observability import UnobservableError
from fmu_observer.observers.generic.sampled.takagi_sugeno_gains import TakagiSugenoGains
from plant_models.hybrid import input_signal, state, vector

ANGLE, RATE, TORQUE = state("angle", "rad"), state("rate", "rad/s"), input_signal("torque", "N.m")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "my model"}, "name 'my model' is not a legal identifier"),
        ({"event": "not one"}, "event 'not one' is not a legal identifier"),
        ({"A": "x"}, r"A is not a matrix of numbers, expected shape \(2, 2\)"),
        ({"A": [[1.0, 2.0], [3.0]]}, r"A is not a matrix of numbers, expected shape \(2, 2\)"),
        ({"A": [[0.0, np.nan], [0.0, 0.0]]}, "A must hold finite numbers"),
        ({"C": np.eye(2)}, r"C has shape \(2, 2\), expected \(1, 2\)"),
        ({"C": [[np.inf, 0.0]]}, "C must hold finite numbers"),
        ({"slopes": (np.full((2, 2), np.nan),)}, "a slope must hold finite numbers"),
        ({"slopes": (np.eye(3),)}, r"a slope has shape \(3, 3\), expected \(2, 2\)"),
        ({"states": (ANGLE, ANGLE)}, "more than once among its states: angle"),
        ({"inputs": (input_signal("rate", "1"),)}, "more than once among its states and inputs: rate"),
        ({"states": (ANGLE, TORQUE)}, r"'torque' in states must be a scalar made by state\("),
        ({"states": (state("both", "1", size=2), RATE)}, r"'both' in states must be a scalar made by state\("),
        ({"measurements": ("angle",)}, r"measurements holds 'angle', expected signals made by input_signal\("),
        ({"measurements": (), "C": np.zeros((0, 2))}, "it has no measurements, expected at least one"),
        ({"sample_period": 0.0}, "sample_period must be finite and positive, got 0.0"),
        ({"sample_period": "0.1"}, "sample_period must be finite and positive, got '0.1'"),
        ({"lipschitz": -1.0}, "lipschitz must be finite and not negative, got -1.0"),
        ({"phi": lambda x, _u: vector(x[0])}, r"phi\(x, u\) returns shape \(1,\), expected \(2,\)"),
        ({"phi": lambda _x, _u: None}, r"phi\(x, u\) returns shape \(\), expected \(2,\)"),
        ({"H": np.ones((2, 1))}, r"H has shape \(2, 1\), expected \(2, 0\) for 2 states and 0 unknown inputs"),
        (
            {"unknown_inputs": (input_signal("wind", "N"),)},
            r"H has shape \(2, 0\), expected \(2, 1\) for 2 states and 1 unknown",
        ),
        (
            {"unknown_inputs": (input_signal("rate", "1"),), "H": np.ones((2, 1))},
            "states, inputs and unknown inputs: rate",
        ),
        ({"phi": 3}, r"phi\(x, u\) fails at the start values: 'int' object is not callable"),
    ],
)
def test_an_observer_model_that_cannot_be(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(find_model("pendulum"), **changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "my model"}, "name 'my model' is not a legal identifier"),
        ({"A": np.full((2, 2, 2), np.nan)}, "A must hold finite numbers"),
        ({"inputs": (input_signal("rate", "1"),)}, "more than once among its states and inputs: rate"),
        ({"max_gap": 0.0}, "max_gap must be finite and positive"),
        ({"scaling": (1.0, np.nan)}, "must be 2 positive numbers"),
    ],
)
def test_a_takagi_sugeno_model_that_cannot_be(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(find_takagi_sugeno_model("pendulum"), **changes)


# -- what cannot be observed
# --------------------------------------------------------------------------------------------

DRIFTING = np.array([[0.0, 0.0], [0.0, 0.3]])  # the rate grows and the angle does not show it


def drifting() -> ObserverModel:
    return replace(find_model("linear_pendulum"), A=DRIFTING)


@pytest.mark.parametrize(
    "name",
    [
        "luenberger",
        "thau",
        "riccati_high_gain",
        "discrete_luenberger",
        "kalman_filter",
        "extended_luenberger",
        "extended_kalman_filter",
    ],
)
def test_every_observer_of_a_model_names_the_mode_it_cannot_see(name: str) -> None:
    with pytest.raises(UnobservableError, match=r"linear_pendulum: .*eigenvalue 0.3 1/s \(grows .*rate \(1\)"):
        OBSERVERS[name](model=drifting())


@pytest.mark.parametrize(
    "name",
    [
        "high_gain",
        "exponential_gain",
        "output_predictor",
        "held_innovation",
        "hybrid_impulsive",
        "decaying_innovation",
        "dynamic_high_gain",
    ],
)
def test_observers_of_a_chain_refuse_what_is_none(name: str) -> None:
    """A chain of integrators measured at its head is observable, so nothing else needs asking."""
    with pytest.raises(ValueError, match=r"shift matrix"):
        OBSERVERS[name](model=drifting())


def test_the_multirate_observer_names_the_mode_it_cannot_see() -> None:
    cart = inverted_pendulum_cart()
    A = cart.A.copy()
    A[1:, 0], A[0, 1:] = 0.0, 0.0
    with pytest.raises(UnobservableError, match=rf"in the states {cart.states[0].name} \(1\)"):
        OBSERVERS["multirate_sylvester"](model=replace(cart, A=A))


@pytest.mark.parametrize(
    "name",
    ["takagi_sugeno_luenberger", "takagi_sugeno_periodic", "takagi_sugeno_aperiodic", "general_takagi_sugeno_cdo"],
)
def test_every_takagi_sugeno_observer_names_the_mode_it_cannot_see(name: str) -> None:
    blind = replace(find_takagi_sugeno_model("pendulum"), A=np.stack([DRIFTING, DRIFTING]))
    with pytest.raises(UnobservableError, match=r"eigenvalue 0.3 1/s \(grows .*rate \(1\)"):
        OBSERVERS[name](model=blind)


def test_theorem_7_names_the_mode_where_no_gain_can_exist() -> None:
    blind = replace(find_takagi_sugeno_model("pendulum"), A=np.stack([DRIFTING, DRIFTING]))
    with pytest.raises(UnobservableError, match=r"Theorem 7 of pendulum, vertex 1: .*eigenvalue 0.3 1/s .*rate \(1\)"):
        design_theorem7(blind, gap=0.1, eta=0.5, performance=False)
    with pytest.raises(InfeasibleDesign, match="Nearest found feasible"):  # observable: the gap is what is too long
        design_theorem7("pendulum", gap=2.0, eta=3.0, performance=False)


# -- gains ------------------------------------------------------------------------------------------------------------

GAIN = np.ones((2, 2, 1))


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        (TakagiSugenoGains(-1.0, GAIN), "eta must be finite and not negative, got -1.0"),
        (TakagiSugenoGains(float("nan"), GAIN), "eta must be finite and not negative, got nan"),
        (TakagiSugenoGains(1.0, np.ones((2, 3, 1))), r"sampled_gain .* has shape \(2, 3, 1\), expected .* \(2, 2, 1\)"),
        (TakagiSugenoGains(1.0, np.nan * GAIN), r"sampled_gain .* has numbers that are not finite"),
        (TakagiSugenoGains(1.0, "none"), r"sampled_gain .* has numbers that are not finite, expected .* \(2, 2, 1\)"),
        ((1.0, GAIN), r"gains must be TakagiSugenoGains\(eta, sampled, continuous\)"),
    ],
)
def test_gains_that_cannot_be(gains: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        OBSERVERS["general_takagi_sugeno_cdo"]("pendulum", gains=gains)  # type: ignore[call-arg]


@pytest.mark.parametrize("gains", [(GAIN,), (np.nan * GAIN, np.zeros((2, 2, 0)))])
def test_gains_that_theorem_7_cannot_analyse(gains: Any) -> None:
    with pytest.raises(
        ValueError, match=r"Theorem 7: (gains must be a pair|the sampled gain must hold finite numbers)"
    ):
        design_theorem7("pendulum", 0.1, 0.5, gains=gains, performance=False)


# -- options
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "option"),
    [
        *((name, "order") for name in ("levant_differentiator", "filtering_differentiator", "implicit_differentiator")),
        *((name, "filtering_order") for name in ("filtering_differentiator", "implicit_differentiator")),
        ("multirate_sylvester", "continuous"),
    ],
)
@pytest.mark.parametrize("value", ["two", 1.5, None, True, [1]])
def test_a_number_of_something_is_a_whole_number(name: str, option: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"{option} must be a whole number, got"):
        OBSERVERS[name](**{option: value})


@pytest.mark.parametrize("model", [["pendulum"], None, 3])
@pytest.mark.parametrize("name", ["luenberger", "exponential_gain", "takagi_sugeno_periodic", "multirate_sylvester"])
def test_a_model_that_is_none_is_refused(name: str, model: Any) -> None:
    with pytest.raises(ValueError, match=r"[Uu]nknown .*model .*known are: "):
        OBSERVERS[name](model=model)

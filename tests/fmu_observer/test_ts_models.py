"""Takagi-Sugeno models: exact inside the bounds of their premises, the nearest corner beyond, and bad input in
words.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer.models.exhibits.four_state_example import triangularisable_chain, triangularisable_example
from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.models.known_models import TAKAGI_SUGENO_MODELS, find_takagi_sugeno_model
from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise
from plant_models.exhibits import NonTriangularisablePlant, TriangularisablePlant
from plant_models.hybrid import HybridSystem, input_signal, state

ROUNDING = 1e-12  # relative: sums of a handful of products
numbers = st.floats(-1.0, 1.0)


def plant_flow(plant: HybridSystem, x: np.ndarray, drive: float) -> np.ndarray:
    """Derivatives at time zero, where the printed drives vanish, so that `drive` is all of u."""
    return np.asarray(plant.state_derivative(0.0, x, np.array([drive]), plant.start_parameters()))


@pytest.mark.parametrize(
    ("name", "make", "size"),
    [
        ("triangularisable_example", TriangularisablePlant, 4),
        ("non_triangularisable_example", NonTriangularisablePlant, 5),
    ],
)
@settings(max_examples=40, deadline=None)
@given(values=st.lists(numbers, min_size=6, max_size=6))
def test_the_blend_is_the_plant_inside_the_bounds(name: str, make: Any, size: int, values: list[float]) -> None:
    model, x, u = find_takagi_sugeno_model(name), np.array(values[:size]), np.array(values[5:])
    assert float(model.outside(model.premise_values(x, u))) == 0.0
    np.testing.assert_allclose(model.flow(x, u), plant_flow(make(), x, values[5]), rtol=ROUNDING, atol=1e-11)


@settings(max_examples=40, deadline=None)
@given(angle=st.floats(-30.0, 30.0), rate=st.floats(-5.0, 5.0), torque=numbers)
def test_the_pendulum_is_exact_at_every_angle(angle: float, rate: float, torque: float) -> None:
    x, u = np.array([angle, rate]), np.array([torque])
    np.testing.assert_allclose(
        find_takagi_sugeno_model("pendulum").flow(x, u), pendulum().flow(x, u), rtol=1e-9, atol=1e-12
    )


def test_the_chain_of_the_first_example_is_an_equal_plant() -> None:
    generator = np.random.default_rng(4)
    for _ in range(20):
        x, u = generator.normal(size=4), generator.normal(size=1)
        expected = plant_flow(TriangularisablePlant(), x, float(u[0]))
        np.testing.assert_allclose(triangularisable_chain().flow(x, u), expected, rtol=ROUNDING, atol=1e-12)


@pytest.mark.parametrize("name", TAKAGI_SUGENO_MODELS)
@settings(max_examples=40, deadline=None)
@given(shares=st.lists(st.floats(-0.5, 1.5), min_size=2, max_size=2))
def test_weights_are_a_partition_and_pick_the_nearest_point(name: str, shares: list[float]) -> None:
    model = find_takagi_sugeno_model(name)
    values = tuple(p.low + share * (p.high - p.low) for p, share in zip(model.premises, shares, strict=False))
    h = np.array(model.weights(values))
    assert np.all((h >= 0.0) & (h <= 1.0))
    assert h.sum() == pytest.approx(1.0, abs=ROUNDING)
    nearest = [np.clip(v, p.low, p.high) for p, v in zip(model.premises, values, strict=True)]
    np.testing.assert_allclose(h @ [model.corner(i) for i in range(model.vertices)], nearest, rtol=0.0, atol=1e-10)
    beyond = any(abs(v - n) > 1e-6 for v, n in zip(values, nearest, strict=True))
    assert float(model.outside(values)) == float(beyond) or not beyond


def test_vertices_are_those_of_the_thesis() -> None:
    first, second = (find_takagi_sugeno_model(n) for n in ("triangularisable_example", "non_triangularisable_example"))
    np.testing.assert_allclose(first.A[:, 3, 3], [16.5, -16.5], rtol=ROUNDING)
    np.testing.assert_array_equal(second.A[:, 2, 4], [0.0, -1.0, 0.0, -1.0])  # h1 .. h4: a = 0, 1, 0, 1
    np.testing.assert_array_equal(second.A[:, 3, 1], [1.0, 1.0, -2.0, -2.0])  # and x1 = -1, -1, 2, 2
    np.testing.assert_array_equal(second.B[:, 3, 0], [0.0, -0.3, 0.0, -0.3])


def test_premises_are_read_from_the_state_that_agrees_with_the_measurements() -> None:
    model = triangularisable_example()
    x = np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(model.informed(x, np.array([7.0]), np.array([8.0])), [7.0, 8.0, 3.0, 4.0])
    np.testing.assert_allclose(model.informed(x, None, np.array([8.0])), [1.0, 8.0, 3.0, 4.0])
    np.testing.assert_array_equal(model.informed(x), x)
    assert model.unmeasured == ()


def test_a_premise_that_measurements_do_not_give_is_named() -> None:
    hidden = Premise("hidden", "1", -1.0, 1.0, lambda x, _u: x[3])
    assert replace(triangularisable_example(), premises=(hidden,)).unmeasured == ("hidden",)


def own_model(**changes: Any) -> Any:
    arguments: dict[str, Any] = {
        "premises": (Premise("speed", "m/s", 0.0, 2.0, lambda x, _u: x[0]),),
        "A": lambda f: [[-f[0]]],
        "B": lambda _f: [[1.0]],
        "name": "own",
        "description": "own",
        "source": "tests",
        "states": (state("v", "m/s"),),
        "inputs": (input_signal("a", "m/s2"),),
        "sampled": (input_signal("v", "m/s"),),
        "continuous": (),
        "C_sampled": np.eye(1),
        "C_continuous": np.zeros((0, 1)),
    }
    return sector_nonlinearity(**(arguments | changes))


def test_a_model_of_ones_own() -> None:
    model = own_model()
    np.testing.assert_allclose(model.flow(np.array([1.5]), np.array([0.25])), [-(1.5**2) + 0.25], rtol=ROUNDING)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": lambda f: [[-(f[0] ** 2)]]}, "A is not affine in premise 'speed'"),
        ({"B": lambda f: [[np.sin(f[0])]]}, "B is not affine in premise 'speed'"),
        ({"premises": ()}, "at least one premise"),
        ({"C_sampled": np.eye(2)}, r"C_sampled has shape \(2, 2\), expected \(1, 1\)"),
        ({"B": lambda _f: [[1.0, 2.0]]}, r"B has shape \(2, 1, 2\), expected \(2, 1, 1\)"),
        ({"scaling": (1.0, 2.0)}, "must be 1 positive numbers"),
    ],
    ids=["A", "B", "premises", "C", "inputs", "scaling"],
)
def test_models_that_cannot_be_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        own_model(**changes)


@pytest.mark.parametrize("bounds", [(1.0, 1.0), (2.0, 1.0), (0.0, np.inf), (np.nan, 1.0)])
def test_bounds_must_be_finite_and_in_order(bounds: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="Premise 'f': bounds"):
        Premise("f", "1", *bounds, lambda x, _u: x[0])


def test_an_unknown_model_is_named_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="Unknown Takagi-Sugeno model 'nothing'; known are: triangularisable_example"):
        find_takagi_sugeno_model("nothing")

"""Signals by name: from the flat array to names and shapes and back, whatever is declared, alone and in batches."""

from __future__ import annotations

from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, Signal, memory, output_signal, parameter, state
from plant_models.hybrid.requirements import unfulfilled
from plant_models.hybrid.signal import within_bounds
from plant_models.hybrid.signal_layout import SignalLayout
from plant_models.hybrid.tracing import TracedSystem

PLACES = st.sampled_from(["scalar", "vector", "matrix", "symmetric"])


def declared(number: int, kind: str, n: int, m: int) -> Signal:
    name = f"s{number}"
    if kind == "scalar":
        return state(name, "1")
    if kind == "vector":
        return state(name, "1", size=n)
    return state(name, "1", shape=(n, n if kind == "symmetric" else m), symmetric=kind == "symmetric")


@st.composite
def layouts(draw: st.DrawFn) -> SignalLayout:
    kinds = draw(st.lists(st.tuples(PLACES, st.integers(1, 4), st.integers(1, 4)), min_size=1, max_size=6))
    return SignalLayout([declared(k, *kind) for k, kind in enumerate(kinds)])


@given(layouts(), st.sampled_from([(), (1,), (3,)]), st.integers(0, 2**32 - 1))
def test_what_is_named_and_flattened_again_is_equal(layout: SignalLayout, members: Any, seed: int) -> None:
    flat = np.random.default_rng(seed).standard_normal((layout.width, *members))
    named = layout.named(flat)
    for signal, value in zip(layout.signals, named, strict=True):
        assert np.shape(value) == (*signal.dimensions, *members)
        if signal.symmetric:
            np.testing.assert_array_equal(value, np.swapaxes(value, 0, 1))
    np.testing.assert_array_equal(layout.flat(named._asdict(), "it", members), flat)
    entries = [entry for signal, value in zip(layout.signals, named, strict=True) for entry in signal.entries(value)]
    np.testing.assert_array_equal(entries, flat)


@given(layouts(), st.sampled_from([(), (3,)]), st.data())
def test_what_is_not_named_is_kept(layout: SignalLayout, members: Any, data: st.DataObject) -> None:
    before = np.arange(float(layout.width * 3))[: layout.width * (members or (1,))[0]].reshape(layout.width, *members)
    changed = data.draw(st.sets(st.sampled_from([s.name for s in layout.signals])))
    values = {name: np.full(getattr(layout.named(before), name).shape, -1.0) for name in changed}
    after = layout.flat(values, "it", members, before)
    for signal, old, new in zip(layout.signals, layout.named(before), layout.named(after), strict=True):
        np.testing.assert_array_equal(new, np.full_like(old, -1.0) if signal.name in changed else old)


@given(layouts(), st.integers(0, 2**32 - 1))
def test_symbols_are_laid_out_as_numbers_are(layout: SignalLayout, seed: int) -> None:
    flat = np.random.default_rng(seed).standard_normal(layout.width)
    symbols = ca.ArrayInterface.SX(ca.SX.sym("x", layout.width), shape=(layout.width,))
    doubled = layout.flat({name: 2.0 * value for name, value in layout.named(symbols)._asdict().items()}, "it")
    function = ca.Function("doubled", [ca.SX(symbols)], [ca.SX(doubled)])
    np.testing.assert_array_equal(function(flat).full().ravel(), 2.0 * flat)


@pytest.mark.parametrize("members", [(), (4,)])
def test_of_no_states_nothing_is_left(members: tuple[int, ...]) -> None:
    assert SignalLayout(()).flat({}, "flow()", members).shape == (0, *members)


def test_a_constant_is_equal_for_all_members() -> None:
    layout = SignalLayout([state("a", "1"), state("b", "1", size=2), state("c", "1")])
    flat = layout.flat({"a": np.array([1.0, 2.0]), "b": np.array([[3.0, 3.0], [4.0, 4.0]]), "c": 5.0}, "it", (2,))
    np.testing.assert_array_equal(flat, [[1.0, 2.0], [3.0, 3.0], [4.0, 4.0], [5.0, 5.0]])


def test_the_upper_triangle_is_what_is_known_outside() -> None:
    covariance = memory("covariance", "1", np.diag([1.0, 2.0, 3.0]), shape=(3, 3), symmetric=True)
    assert covariance.scalar_names == tuple(f"covariance[{k}]" for k in range(1, 7))
    assert covariance.start_values == (1.0, 0.0, 0.0, 2.0, 0.0, 3.0)  # row by row


class Weighted(HybridSystem):
    """Parameters that are matrices."""

    name = "weighted"
    outputs = (output_signal("y", "1"),)
    parameters = (
        parameter("gain", "1/s", 2.0),
        parameter("weight", "1", (1.0, 0.5, 3.0), shape=(2, 2), symmetric=True, min=0.0),
        parameter("rows", "1", np.arange(6.0).reshape(2, 3), shape=(2, 3)),
    )
    presets: ClassVar[Any] = {"other": {"weight": (4.0, 5.0, 6.0)}}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"y": p.gain * (p.weight @ p.rows)[1, 2]}

    def requirements(self, p: Any) -> dict[str, Array]:
        return within_bounds(self.parameters, p)


def test_a_parameter_is_a_matrix_to_equations_and_a_vector_outside() -> None:
    system = Weighted()
    names = [name for signal in system.parameters for name in signal.scalar_names]
    assert names == ["gain", *(f"weight[{k}]" for k in (1, 2, 3)), *(f"rows[{k}]" for k in range(1, 7))]
    values = system.start_parameters()
    np.testing.assert_array_equal(values[:-1], [2.0, 1.0, 0.5, 3.0, *range(6)])
    p = system.unpack_parameters(values)
    np.testing.assert_array_equal(p.weight, [[1.0, 0.5], [0.5, 3.0]])
    np.testing.assert_array_equal(p.rows, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    other = system.unpack_parameters(system.start_parameters("other"))
    np.testing.assert_array_equal(other.weight, [[4.0, 5.0], [5.0, 6.0]])
    traced = TracedSystem(system)
    x, u = system.start_state(), system.start_inputs()
    assert float(traced.output(0.0, x, u, values)) == system.output_vector(0.0, x, u, values)[0] == 32.0
    values[3] = -1.0
    assert unfulfilled(system, values).startswith("weight[3] must be a finite number, at least 0")
    with pytest.raises(ValueError, match="only a state or parameter is a matrix"):
        Signal("drive", "1", "input", start=(0.0,) * 4, size=4, shape=(2, 2))


class Counted(HybridSystem):
    """A clock of matrices, for what its functions may return wrongly."""

    name = "counted"
    states = (
        state("level", "1", 1.0),
        memory("count", "1"),
        memory("spread", "1", np.eye(2), shape=(2, 2), symmetric=True),
    )
    outputs = (output_signal("y", "1"),)
    parameters = (parameter("period", "s", 1.0),)
    events = (PeriodicEvent("tick", "period"),)
    rates: ClassVar[Any] = None
    changes: ClassVar[Any] = None

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> Any:
        return {"level": -x.level} if self.rates is None else self.rates

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> Any:
        return {"spread": x.spread @ x.spread + np.ones((2, 2))} if self.changes is None else self.changes

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"y": x.spread[0, 1]}


def test_a_jump_names_only_what_it_changes() -> None:
    system = Counted()
    x = system.start_state()
    after = system.jump_vector("tick", 0.0, x, system.start_inputs(), system.start_parameters())
    np.testing.assert_array_equal(after, [1.0, 0.0, 2.0, 1.0, 2.0])
    traced = TracedSystem(system).jump("tick")(0.0, x, system.start_inputs(), system.start_parameters())
    np.testing.assert_array_equal(traced.full().ravel(), after)


@pytest.mark.parametrize(
    ("rates", "changes", "words"),
    [
        (np.zeros(1), None, r"counted: flow\(\) returns a ndarray; expected a dictionary of values by name"),
        ({}, None, r"counted: flow\(\) leaves out level"),
        ({"level": 0.0, "count": 0.0}, None, r"flow\(\) returns 'count', which is no state of its kind"),
        ({"level": np.zeros(2)}, None, r"flow\(\) returns 'level' of shape \(2,\); expected one number"),
        (None, {"cuont": 1.0}, r"jump\('tick'\) returns 'cuont', .*did you mean 'count'"),
        (None, {"spread": np.zeros(4)}, r"'spread' of shape \(4,\); expected shape \(2, 2\)"),
        (None, None, ""),
    ],
)
def test_what_is_returned_wrongly_is_named(rates: Any, changes: Any, words: str) -> None:
    system = type("Wrong", (Counted,), {"rates": rates, "changes": changes})()
    u, p = system.start_inputs(), system.start_parameters()
    x = system.start_state()

    def both() -> None:
        system.state_derivative(0.0, x, u, p)
        system.jump_vector("tick", 0.0, x, u, p)

    if not words:
        both()
        return
    with pytest.raises((TypeError, ValueError), match=words):
        both()


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"symmetric": True}, r"symmetric; give its shape \(n, n\)"),
        ({"shape": (2, 3), "symmetric": True}, "expected a square shape"),
        ({"shape": (2, 3), "symmetric": True, "start": (1.0, 2.0, 3.0)}, "expected a square shape"),
        ({"shape": (2, 2), "symmetric": True, "start": np.array([[0.0, 1.0], [0.0, 0.0]])}, "symmetric; expected"),
    ],
)
def test_a_shape_that_cannot_be_is_refused(how: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        memory("covariance", "1", **how)

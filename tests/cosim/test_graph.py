"""Order of stepping and algebraic loops, on mocks with declared feedthrough."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mock_slaves import Mock, component

from cosim.coupling.connection import connect
from cosim.coupling.graph import declared_feedthrough, execution_order, undeclared
from cosim.errors import CouplingError


class State(Mock):
    """Output from a state: no feedthrough."""

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}


class Direct(State):
    feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}


def order(slaves: dict[str, Mock], pairs: list[tuple[str, str]], before: Any = ()) -> list[str]:
    components = {n: component(s, n) for n, s in slaves.items()}
    return execution_order(components, connect([(f"{a}.y", f"{b}.u") for a, b in pairs], components), before)


def test_a_source_comes_before_its_targets() -> None:
    slaves = {"c": Direct(), "b": State(), "a": State()}
    assert order(slaves, [("a", "b"), ("b", "c")]) == ["a", "b", "c"]


def test_in_a_loop_the_first_listed_comes_first_and_direct_inputs_are_fresh() -> None:
    plant, controller, sensor = State(), Direct(), Direct()
    loop = [("plant", "sensor"), ("sensor", "controller"), ("controller", "plant")]
    assert order({"plant": plant, "controller": controller, "sensor": sensor}, loop) == ["plant", "sensor", "controller"]


def test_further_pairs_hold_even_where_they_contradict_feedthrough() -> None:
    """Plant before observer, although the observer's output acts directly on an output of the plant that is passed on."""
    slaves = {"observer": State(), "plant": Direct()}
    pairs = [("observer", "plant"), ("plant", "observer")]
    assert order(slaves, pairs) == ["observer", "plant"]
    assert order(slaves, pairs, [("plant", "observer")]) == ["plant", "observer"]
    with pytest.raises(CouplingError, match="observer before plant, plant before observer"):
        order(slaves, pairs, [("plant", "observer"), ("observer", "plant")])


def test_an_algebraic_loop_is_named_with_its_signals() -> None:
    slaves = {"a": Direct(), "b": Direct(), "c": State(), "d": Direct()}
    with pytest.raises(CouplingError) as error:
        order(slaves, [("a", "b"), ("b", "a"), ("a", "c"), ("c", "d")])
    text = str(error.value)
    assert "Algebraic loop" in text
    for name in ("a.u", "a.y", "b.u", "b.y"):
        assert name in text
    assert "c." not in text
    assert "d." not in text


def test_a_direct_output_on_its_own_input_is_a_loop() -> None:
    with pytest.raises(CouplingError, match=r"a\.u -> a\.y -> a\.u|a\.y -> a\.u -> a\.y"):
        order({"a": Direct()}, [("a", "a")])
    assert order({"a": State()}, [("a", "a")]) == ["a"]


def test_declared_feedthrough_and_silence() -> None:
    direct, silent = component(Direct(), "direct"), component(State(), "silent")
    for unknown in silent.description.outputs:
        unknown.dependencies = None
    assert declared_feedthrough(direct) == {"y": ["u"]}
    assert declared_feedthrough(silent) == {}
    assert undeclared([direct, silent]) == ["silent"]


@given(st.integers(1, 7).flatmap(lambda n: st.tuples(st.just(n), st.permutations(range(n)), st.sets(st.integers(0, n * n - 1)))))
def test_acyclic_graphs_are_ordered_whatever_the_listing(case: tuple[int, list[int], set[int]]) -> None:
    n, listing, chosen = case

    class Many(Mock):
        inputs: ClassVar[dict[str, Any]] = {f"u{i}": 0.0 for i in range(n)}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"y": [f"u{i}" for i in range(n)]}

    edges = [(k // n, k % n) for k in sorted(chosen) if k // n < k % n]
    components = {f"c{i}": component(Many(), f"c{i}") for i in listing}
    connections = connect([(f"c{a}.y", f"c{b}.u{a}") for a, b in edges], components)
    found = execution_order(components, connections)
    assert sorted(found) == sorted(components)
    assert all(found.index(f"c{a}") < found.index(f"c{b}") for a, b in edges)

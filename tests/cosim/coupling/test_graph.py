"""Order of stepping, groups and algebraic loops, on mocks with declared feedthrough."""

from __future__ import annotations

from itertools import pairwise, permutations
from typing import Any, ClassVar

import pytest
from coupled_runs import execution_order
from hypothesis import given
from hypothesis import strategies as st
from mock_slaves import Mock, component

from cosim.coupling.connection import connect
from cosim.coupling.graph import Group, declared_feedthrough, execution_groups, undeclared
from cosim.coupling.ordering import OrderedSignal, in_order, satisfied
from cosim.coupling.strong import closed_path, strong_groups, topological
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


def test_in_a_loop_direct_inputs_are_fresh_whatever_the_listing() -> None:
    slaves = {"plant": State(), "controller": Direct(), "sensor": Direct()}
    loop = [("plant", "sensor"), ("sensor", "controller"), ("controller", "plant")]
    for names in permutations(slaves):
        assert order({name: slaves[name] for name in names}, loop) == ["plant", "sensor", "controller"]


def test_further_pairs_hold_even_where_they_contradict_feedthrough() -> None:
    """Plant before observer, although the observer's output acts directly on an output of the plant that is passed
    on.
    """
    slaves = {"observer": State(), "plant": Direct()}
    pairs = [("observer", "plant"), ("plant", "observer")]
    assert order(slaves, pairs) == ["observer", "plant"]
    assert order(slaves, pairs, [("plant", "observer")]) == ["plant", "observer"]
    with pytest.raises(CouplingError, match="observer before plant, plant before observer"):
        order(slaves, pairs, [("plant", "observer"), ("observer", "plant")])


def loops(slaves: dict[str, Mock], pairs: list[tuple[str, str]]) -> list[str]:
    """The algebraic loops in words."""
    components = {name: component(slave, name) for name, slave in slaves.items()}
    groups = execution_groups(components, connect([(f"{a}.y", f"{b}.u") for a, b in pairs], components))
    return [str(loop) for group in groups for loop in group.algebraic]


def test_an_algebraic_loop_is_named_with_its_signals() -> None:
    slaves = {"a": Direct(), "b": Direct(), "c": State(), "d": Direct()}
    (text,) = loops(slaves, [("a", "b"), ("b", "a"), ("a", "c"), ("c", "d")])
    for name in ("a.u", "a.y", "b.u", "b.y"):
        assert name in text
    assert "c." not in text
    assert "d." not in text


def test_a_direct_output_on_its_own_input_is_a_loop() -> None:
    assert loops({"a": Direct()}, [("a", "a")]) in (["a.u -> a.y -> a.u"], ["a.y -> a.u -> a.y"])
    assert loops({"a": State()}, [("a", "a")]) == []


def test_declared_feedthrough_and_silence() -> None:
    direct, silent = component(Direct(), "direct"), component(State(), "silent")
    for unknown in silent.description.outputs:
        unknown.dependencies = None
    assert declared_feedthrough(direct) == {"y": ["u"]}
    assert declared_feedthrough(silent) == {}
    assert undeclared([direct, silent]) == ["silent"]


@given(
    st.integers(1, 7).flatmap(
        lambda n: st.tuples(st.just(n), st.permutations(range(n)), st.sets(st.integers(0, n * n - 1)))
    )
)
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


# -- groups
# -------------------------------------------------------------------------------------------------------------


class Silent(State):
    """Says nothing of what its output depends on."""

    def __init__(self) -> None:
        super().__init__()
        for unknown in self.model_description.outputs:
            unknown.dependencies = None


class TwoWays(Mock):
    """Two inputs and two outputs, each output straight from its own input."""

    inputs: ClassVar[dict[str, Any]] = {"u1": 0.0, "u2": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y1": 0.0, "y2": 0.0}
    feedthrough: ClassVar[dict[str, Any]] = {"y1": ["u1"], "y2": ["u2"]}


def groups(slaves: dict[str, Mock], pairs: list[tuple[str, str]], before: Any = ()) -> list[Group]:
    components = {n: component(s, n) for n, s in slaves.items()}
    named = [(a if "." in a else f"{a}.y", b if "." in b else f"{b}.u") for a, b in pairs]
    return execution_groups(components, connect(named, components), before)


def test_groups_are_what_hangs_together() -> None:
    slaves: dict[str, Mock] = {n: State() for n in "acdef"} | {"b": TwoWays()}
    pairs = [("f", "a"), ("a", "b.u1"), ("b.y1", "c"), ("c", "d"), ("d", "b.u2"), ("e", "e")]
    found = groups(slaves, pairs)
    assert [(g.names, g.loop) for g in found] == [
        (("e",), True),
        (("f",), False),
        (("a",), False),
        (("b", "c", "d"), True),
    ]
    assert all(g.algebraic == g.knots == g.possible == () for g in found)


def test_the_components_of_an_algebraic_loop_stand_together_in_their_group() -> None:
    """plant -> (first <-> second) -> actor -> plant: one group, in it one knot, found although listed apart."""
    slaves = {"plant": State(), "first": TwoWays(), "actor": Direct(), "second": Direct()}
    pairs = [
        ("plant", "first.u1"),
        ("first.y2", "second"),
        ("second", "first.u2"),
        ("first.y1", "actor"),
        ("actor", "plant"),
    ]
    (group,) = groups(slaves, pairs)
    assert group.names == ("plant", "first", "second", "actor")
    assert group.knots == (("first", "second"),)
    assert [str(loop) for loop in group.algebraic] == ["first.u2 -> first.y2 -> second.u -> second.y -> first.u2"]


def test_two_ways_through_two_components_are_no_algebraic_loop() -> None:
    """a.y1 -> b.u1 -> b.y1 -> a.u2 -> a.y2 ends there, since y1 does not depend on u2."""
    (group,) = groups({"a": TwoWays(), "b": TwoWays()}, [("a.y1", "b.u1"), ("b.y1", "a.u2"), ("a.y2", "b.u2")])
    assert group.loop
    assert group.algebraic == ()


def test_loops_that_share_a_component_are_one_knot() -> None:
    slaves = {"a": Direct(), "hub": TwoWays(), "b": Direct()}
    (group,) = groups(slaves, [("a", "hub.u1"), ("hub.y1", "a"), ("b", "hub.u2"), ("hub.y2", "b")])
    assert group.knots == (("a", "hub", "b"),)
    assert [loop.components for loop in group.algebraic] == [("a", "hub"), ("b", "hub")]


def test_what_is_not_declared_decides_the_order_and_makes_a_possible_loop_only() -> None:
    """By the standard a silent output may depend on every input; a declared state in between would be no loop at
    all.
    """
    (group,) = groups({"silent": Silent(), "direct": Direct()}, [("silent", "direct"), ("direct", "silent")])
    assert group.algebraic == ()
    assert [str(loop) for loop in group.possible] == ["direct.u -> direct.y -> silent.u -> silent.y -> direct.u"]
    (group,) = groups({"silent": Silent(), "held": State()}, [("silent", "held"), ("held", "silent")])
    assert group.possible == ()
    assert group.names == ("held", "silent")  # the silent one last: its output may need the newest input
    (group,) = groups({"first": State(), "held": State()}, [("first", "held"), ("held", "first")])
    assert group.names == ("first", "held")  # nothing tells them apart but their names


def test_what_is_declared_beats_what_is_only_possible() -> None:
    slaves = {"silent": Silent(), "direct": Direct(), "held": State()}
    (group,) = groups(slaves, [("silent", "direct"), ("direct", "held"), ("held", "silent")])
    assert group.names == ("held", "silent", "direct")
    (group,) = groups({"direct": Direct(), "silent": Silent()}, [("silent", "direct"), ("direct", "silent")])
    assert group.names == ("silent", "direct")  # the declared input is fresh, although listed otherwise


def test_where_a_loop_is_declared_no_larger_one_is_called_possible() -> None:
    """a.y1 and b in a declared loop; a silent one round them adds nothing that the user must be told."""
    slaves = {"a": TwoWays(), "b": Direct(), "silent": Silent()}
    (group,) = groups(slaves, [("a.y1", "b"), ("b", "a.u1"), ("a.y2", "silent"), ("silent", "a.u2")])
    assert [loop.components for loop in group.algebraic] == [("a", "b")]
    assert [loop.components for loop in group.possible] == [("a", "silent")]

    class Both(TwoWays):
        feedthrough: ClassVar[dict[str, Any]] = {"y1": ["u1", "u2"], "y2": ["u1", "u2"]}

    (group,) = groups(slaves | {"a": Both()}, [("a.y1", "b"), ("b", "a.u1"), ("a.y2", "silent"), ("silent", "a.u2")])
    assert [loop.components for loop in group.algebraic] == [("a", "b")]
    assert group.possible == ()


def test_pairs_that_must_hold_join_what_lies_between_them() -> None:
    """A receiver in a knot and a source outside of it that must come before: the knot waits for the source."""
    slaves = {"receiver": Direct(), "other": Direct(), "odometer": State(), "plant": State()}
    pairs = [("receiver", "other"), ("other", "receiver"), ("plant", "odometer")]
    found = groups(slaves, pairs, [("plant", "receiver"), ("odometer", "receiver")])
    assert [g.names for g in found] == [("plant",), ("odometer",), ("other", "receiver")]


def test_a_thousand_components_are_ordered_while_one_waits() -> None:
    """A chain listed backwards, and the same closed to a ring; anything worse than linear would take minutes."""
    count = 1000
    slaves: dict[str, Mock] = {f"c{i}": Direct() for i in reversed(range(1, count))} | {"c0": State()}
    chain = [(f"c{i}", f"c{i + 1}") for i in range(count - 1)]
    assert order(slaves, chain) == [f"c{i}" for i in range(count)]
    (ring,) = groups(slaves, [*chain, (f"c{count - 1}", "c0")])
    assert ring.names == tuple(f"c{i}" for i in range(count))
    assert ring.algebraic == ()


# -- graph work on plain nodes
# ------------------------------------------------------------------------------------------

GRAPHS = st.integers(1, 8).flatmap(
    lambda n: st.tuples(st.permutations(range(n)), st.sets(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))))
)


def reaches(edges: set[tuple[int, int]], n: int) -> list[set[int]]:
    """Transitive closure by Warshall's algorithm, every node reaching itself."""
    reach = [{i} | {b for a, b in edges if a == i} for i in range(n)]
    for k in range(n):
        for i in range(n):
            if k in reach[i]:
                reach[i] |= reach[k]
    return reach


@given(GRAPHS)
def test_strong_groups_are_those_of_the_transitive_closure(case: tuple[list[int], set[tuple[int, int]]]) -> None:
    nodes, edges = case
    reach = reaches(edges, len(nodes))
    found = strong_groups(nodes, edges)
    assert sorted(n for group in found for n in group) == sorted(nodes)
    place = {node: i for i, group in enumerate(found) for node in group}
    for a in nodes:
        for b in nodes:
            assert (place[a] == place[b]) == (b in reach[a] and a in reach[b])
    assert all(place[a] <= place[b] for a, b in edges)
    assert all(group == sorted(group, key=nodes.index) for group in found)


@given(GRAPHS)
def test_a_topological_order_exists_unless_something_reaches_itself(
    case: tuple[list[int], set[tuple[int, int]]],
) -> None:
    nodes, edges = case
    reach = reaches(edges, len(nodes))
    cyclic = any(a in reach[b] for a, b in edges)
    found = topological(nodes, edges)
    assert (found is None) == cyclic
    if found is not None:
        assert found == earliest_listed_first(nodes, edges)


def earliest_listed_first(nodes: list[int], edges: set[tuple[int, int]]) -> list[int]:
    """Kahn's order by the book, quadratic."""
    remaining, made = list(nodes), []
    while remaining:
        made.append(next(n for n in remaining if not any(b == n and a in remaining for a, b in edges)))
        remaining.remove(made[-1])
    return made


@given(GRAPHS, st.data())
def test_ordering_keeps_the_last_level_and_whatever_has_no_cycle(
    case: tuple[list[int], set[tuple[int, int]]], data: st.DataObject
) -> None:
    nodes, edges = case
    must = {(a, b) for a, b in edges if a < b and (a + b) % 2}
    kept = satisfied(nodes, [edges, must])
    reach = reaches(edges, len(nodes))
    assert must <= kept <= edges
    assert {(a, b) for a, b in edges if a not in reach[b]} <= kept
    signals = [OrderedSignal(a, frozenset({b}), bool((a + b) % 3)) for a, b in sorted(edges) if a != b]
    rank = {node: node % 2 for node in nodes}
    found = in_order(sorted(nodes), kept, signals, rank)
    assert sorted(found) == sorted(nodes)
    assert all(found.index(a) < found.index(b) for a, b in kept)
    assert in_order(sorted(nodes), kept, data.draw(st.permutations(signals)), rank) == found


@given(GRAPHS)
def test_the_next_node_is_one_that_makes_fewest_signals_held(case: tuple[list[int], set[tuple[int, int]]]) -> None:
    """The greedy choice against its words, all counts made anew at each node."""
    nodes, edges = case
    signals = [OrderedSignal(a, frozenset(b for c, b in edges if c == a and b != a), a % 3 > 0) for a in sorted(nodes)]
    found = in_order(sorted(nodes), set(), signals, dict.fromkeys(nodes, 0))
    placed: set[int] = set()
    for node in found:

        def price(candidate: int, placed: set[int] = placed) -> tuple[int, int]:
            new = [s for s in signals if s.source not in placed and candidate in s.targets and not s.targets & placed]
            return sum(s.flows for s in new), sum(not s.flows for s in new)

        assert price(node) == min(price(n) for n in nodes if n not in placed)
        placed.add(node)


@given(GRAPHS)
def test_closed_paths_follow_edges_and_come_back(case: tuple[list[int], set[tuple[int, int]]]) -> None:
    nodes, edges = case
    for group in strong_groups(nodes, edges):
        inner = [(a, b) for a, b in edges if a in group and b in group]
        if inner:
            path = closed_path(inner[0][0], inner)
            assert path[0] == path[-1] == inner[0][0]
            assert all(step in edges for step in pairwise(path))
            assert len(set(path[1:])) == len(path) - 1

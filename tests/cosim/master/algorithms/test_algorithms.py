"""Gauss-Seidel, Jacobi and the choice between them, against the same recurrences written as matrices."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from iterated_runs import prepare, run
from mock_slaves import FMI2, Counter, Mock, component
from scipy.linalg import block_diag, expm
from test_fmus.masses import Chain, Cut, cuts

from cosim.components.component import Component
from cosim.components.loading import load_block, load_fmu
from cosim.coupling.chain import Position, Stage
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.errors import CouplingError, RunError
from cosim.master.algorithms.choose import choose_algorithm
from cosim.master.master import close

CHAIN = Chain.two(damping=0.3)
ALL_CUTS = ["displacement-displacement", "force-displacement", "force-force"]


def load(cut: Cut, folder: Path, version: Any = 2, **capabilities: Any) -> dict[str, Component]:
    return {name: load_fmu(path, name) for name, path in cut.fmus(folder, version, **capabilities).items()}


# -- the recurrences
# ----------------------------------------------------------------------------------------------------


class Recurrence:
    """The whole of a cut with held inputs as one linear map, by matrices alone.

    ``x+ = F x + G u`` and ``y+ = C x+ + D u`` for all parts together, ``u = L y`` with the connections L.
    """

    def __init__(self, cut: Cut, order: Sequence[str], h: float) -> None:
        parts = [cut.parts[name] for name in order]
        augmented = [
            expm(h * np.block([[p.A, p.B], [np.zeros((p.B.shape[1], p.A.shape[1] + p.B.shape[1]))]])) for p in parts
        ]
        self.F = block_diag(*(e[: len(p.A), : len(p.A)] for e, p in zip(augmented, parts, strict=True)))
        self.G = block_diag(*(e[: len(p.A), len(p.A) :] for e, p in zip(augmented, parts, strict=True)))
        self.C, self.D = block_diag(*(p.C for p in parts)), block_diag(*(p.D for p in parts))
        self.outputs = [f"{p.name}.{y}" for p in parts for y in p.outputs]
        inputs = [f"{p.name}.{u}" for p in parts for u in p.inputs]
        self.L = np.zeros((len(inputs), len(self.outputs)))
        for source, target in (c.split(" -> ") for c in cut.connections):
            self.L[inputs.index(target), self.outputs.index(source)] = 1.0
        owner_of_input = np.repeat(np.arange(len(parts)), [len(p.inputs) for p in parts])
        owner_of_output = np.repeat(np.arange(len(parts)), [len(p.outputs) for p in parts])
        self.newest = owner_of_output[None, :] < owner_of_input[:, None]
        self.x = np.concatenate([np.array(p.x0) for p in parts])
        self.y = np.linalg.solve(np.eye(len(self.outputs)) - self.D @ self.L, self.C @ self.x)

    def step(self, algorithm: str) -> None:
        """`new` says which connections use the value of the end of the step: then `u = L_new y+ + L_old y`."""
        new = {"jacobi": np.zeros_like(self.newest), "gauss-seidel": self.newest, "iterate": np.ones_like(self.newest)}[
            algorithm
        ]
        later, earlier = np.where(new, self.L, 0.0), np.where(new, 0.0, self.L)
        through = self.C @ self.G + self.D
        right = self.C @ self.F @ self.x + through @ earlier @ self.y
        y = np.linalg.solve(np.eye(len(right)) - through @ later, right)
        self.x = self.F @ self.x + self.G @ (later @ y + earlier @ self.y)
        self.y = y


def recurrence(cut: Cut, order: Sequence[str], h: float, count: int, algorithm: str) -> np.ndarray:
    """Outputs of all parts in this order, shape (count + 1, q)."""
    made = Recurrence(cut, order, h)
    rows = [made.y]
    for _ in range(count):
        made.step(algorithm)
        rows.append(made.y)
    return np.array(rows)


def order_of(table: np.ndarray) -> list[str]:
    """Components in the order of the columns, which is that of execution."""
    return list(dict.fromkeys(name.partition(".")[0] for name in table.dtype.names[1:]))


def as_array(table: np.ndarray) -> np.ndarray:
    return np.stack([table[name] for name in table.dtype.names[1:]], axis=1)


def worst_error(cut: Cut, chain: Chain, table: np.ndarray) -> float:
    """Largest error of any position or speed at ten rows, the last one among them."""
    rows = table[:: -max(len(table) // 10, 1)]
    exact = chain.reference(rows["time"])
    return max(float(np.abs(rows[signal] - exact[quantity]).max()) for quantity, signal in cut.signals.items())


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("name", ALL_CUTS)
def test_the_run_is_the_recurrence(tmp_path: Path, name: str, algorithm: str, version: int) -> None:
    """The FMUs are exact for held inputs, so only the algorithm is left; 50 steps of rounding: 1e-11."""
    cut = cuts(CHAIN)[name]
    table, summary = run(load(cut, tmp_path, version), cut.connections, 0.02, 50, {"algorithm": algorithm})
    expected = recurrence(cut, order_of(table), 0.02, 50, algorithm)
    first = 1 if version == 1 else 0  # FMI 1.0 has no exchange of outputs before it is initialised
    np.testing.assert_allclose(as_array(table)[first:], expected[first:], rtol=0.0, atol=1e-11)
    assert summary["name"] == algorithm


@pytest.mark.compiler
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("name", ALL_CUTS)
def test_held_inputs_are_of_first_order(tmp_path: Path, name: str, algorithm: str) -> None:
    cut = cuts(CHAIN)[name]

    def error(h: float) -> float:
        table, _ = run(load(cut, tmp_path), cut.connections, h, round(1.0 / h), {"algorithm": algorithm})
        return worst_error(cut, CHAIN, table)

    coarse, fine = error(0.004), error(0.002)
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.05)  # the next term is of order h


def test_the_order_of_listing_changes_nothing_where_every_source_comes_first() -> None:
    """An acyclic net of counters in all orders, Gauss-Seidel; and a ring in all orders, Jacobi: the same bits."""

    class Two(Mock):
        inputs: ClassVar[dict[str, Any]] = {"u1": 0.3, "u2": 0.7}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0, "direct": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"direct": ["u1"]}

        def begin(self) -> None:
            self.x = {"s": 0.1}

        def compute(self) -> None:
            self.v["y"], self.v["direct"] = self.x["s"], self.x["s"] + self.v["u1"] / 3.0

        def move(self, t: float, h: float) -> None:
            self.x["s"] += h * (self.v["u1"] - 0.9 * self.v["u2"] + np.sin(t))

    net = ["a.y -> b.u1", "a.direct -> c.u2", "b.direct -> c.u1", "b.y -> d.u1", "c.direct -> d.u2"]
    ring = ["a.y -> b.u1", "b.y -> c.u2", "c.direct -> d.u1", "d.direct -> a.u2"]

    def result(names: Sequence[str], pairs: Sequence[str], algorithm: str) -> Mapping[str, bytes]:
        table, _ = run({n: component(Two(), n) for n in names}, pairs, 0.1, 12, {"algorithm": algorithm})
        return {n: table[n].tobytes() for n in sorted(table.dtype.names)}

    wanted = {("net", "auto"): result("abcd", net, "auto"), ("ring", "jacobi"): result("abcd", ring, "jacobi")}

    @given(st.permutations("abcd"), st.permutations(net), st.permutations(ring))
    @settings(max_examples=24)
    def law(names: list[str], first: list[str], second: list[str]) -> None:
        assert result(names, first, "auto") == wanted["net", "auto"]
        assert result(names, second, "jacobi") == wanted["ring", "jacobi"]

    law()


# -- threads
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize("threads", [2, 5])
def test_threads_change_no_bit(tmp_path: Path, threads: int) -> None:
    """FMUs and a block, in threads and without."""
    chain = Chain.three(damping=0.1)
    cut = cuts(chain)["force-force"]

    def result(count: int) -> np.ndarray:
        components = load(cut, tmp_path)
        components["mass2"] = load_block(cut.parts["mass2"].system(), "mass2", 3)
        table, summary = run(components, cut.connections, 0.01, 60, {"algorithm": "jacobi", "threads": count})
        assert summary["threads"] == count
        return table

    assert result(threads).tobytes() == result(1).tobytes()


class Meeting(Counter):
    """Steps only once all have come: two of them never get on without threads."""

    barrier: ClassVar[threading.Barrier]

    def move(self, t: float, h: float) -> None:
        self.barrier.wait(30.0)
        super().move(t, h)


def test_sealed_fmus_really_step_at_one_time() -> None:
    class Both(Meeting):
        barrier = threading.Barrier(2)

    parts = {name: component(Both(), name) for name in ("a", "b")}
    table, _ = run(parts, [], 0.1, 5, {"algorithm": "jacobi", "threads": 2})
    assert table["a.total"][-1] == pytest.approx(0.5, rel=1e-12)


def test_of_several_failures_the_first_of_the_plan_is_reported_once_all_have_come_back() -> None:
    class Fails(Meeting):
        barrier = threading.Barrier(3)

        def move(self, t: float, h: float) -> None:
            self.barrier.wait(30.0)
            raise RuntimeError("broken")

    class Works(Fails):
        def move(self, t: float, h: float) -> None:
            self.barrier.wait(30.0)
            self.x["total"] += 1.0

    works = Works()
    parts = {
        "good": component(works, "good"),
        "first": component(Fails(), "first"),
        "second": component(Fails(), "second"),
    }
    master = prepare(parts, [], 0.1, 5, {"algorithm": "jacobi", "threads": 3})
    with pytest.raises(RunError, match="Component 'first' at t = 0 s: doStep failed: broken"):
        master.run()
    close(master.plan)
    assert works.x["total"] == 1.0
    assert master.recorder.count == 1


def test_what_somebody_took_over_is_moved_by_the_calling_thread_after_the_others() -> None:
    seen: list[tuple[str, bool]] = []

    class Where(Counter):
        def move(self, t: float, h: float) -> None:
            seen.append((self.label, threading.current_thread() is threading.main_thread()))

        label = ""

    parts = {}
    for name in ("watched", "receiver", "free"):
        slave = Where()
        slave.label = name
        parts[name] = component(slave, name)
    master = prepare(parts, [], 0.1, 1, {"algorithm": "jacobi", "threads": 2})
    for step in (master.plan.find("watched"), master.plan.find("receiver")):
        step.add_stage(Stage(Position.BALISES, "somebody"))
    master.run()
    close(master.plan)
    assert seen == [("free", False), ("receiver", True), ("watched", True)]


def test_the_pool_ends_with_the_run() -> None:
    before = threading.active_count()
    parts = {name: component(Counter(), name) for name in ("a", "b")}
    master = prepare(parts, [], 0.1, 3, {"algorithm": "jacobi", "threads": 2})
    master.run()
    close(master.plan)
    assert threading.active_count() == before


# -- the choice
# ---------------------------------------------------------------------------------------------------------


class Held(Mock):
    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}


class Direct(Held):
    feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}


class Forgetful(FMI2, Direct):
    capabilities: ClassVar[dict[str, Any]] = {"canGetAndSetFMUstate": False}


class Silent(Held):
    def __init__(self) -> None:
        super().__init__()
        self.model_description.outputs[0].dependencies = None


def choice(wanted: Any, slaves: Mapping[str, Mock], pairs: Sequence[tuple[str, str]]) -> Any:
    components = {n: component(s, n) for n, s in slaves.items()}
    connections = connect([(f"{a}.y", f"{b}.u") for a, b in pairs], components)
    return choose_algorithm(wanted, execution_groups(components, connections), components)


RING = [("a", "b"), ("b", "a")]


def test_auto_is_gauss_seidel_until_there_is_an_algebraic_loop() -> None:
    chain = choice("auto", {"a": Direct(), "b": Direct()}, RING[:1])
    assert (chain.algorithm, chain.iterated) == ("gauss-seidel", ())
    assert chain.reason == "There is no loop: every component is stepped after all its sources."
    harmless = choice("auto", {"a": Held(), "b": Direct()}, RING)
    assert (harmless.algorithm, harmless.iterated) == ("gauss-seidel", ())
    assert "each holds a state somewhere" in harmless.reason
    loop = choice("auto", {"a": Direct(), "b": Direct(), "c": Held()}, [*RING, ("a", "c")])
    assert (loop.algorithm, loop.iterated) == ("iterate", (("a", "b"),))
    assert loop.reason == (
        "There is an algebraic loop, a.u -> a.y -> b.u -> b.y -> a.u; the rest is stepped by Gauss-Seidel."
    )
    assert loop.groups == (("a", "b"), ("c",))


@pytest.mark.parametrize("wanted", ["gauss-seidel", "jacobi"])
def test_an_algorithm_that_does_not_solve_the_loop_is_refused_and_the_loop_named(wanted: str) -> None:
    with pytest.raises(CouplingError) as error:
        choice(wanted, {"a": Direct(), "b": Direct()}, RING)
    text = str(error.value)
    assert f"master.algorithm = '{wanted}' does not solve the algebraic loop a.u -> a.y -> b.u -> b.y -> a.u" in text
    assert "'auto' or 'iterate'" in text
    assert choice(wanted, {"a": Held(), "b": Direct()}, RING).algorithm == wanted


@pytest.mark.parametrize("wanted", ["auto", "iterate"])
def test_without_saved_states_nothing_is_iterated_and_the_culprits_are_named(wanted: str) -> None:
    with pytest.raises(
        CouplingError, match=r"To iterate the algebraic loop a\.u -> .*, .* cannot: b\. Use FMUs that can, or break"
    ):
        choice(wanted, {"a": Direct(), "b": Forgetful()}, RING)
    assert choice(wanted, {"a": Held(), "b": Forgetful()}, RING[:1]).iterated == ()


def test_a_harmless_loop_without_saved_states_is_refused_only_where_iteration_was_asked_for() -> None:
    slaves = {"a": Held(), "b": Forgetful()}
    assert choice("auto", slaves, RING).algorithm == "gauss-seidel"
    with pytest.raises(CouplingError, match=r"To iterate the loop of a, b, .*use master\.algorithm = 'auto'"):
        choice("iterate", slaves, RING)


def test_iterate_takes_every_loop_and_says_where_there_is_none() -> None:
    assert choice("iterate", {"a": Held(), "b": Direct()}, RING).iterated == (("a", "b"),)
    none = choice("iterate", {"a": Held(), "b": Direct()}, RING[:1])
    assert none.iterated == ()
    assert "no loop to iterate" in none.reason


def test_a_loop_that_is_only_possible_is_noted_and_stepped_as_ever() -> None:
    made = choice("auto", {"a": Silent(), "b": Direct()}, RING)
    assert made.algorithm == "gauss-seidel"
    assert made.notes[0].startswith(
        "Possible algebraic loop a.u -> a.y -> b.u -> b.y -> a.u: an FMU in it does not say"
    )
    assert choice("iterate", {"a": Silent(), "b": Direct()}, RING).notes == ()

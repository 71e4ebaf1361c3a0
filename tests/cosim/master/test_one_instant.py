"""Laws of signals: one instant in all targets, and numbers that do not depend on the order of listing, on random
graphs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from compiled_runs import both, random_linear
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from iterated_runs import prepare
from mock_slaves import Mock, component
from small_scenarios import small

from cosim import Scenario
from cosim.errors import CouplingError
from cosim.master.axis import TimeAxis
from cosim.master.control.doubling import DoublingStep
from cosim.master.control.multirate import set_rates
from cosim.master.master import Master, close
from cosim.master.system import System

NAMES = ("a", "b", "c", "d")
STEP, COUNT = 0.1, 6


class Part(Mock):
    """Two inputs, two outputs from states, bent a little; remembers what it was given in each step."""

    inputs: ClassVar[dict[str, Any]] = {"u1": 0.3, "u2": 0.7}
    outputs: ClassVar[dict[str, Any]] = {"y1": 0.0, "y2": 0.0}
    gain = 0.0

    def begin(self) -> None:
        self.x = {"s": 0.1, "r": -0.2}
        self.fed: list[tuple[float, float, dict[str, float]]] = []

    def compute(self) -> None:
        self.v["y1"], self.v["y2"] = self.x["s"], self.x["r"] + self.gain * self.v["u1"]

    def move(self, t: float, h: float) -> None:
        self.fed.append((t, t + h, dict(self.v)))
        self.x["s"] += h * (self.v["u1"] - 0.9 * self.v["u2"] + np.sin(t + len(self.feedthrough)))
        self.x["r"] += h * (0.4 * self.v["u2"] - self.x["s"] ** 3)


class Direct(Part):
    feedthrough: ClassVar[dict[str, list[str]]] = {"y2": ["u1"]}
    gain = 0.3


class Silent(Part):
    def _describe(self) -> Any:
        description = super()._describe()
        for unknown in description.outputs:
            unknown.dependencies = None
        return description


KINDS = {"state": Part, "direct": Direct, "silent": Silent}


@dataclass(frozen=True)
class Net:
    """A graph of parts.

    Args:
        kinds: of the parts, by name. links: ``a.y1 -> b.u1``, at most one to each input.
    """

    kinds: dict[str, str]
    links: tuple[str, ...]


@st.composite
def nets(draw: st.DrawFn) -> Net:
    kinds = {name: draw(st.sampled_from(list(KINDS))) for name in NAMES}
    outputs = [f"{name}.{y}" for name in NAMES for y in ("y1", "y2")]
    links = []
    for target in (f"{name}.{u}" for name in NAMES for u in ("u1", "u2")):
        source = draw(st.none() | st.sampled_from(outputs))
        links += [] if source is None else [f"{source} -> {target}"]
    return Net(kinds, tuple(links))


def run(
    net: Net, names: Sequence[str], links: Sequence[str], how: str, table: dict[str, Any]
) -> tuple[Any, dict[str, Part]]:
    """The table, or the refusal of the coupling, and the parts; `how` adds rates or step control."""
    slaves = {name: KINDS[net.kinds[name]]() for name in names}
    components = {name: component(slave, name) for name, slave in slaves.items()}
    try:
        master = prepare(components, links, STEP, COUNT, table)
    except CouplingError:
        return "refused", slaves
    if how == "rates":
        set_rates(master.plan, master.axis, {"b": 2}, {"c": 3}, {})
    if how == "doubling":
        master.control = DoublingStep(master.system, 1e-3, smallest_step=0.02)
    try:
        master.run()
    finally:
        close(master.plan)
    return master.recorder.table(), slaves


TABLES = st.fixed_dictionaries(
    {"algorithm": st.sampled_from(["auto", "gauss-seidel", "jacobi", "iterate"])},
    optional={"inputs": st.sampled_from(["interpolate", "extrapolate"])},
)


@given(nets(), TABLES, st.sampled_from(["", "doubling", "rates"]), st.permutations(NAMES), st.data())
@settings(max_examples=25)
def test_numbers_do_not_depend_on_the_order_of_listing(
    net: Net, table: dict[str, Any], how: str, names: list[str], data: st.DataObject
) -> None:
    """Components and connections in any order: the same table to the last bit, and the same columns."""
    how = "" if how == "rates" and table["algorithm"] in ("auto", "iterate") else how
    reference, _ = run(net, NAMES, net.links, how, table)
    found, _ = run(net, names, data.draw(st.permutations(net.links)), how, table)
    if isinstance(reference, str):
        assert found == reference
        return
    assert found.dtype == reference.dtype
    assert found.tobytes() == reference.tobytes()


@given(nets(), st.sampled_from(["gauss-seidel", "jacobi"]), st.permutations(NAMES))
@settings(max_examples=40)
def test_a_signal_is_of_one_instant_in_all_its_targets(net: Net, algorithm: str, names: list[str]) -> None:
    """What each part was given in each step is the source's value at its end for all targets, or at its start for
    all.
    """
    table, slaves = run(net, names, net.links, "", {"algorithm": algorithm})
    if isinstance(table, str):
        return
    for source in {link.split(" -> ")[0] for link in net.links}:
        targets = [link.split(" -> ")[1].split(".") for link in net.links if link.startswith(f"{source} ->")]
        fed_to = [[values[u] for _, _, values in slaves[name].fed] for name, u in targets]
        column = table[source]
        assert fed_to[0] in (column[1:].tolist(), column[:-1].tolist())
        assert all(other == fed_to[0] for other in fed_to)


class Ends(Part):
    """Its first output is ``t``: what another one is given tells of which instant it is."""

    def compute(self) -> None:
        self.v["y1"], self.v["y2"] = self.time, 0.0


def instants(order: Sequence[str], links: Sequence[str], step: Any) -> dict[str, list[tuple[float, float, float]]]:
    """By part, of each step it took: begin, end, and the instant of what it was given; `step` moves a system."""
    slaves = {name: Ends() for name in order}
    components = {name: component(slave, name) for name, slave in slaves.items()}
    master = prepare(components, links, STEP, 1)
    step(master)
    close(master.plan)
    return {name: [(t, until, values["u1"]) for t, until, values in slave.fed] for name, slave in slaves.items()}


RING = ("a.y1 -> b.u1", "b.y1 -> a.u1", "b.y1 -> c.u1", "b.y1 -> d.u1")
"""a is stepped first, b's signal goes to it and to two that are stepped after b."""


def test_a_divided_step_holds_what_was_true_where_its_part_begins() -> None:
    def halves(master: Master) -> None:
        master.control = DoublingStep(master.system, 1.0)
        master.run()

    for name, steps in instants(NAMES, RING, halves).items():
        assert [(round(t, 9), round(until, 9)) for t, until, _ in steps][-2:] == [(0.0, 0.05), (0.05, 0.1)]
        assert [seen for _, _, seen in steps] == [(until if name == "b" else t) for t, until, _ in steps]


def test_slow_and_fast_parts_are_fed_what_the_others_are_fed() -> None:
    """In the step in which a slow part takes its own it is given what everybody is given in that step."""

    def rates(master: Master) -> None:
        axis = TimeAxis(0.0, STEP, 4)
        set_rates(master.plan, axis, {"c": 2}, {"d": 2}, {})
        Master(master.plan, axis).run()

    found = {name: [round(seen, 9) for _, _, seen in steps] for name, steps in instants(NAMES, RING, rates).items()}
    assert found["a"] == [0.0, 0.1, 0.2, 0.3]
    assert found["c"] == [0.1, 0.3]
    assert found["d"] == [0.0, 0.0, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3]


def test_lines_begin_at_the_instant_of_the_value() -> None:
    """A held signal that grows by one in a second is extrapolated to the very same line in all its targets."""
    slaves = {name: Ends() for name in NAMES}
    master = prepare({n: component(s, n) for n, s in slaves.items()}, RING, STEP, COUNT, {"inputs": "extrapolate"})
    master.run()
    close(master.plan)
    for name in "acd":
        seen = [values["u1"] for _, _, values in slaves[name].fed][1:]
        # the mean over the step
        np.testing.assert_allclose(seen, STEP * (np.arange(1, COUNT) + 0.5), rtol=0.0, atol=1e-12)


def test_after_a_restore_the_held_value_is_that_of_the_step_taken_again() -> None:
    slaves = {name: Ends() for name in NAMES}
    master = prepare({n: component(s, n) for n, s in slaves.items()}, RING, STEP, 2)
    master.run()
    system: System = master.system
    kept = system.save()
    for until in (0.3, 0.25):
        system.advance(0.2, until)
        t, end, values = slaves["c"].fed[-1]
        assert (t, end, values["u1"]) == (0.2, until, 0.2)
        system.restore(kept)
    system.release(kept)
    close(master.plan)


# -- loops that are iterated
# --------------------------------------------------------------------------------------------


class Through(Part):
    """Both inputs act on both outputs."""

    feedthrough: ClassVar[dict[str, list[str]]] = {"y1": ["u1"], "y2": ["u2"]}

    def compute(self) -> None:
        self.v["y1"], self.v["y2"] = self.time + 0.3 * self.v["u1"], 0.2 * self.v["u2"]


def test_a_signal_that_leaves_an_iterated_loop_is_of_the_end_of_the_step() -> None:
    """a and b make an algebraic loop, its signal goes to c as well, which acts on a: c would be stepped before the
    loop.
    """
    slaves = {"a": Through(), "b": Through(), "c": Direct()}
    links = ["a.y1 -> b.u1", "b.y1 -> a.u1", "a.y1 -> c.u1", "c.y2 -> a.u2", "a.y2 -> b.u2"]
    master = prepare({n: component(s, n) for n, s in slaves.items()}, links, STEP, COUNT)
    master.run()
    close(master.plan)
    reported, table = master.system.algorithm.summary(), master.recorder.table()
    assert reported["loops"][0]["components"] == ["a", "b"]
    assert reported["held"] == ["c.y2 -> a.u2"]
    assert "a.y1 -> c.u1" in reported["fresh"]
    assert [values["u1"] for _, _, values in slaves["c"].fed] == table["a.y1"][1:].tolist()


def test_two_loops_that_take_iterated_signals_of_one_another_are_one() -> None:
    names = {"a": "b", "b": "a", "c": "d", "d": "c"}
    links = [f"{x}.y1 -> {y}.u1" for x, y in names.items()] + ["a.y1 -> c.u2", "c.y1 -> a.u2"]
    master = prepare({n: component(Through(), n) for n in names}, links, STEP, COUNT)
    master.run()
    close(master.plan)
    assert [sorted(loop["components"]) for loop in master.system.algorithm.summary()["loops"]] == [list("abcd")]


# -- FMUs, both steppers
# ------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@given(data=st.data())
@settings(max_examples=3, phases=(Phase.explicit, Phase.reuse, Phase.generate))  # to shrink would take minutes
def test_fmus_in_any_order_by_both_steppers(fmus: list[Path], data: st.DataObject) -> None:
    """Three FMUs in a random net: permutations and steppers give the same bits."""
    inputs = [f"c{i}.u{j}" for i in range(3) for j in (1, 2)]
    outputs = [f"c{i}.y{j}" for i in range(3) for j in (1, 2)]
    links = [f"{data.draw(st.sampled_from(outputs))} -> {target}" for target in inputs]
    algorithm = data.draw(st.sampled_from(["gauss-seidel", "jacobi"]))

    def result(names: Sequence[int], links: Sequence[str]) -> bytes:
        scenario = Scenario(stop=COUNT * STEP, step=STEP, master={"algorithm": algorithm})
        for i in names:
            scenario.add(f"c{i}", fmu=str(fmus[i % 2]))
        python, compiled = both(scenario.connect(*links))
        assert python.result.table.tobytes() == compiled.result.table.tobytes()
        return bytes(python.result.table.tobytes())

    permuted = data.draw(st.permutations(range(3))), data.draw(st.permutations(links))
    assert result(*permuted) == result(range(3), links)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    rng, folder = np.random.default_rng(5), tmp_path_factory.mktemp("fmus")
    return [random_linear(folder, f"f{i}", rng, version, 2, 2) for i, version in enumerate((2, 3))]


# -- a train with balises
# -----------------------------------------------------------------------------------------------


def permuted(seed: int, *, balises: bool, **overrides: Any) -> tuple[bytes, list[str]]:
    """The table of a small train, components and connections shuffled, as bytes, and its telegrams."""
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    if not balises:
        del data["balises"]
    rng = np.random.default_rng(seed)
    names = list(data["components"])
    data["components"] = {names[i]: data["components"][names[i]] for i in rng.permutation(len(names))}
    data["connections"] = [data["connections"][i] for i in rng.permutation(len(data["connections"]))]
    outcome = Scenario(**data).run(overrides={"certificates": "ignore", "stop": 0.3} | overrides, warn=lambda _: None)
    assert outcome.failure is None
    return outcome.result.table.tobytes(), [repr(event) for event in outcome.result.events]


@pytest.mark.parametrize(
    ("balises", "overrides"),
    [
        (True, {}),
        (True, {"master.algorithm": "jacobi", "master.inputs": "extrapolate"}),
        (False, {"master.algorithm": "iterate", "master.inputs": "interpolate"}),
    ],
    ids=["auto", "jacobi with lines", "iterate with lines, no balises"],
)
def test_a_train_with_its_observer_in_any_order(balises: bool, overrides: dict[str, Any]) -> None:
    assert permuted(3, balises=balises, **overrides) == permuted(0, balises=balises, **overrides)

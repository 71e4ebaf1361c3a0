"""Loops iterated within a step: against closed forms, against the implicit recurrence, and everything that can go
wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Balises as BaliseSide
from coupled_runs import Listener, Pushed, Ran, positions, ran
from coupled_runs import prepare as prepare_coupled
from hypothesis import given, settings
from hypothesis import strategies as st
from iterated_runs import prepare, run
from mock_slaves import EventMode, Mock, component
from scipy.optimize import brentq
from test_algorithms import ALL_CUTS, CHAIN, as_array, load, order_of, recurrence, worst_error
from test_fmus.masses import CONVERGENT, DIVERGENT, Chain, Loop, Part, cuts

from cosim.components.component import Component
from cosim.components.loading import load_block, load_fmu
from cosim.errors import RunError
from cosim.master.algorithms.iterate import Iterate
from cosim.master.control.doubling import DoublingStep
from cosim.master.master import Master, close
from plant_models.hybrid import HybridSystem, input_signal, output_signal, state

METHODS = ["fixed-point", "aitken", "newton"]
TURN = 2.0
"""Angular frequency of what drives the loops below [rad/s]."""


def by(method: str, **more: Any) -> dict[str, Any]:
    return {"iteration": {"method": method, **more}}


# -- algebraic loops
# ----------------------------------------------------------------------------------------------------


def driven(gains: tuple[np.ndarray, np.ndarray], offsets: tuple[np.ndarray, np.ndarray]) -> dict[str, Part]:
    """``y = C (cos wt, sin wt) + D u`` twice: a loop whose solution moves."""
    turn = np.array([[0.0, -TURN], [TURN, 0.0]])
    n = len(gains[0])
    inputs, outputs = tuple(f"u{i}" for i in range(n)), tuple(f"y{i}" for i in range(n))
    return {
        name: Part(name, turn, np.zeros((2, n)), C, D, inputs, outputs, (1.0, 0.0))
        for name, C, D in zip(("first", "second"), offsets, gains, strict=True)
    }


def crossed(n: int) -> list[str]:
    return [f"{a}.y{i} -> {b}.u{i}" for a, b in (("first", "second"), ("second", "first")) for i in range(n)]


def solution(parts: Mapping[str, Part], t: np.ndarray) -> np.ndarray:
    """What the first one's outputs must be, shape (len(t), n)."""
    first, second = parts["first"], parts["second"]
    wave = np.stack([np.cos(TURN * t), np.sin(TURN * t)])
    right = first.C @ wave + first.D @ (second.C @ wave)
    return np.linalg.solve(np.eye(len(first.D)) - first.D @ second.D, right).T


def build(parts: Mapping[str, Part], folder: Path, version: Any = 2, **capabilities: Any) -> dict[str, Component]:
    return {name: load_fmu(part.fmu(folder, version, **capabilities), name) for name, part in parts.items()}


def random_loop(n: int, gain: float, seed: int) -> dict[str, Part]:
    """Of n values each way; `gain` is the spectral radius of one round."""
    rng = np.random.default_rng(seed)
    a, c = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    c *= gain / np.abs(np.linalg.eigvals(a @ c)).max()
    return driven((a, c), (rng.normal(size=(n, 2)), rng.normal(size=(n, 2))))


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("loop", [CONVERGENT, DIVERGENT], ids=["gain -0.4", "gain -3"])
def test_a_constant_loop_stands_on_its_solution(tmp_path: Path, loop: Loop, method: str, version: int) -> None:
    """Initialisation finds it to 1e-12, also where plain exchange diverges, and no step moves it."""
    parts = {name: load_fmu(path, name) for name, path in loop.fmus(tmp_path, version).items()}  # type: ignore[arg-type]
    table, summary = run(parts, loop.connections, 0.1, 10, by(method))
    for name, value in zip(("first.y", "second.y"), loop.solution, strict=True):
        np.testing.assert_allclose(table[name], value, rtol=1e-10)
    assert summary["name"] == "iterate"
    assert summary["held"] == []


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("n", "gain", "method"),
    [
        (1, 0.5, "fixed-point"),
        (3, 0.5, "fixed-point"),
        (1, 0.5, "aitken"),
        (1, 3.0, "aitken"),
        (1, 3.0, "newton"),
        (3, 0.5, "newton"),
        (3, 2.0, "newton"),
        (6, 3.0, "newton"),
    ],
)
@pytest.mark.parametrize("directional", [False, True])
def test_a_moving_loop_is_solved_at_every_point(
    tmp_path: Path, n: int, gain: float, method: str, directional: bool
) -> None:
    """An accepted residual of 1e-9 of the value leaves at most its condition times as much in the solution (here below
    30).
    """
    parts = random_loop(n, gain, n)
    table, summary = run(build(parts, tmp_path, directional=directional), crossed(n), 0.05, 30, by(method))
    found = np.stack([table[f"first.y{i}"] for i in range(n)], axis=1)
    wanted = solution(parts, table["time"])
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=3e-8 * np.abs(wanted).max())
    (loop,) = summary["loops"]
    assert 0.0 <= loop["largest_residual"] <= 1.0
    assert loop["components"] == ["first", "second"]
    assert loop["iterated"] == [f"second.y{i}" for i in range(n)]
    if method == "newton":
        assert (loop["max_iterations"] == 2) == directional  # a linear loop with its whole Jacobian: guess, solve
        assert loop["jacobian"].startswith("directional" if directional else "Broyden")


@pytest.mark.compiler
def test_a_part_that_gives_no_derivatives_is_learnt(tmp_path: Path) -> None:
    """One declares directional derivatives and the other does not: no Jacobian from them, Broyden's updates instead."""
    parts = random_loop(2, 2.0, 5)
    components = build({"first": parts["first"]}, tmp_path, directional=True) | build(
        {"second": parts["second"]}, tmp_path
    )
    table, summary = run(components, crossed(2), 0.05, 20)
    np.testing.assert_allclose(table["first.y1"], solution(parts, table["time"])[:, 1], rtol=0.0, atol=1e-7)
    assert summary["loops"][0]["jacobian"] == "Broyden updates"


def test_lying_derivatives_are_corrected_and_broken_ones_done_without() -> None:
    class Lying(Mock):
        """``y = -3 u + t`` and says that the derivative is +3."""

        version = 2
        inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}
        capabilities: ClassVar[dict[str, Any]] = {"providesDirectionalDerivative": True}

        def compute(self) -> None:
            self.v["y"] = -3.0 * self.v["u"] + self.time

        def doStep(self, t: float, h: float, noSetFMUStatePriorToCurrentPoint: bool = True) -> None:
            super().doStep(t, h)

        def getDirectionalDerivative(self, unknowns: list[int], knowns: list[int], seed: list[float]) -> list[float]:
            return [3.0 * seed[0]]

    class Broken(Lying):
        def getDirectionalDerivative(self, unknowns: list[int], knowns: list[int], seed: list[float]) -> list[float]:
            raise RuntimeError("not really")

    for slave, jacobian in ((Lying(), "directional derivatives and Broyden updates"), (Broken(), "Broyden updates")):
        table, summary = run({"a": component(slave, "a")}, ["a.y -> a.u"], 0.1, 10)
        np.testing.assert_allclose(table["a.y"], table["time"] / 4.0, rtol=1e-8, atol=1e-9)
        assert summary["loops"][0]["jacobian"] == jacobian


class Bent(Mock):
    """``y = 3 sin t - u^3``: a nonlinear loop where ``u = y``, with slopes down to -10."""

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
    feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}

    def compute(self) -> None:
        self.v["y"] = 3.0 * np.sin(self.time) - self.v["u"] ** 3


@pytest.mark.parametrize("method", ["aitken", "newton"])
def test_a_nonlinear_loop_is_solved_at_every_point(method: str) -> None:
    table, _ = run({"a": component(Bent(), "a")}, ["a.y -> a.u"], 0.1, 30, by(method))
    wanted = [brentq(lambda y, t=t: y + y**3 - 3.0 * np.sin(t), -2.0, 2.0, xtol=1e-14) for t in table["time"]]
    np.testing.assert_allclose(table["a.y"], wanted, rtol=1e-8, atol=1e-9)


# -- loops with states
# --------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ALL_CUTS)
def test_an_iterated_run_is_the_implicit_recurrence(tmp_path: Path, name: str, version: int) -> None:
    """``u = L y(t + H)`` solved by one linear system, whatever the cut; 60 steps of 1e-9."""
    cut = cuts(CHAIN)[name]
    table, _ = run(load(cut, tmp_path, version), cut.connections, 0.02, 60, {"algorithm": "iterate"})
    expected = recurrence(cut, order_of(table), 0.02, 60, "iterate")
    np.testing.assert_allclose(as_array(table), expected, rtol=0.0, atol=60 * 1e-9 * np.abs(expected).max())


@pytest.mark.compiler
@pytest.mark.parametrize("method", METHODS)
def test_all_methods_find_one_step(tmp_path: Path, method: str) -> None:
    cut = cuts(CHAIN)["force-force"]
    table, summary = run(load(cut, tmp_path), cut.connections, 0.02, 40, {"algorithm": "iterate"} | by(method))
    expected = recurrence(cut, order_of(table), 0.02, 40, "iterate")
    np.testing.assert_allclose(as_array(table), expected, rtol=0.0, atol=40 * 1e-9 * np.abs(expected).max())
    assert summary["loops"][0]["method"] == method


@pytest.mark.compiler
@pytest.mark.parametrize("inertia", [0.4, 0.7], ids=["gain -0.67", "gain -2.3"])
@pytest.mark.parametrize("algorithm", ["auto", "iterate"])
def test_a_mass_that_is_cut_through_converges_to_the_whole(tmp_path: Path, inertia: float, algorithm: str) -> None:
    """First order in the step. `auto` iterates the algebraic loop only, and holds what the second mass feeds back."""
    cut = cuts(CHAIN, inertia)["inertial"]

    def error(h: float) -> tuple[float, Mapping[str, Any]]:
        table, summary = run(load(cut, tmp_path), cut.connections, h, round(0.5 / h), {"algorithm": algorithm})
        return worst_error(cut, CHAIN, table), summary

    (coarse, summary), (fine, _) = error(0.002), error(0.001)
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.05)
    (loop,) = summary["loops"]
    assert set(loop["components"]) == {"mass1", "spring1"} | ({"mass2"} if algorithm == "iterate" else set())
    assert summary["held"] == ([] if algorithm == "iterate" else ["spring1.f_right -> mass2.f_left"])


@pytest.mark.compiler
def test_lines_over_an_iterated_step_are_of_second_order_and_keep_the_energy(tmp_path: Path) -> None:
    chain = Chain.two()
    cut = cuts(chain)["force-displacement"]

    def errors(h: float, inputs: str) -> tuple[float, float]:
        components = load(cut, tmp_path, input_derivatives=True)
        table, _ = run(components, cut.connections, h, round(2.0 / h), {"algorithm": "iterate", "inputs": inputs})
        last = table[-1:]
        states = [np.stack([last[cut.signals[f"{q}{i}"]] for i in (1, 2)], axis=1) for q in "pv"]
        energies = chain.of_states(*states).energy[0], chain.reference([0.0]).energy[0]
        return worst_error(cut, chain, table), float(abs(energies[0] / energies[1] - 1.0))

    (coarse, _), (fine, lines) = errors(0.02, "interpolate"), errors(0.01, "interpolate")
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.05)
    assert lines < 1e-3 * errors(0.01, "hold")[1]


@pytest.mark.compiler
def test_the_listing_changes_an_iterated_loop_within_the_tolerance_only(tmp_path: Path) -> None:
    chain = Chain.three(damping=0.2)
    cut = cuts(chain)["force-force"]
    components = cut.fmus(tmp_path, 2)

    def result(names: list[str]) -> Mapping[str, np.ndarray]:
        parts = {name: load_fmu(components[name], name) for name in names}
        table, _ = run(parts, cut.connections, 0.02, 15, {"algorithm": "iterate"})
        return {name: table[name] for name in table.dtype.names}

    first = result(list(components))

    @given(st.permutations(list(components)))
    @settings(max_examples=6)
    def law(names: list[str]) -> None:
        for name, values in result(names).items():
            # residual 1e-9 times a condition below 10
            np.testing.assert_allclose(values, first[name], rtol=0.0, atol=15 * 1e-8)

    law()


# -- balises inside a loop
# ----------------------------------------------------------------------------------------------


class Controller(Listener):
    """Brakes a plant in proportion to its speed, and is told of balises, which change nothing in that."""

    name = "controller"
    outputs = (*Listener.outputs, output_signal("push", "m/s2"))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return super().output(t, x, u, p) | {"push": -0.3 * u.speed}


class Driver(HybridSystem):
    """A brake that follows the speed, and rises with the position; nothing in it acts at once."""

    name = "driver"
    states = (state("pull", "m/s2"),)
    inputs = (input_signal("speed", "m/s"), input_signal("position", "m"))
    outputs = (output_signal("push", "m/s2"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"pull": 5.0 * (-0.3 * u.speed - 0.1 * u.position - x.pull)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"push": x.pull}


LAYOUTS: dict[str, tuple[list[str], list[tuple[str, str]], list[str]]] = {
    "receiver in the loop": (["plant", "listener"], [("listener.push", "plant.push")], ["plant", "listener"]),
    "plant fed back": (
        ["driver", "plant", "listener"],
        [("plant.speed", "driver.speed"), ("plant.position", "driver.position"), ("driver.push", "plant.push")],
        ["driver", "plant"],
    ),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("method", ["rollback", "interpolate"])
def test_balises_inside_an_iterated_loop_are_delivered_once_and_leave_no_trace(method: Any, layout: str) -> None:
    """The plant moves bit for bit as without them; each telegram comes once, at the instant at which the plant is
    there.
    """
    places = (0.6, 1.3, 2.9, 2.95, 5.0)
    names, pairs, loop = LAYOUTS[layout]
    systems = {"plant": Pushed, "listener": Controller, "driver": Driver}

    def result(balises: BaliseSide | None) -> Ran:
        parts = [load_block(systems[name](), name, 3) for name in names]
        held = prepare_coupled(parts, [("plant.speed", "listener.speed"), *pairs], 0.1, 10, balises, order=names)
        master = Master(held.plan, held.axis, held.balises, algorithm=lambda plan: Iterate(plan, [loop]))
        master.run()
        close(master.plan)
        return ran(master)

    plain, reported = result(None), result(BaliseSide(positions(*places), method=method, receivers=["listener"]))
    points = np.isin(reported.time, plain.time)
    assert points.sum() == len(plain.time)
    for name in ("plant.position", "plant.speed", "listener.push"):
        assert reported[name][points].tobytes() == plain[name].tobytes()
    if layout == "receiver in the loop":
        # v+ = v - 0.1 * 0.3 v+
        np.testing.assert_allclose(plain["plant.speed"], 10.0 / 1.03 ** np.arange(11), rtol=1e-8)
    assert [event.position for event in reported.events] == list(places)
    assert reported["listener.heard"][-1] == len(places)
    if method == "rollback":
        np.testing.assert_allclose(reported.after("plant.position"), places, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(
            reported.after("listener.at"), [e.stamp for e in reported.events], rtol=0.0, atol=1e-12
        )


# -- what the summary tells
# ---------------------------------------------------------------------------------------------


def test_the_summary_states_sweeps_and_residuals() -> None:
    """``y = u / 2 + t``: each sweep halves the residual; from one point to the next the solution moves by 0.2."""

    class Half(Bent):
        def compute(self) -> None:
            self.v["y"] = 0.5 * self.v["u"] + self.time

    settings = by("fixed-point", relative_tolerance=1e-30, absolute_tolerance=1e-3)
    table, summary = run({"a": component(Half(), "a")}, ["a.y -> a.u"], 0.1, 2, settings)
    (loop,) = summary["loops"]
    residuals = np.array(loop["worst_step"]["residuals"])
    np.testing.assert_allclose(residuals[:-1] / residuals[1:], 2.0, rtol=1e-9)
    assert residuals[0] == pytest.approx(0.1 / 1e-3, rel=1e-9)
    assert len(residuals) == 8  # 100 / 2**7 is the first below 1
    assert loop["worst_step"]["time"] == pytest.approx(0.1)
    assert (loop["mean_iterations"], loop["max_iterations"]) == (8.0, 8)
    assert loop["largest_residual"] == pytest.approx(max(residuals[-1], 100 / 2**7 * (1 + 2**-8)), rel=1e-2)
    assert abs(table["a.y"][1] - 0.2) < 1e-3


# -- what can go wrong
# --------------------------------------------------------------------------------------------------


class NoSolution(Bent):
    """``y = u + t``: solvable at t = 0 only."""

    def compute(self) -> None:
        self.v["y"] = self.v["u"] + self.time


@pytest.mark.parametrize("method", METHODS)
def test_a_loop_without_solution_ends_the_run_with_its_history(method: str) -> None:
    master = prepare({"a": component(NoSolution(), "a")}, ["a.y -> a.u"], 0.1, 5, by(method, max_iterations=20))
    with pytest.raises(RunError) as error:
        master.run()
    close(master.plan)
    text = str(error.value)
    assert text.startswith(
        f"Loop of a at t = 0.1 s: 20 sweeps by '{method}' do not converge. Scaled residuals (1 is converged): "
    )
    assert "..." in text
    assert "Moving most in the last sweep: a.y from" in text
    assert ("method = 'newton'" in text) == (method != "newton")
    assert (error.value.component, error.value.time) == ("a", 0.1)
    assert master.recorder.table()["time"].tolist() == [0.0]
    assert master.plan.values[0] == 0.0  # a guess gone astray is no result


def fails(master: Master, words: str) -> None:
    """The run ends with an error of these words."""
    with pytest.raises(RunError, match=words):
        master.run()
    close(master.plan)


def test_a_divergence_to_infinity_is_reported_as_such() -> None:
    class Explodes(Bent):
        def compute(self) -> None:
            with np.errstate(over="ignore"):
                self.v["y"] = float(np.float64(10.0) * self.time + np.float64(3.0) * np.float64(self.v["u"]) ** 3)

    master = prepare({"a": component(Explodes(), "a")}, ["a.y -> a.u"], 1.0, 5, by("fixed-point"))
    fails(master, r"Loop of a at t = 1 s: \d sweeps by 'fixed-point' do not converge\. .*, inf\. Moving most")


def test_a_member_that_fails_in_a_later_sweep_says_so() -> None:
    class Refuses(Bent):
        def move(self, t: float, h: float) -> None:
            if abs(self.v["u"]) > 1.0:
                raise RuntimeError("input out of range")

        def compute(self) -> None:
            self.v["y"] = 4.0 * self.v["u"] + self.time

    master = prepare({"a": component(Refuses(), "a")}, ["a.y -> a.u"], 0.6, 5, by("fixed-point"))
    fails(master, r"doStep failed: input out of range \(In sweep 3 of the iteration of a; residuals so far: ")


def test_a_member_that_is_broken_from_the_start_is_named_and_not_the_loop() -> None:
    class Odd(Bent):
        def compute(self) -> None:
            self.v["y"] = np.nan if self.time > 0.15 else 0.0

    master = prepare({"a": component(Odd(), "a")}, ["a.y -> a.u"], 0.1, 5)
    fails(master, r"Component 'a' at t = 0\.2 s: output a\.y is nan")
    assert master.recorder.count == 2


@pytest.mark.parametrize("slave", [Bent, NoSolution])
def test_every_saved_state_is_freed(slave: type[Mock]) -> None:
    made = slave()
    saved = 0
    take = made.getFMUState

    def counted() -> Any:
        nonlocal saved
        saved += 1
        return take()

    made.getFMUState = made.getFMUstate = counted  # type: ignore[method-assign]
    master = prepare({"a": component(made, "a")}, ["a.y -> a.u"], 0.1, 5)
    if slave is NoSolution:
        with pytest.raises(RunError):
            master.run()
    else:
        master.run()
    close(master.plan)
    assert saved > 0
    assert made.calls.count("freeFMUstate") == saved


def test_a_member_that_asks_for_the_end_ends_the_run() -> None:
    """Also where the loop would never converge again: after the end there is nothing to agree on."""

    class Ends(EventMode):
        inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}
        late = 0

        def compute(self) -> None:
            self.v["y"] = 0.5 * self.v["u"] + self.time + 1e3 * self.late

        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            super().doStep(t, h)
            self.late += t > 0.25
            return False, t > 0.25, False, self.time

    table, _ = run({"a": component(Ends(), "a")}, ["a.y -> a.u"], 0.1, 10)
    assert table["time"][-1] == pytest.approx(0.4)
    np.testing.assert_allclose(table["a.y"][:-1], 2.0 * table["time"][:-1], rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("early", [False, True], ids=["known time event", "early return"])
def test_events_of_a_member_are_met_on_the_way(early: bool) -> None:
    """``y = u / 2 + x`` with ``u = y``, and x jumps to 1 at 0.25 s: y is 0 before it and 2 after it at every point."""

    class Jumps(EventMode):
        inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"y": ["u"]}
        first_event = None if early else 0.25

        def compute(self) -> None:
            self.v["y"] = 0.5 * self.v["u"] + self.x["events"]

        def on_event(self) -> None:
            if self.time >= 0.25 - 1e-12 and not self.x["events"]:
                self.x["events"] = 1.0
                self.next_event = None

        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            if early and t < 0.25 - 1e-12 < 0.25 < t + h:
                super().doStep(t, 0.25 - t)
                return True, False, True, 0.25
            return super().doStep(t, h)

    table, summary = run({"a": component(Jumps(), "a")}, ["a.y -> a.u"], 0.1, 6)
    before, after = table[table["time"] < 0.249], table[table["time"] > 0.251]
    assert before["a.y"].tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(after["a.y"], 2.0, rtol=1e-8)
    assert summary["loops"][0]["largest_residual"] <= 1.0


def test_discrete_values_are_passed_on_whole() -> None:
    """A relaxed counter would be no counter: the integer that is fed back only ever takes values that came out."""
    heard: set[float] = set()

    class Rounds(Mock):
        inputs: ClassVar[dict[str, Any]] = {"n": 0.0, "level": 0.0}
        outputs: ClassVar[dict[str, Any]] = {"m": 0.0, "y": 0.0}
        feedthrough: ClassVar[dict[str, Any]] = {"m": ["level"], "y": ["n", "level"]}

        def _describe(self) -> Any:
            description = super()._describe()
            next(v for v in description.modelVariables if v.name == "m").variability = "discrete"
            return description

        def compute(self) -> None:
            heard.add(self.v["n"])
            self.v["m"] = float(np.floor(self.v["level"]))
            self.v["y"] = 0.25 * self.v["level"] + 0.5 * self.v["n"] + 3.0 * self.time

    table, _ = run({"a": component(Rounds(), "a")}, ["a.m -> a.n", "a.y -> a.level"], 0.1, 10)
    np.testing.assert_allclose(0.75 * table["a.y"], 0.5 * table["a.m"] + 3.0 * table["time"], rtol=1e-7, atol=1e-9)
    assert np.array_equal(table["a.m"], np.floor(table["a.y"]))
    assert all(n == round(n) for n in heard)


def test_a_rejected_step_leaves_no_trace_in_what_was_learnt() -> None:
    """Step doubling saves and restores the algorithm with everything else: taking the same step again gives the same
    bits.
    """
    master = prepare({"a": component(Bent(), "a")}, ["a.y -> a.u"], 0.5, 5)
    master.run()
    system = master.system
    checkpoint = system.save()
    once = []
    for _ in range(2):
        system.advance(2.5, 3.0)
        once.append((master.plan.values.tobytes(), system.algorithm.summary()))
        system.restore(checkpoint)
    system.release(checkpoint)
    assert once[0] == once[1]
    close(master.plan)


def test_step_doubling_and_iteration_go_together() -> None:
    master = prepare({"a": component(Bent(), "a")}, ["a.y -> a.u"], 0.5, 5)
    made = master.system.algorithm
    again = Master(
        master.plan, master.axis, algorithm=lambda _: made, control=lambda system: DoublingStep(system, 1e-6)
    )
    again.run()
    close(master.plan)
    table = again.recorder.table()
    wanted = [brentq(lambda y, t=t: y + y**3 - 3.0 * np.sin(t), -2.0, 2.0, xtol=1e-14) for t in table["time"]]
    np.testing.assert_allclose(table["a.y"], wanted, rtol=1e-8, atol=1e-9)

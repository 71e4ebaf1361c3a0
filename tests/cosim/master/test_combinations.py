"""Things that hold when algorithms, lines, step control, events and balises meet: what no room's own tests see."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from clocked_mocks import Planned
from coupled_runs import Balises, Listener, Motion, _service, block, execution_order, positions, prepare, ran, run
from event_runs import parts
from fmpy.fmi1 import FMICallException
from mock_slaves import DISCARD, FATAL, Counter, component
from test_fmus.events import (
    countdown_fmu,
    integrator_fmu,
    periodic_fmu,
    periodic_ticks,
    receiver_fmu,
    timed_fmu,
    triggered_fmu,
)
from test_fmus.masses import Chain, cuts

from cosim import CosimError, Scenario
from cosim.balises.telegram import Channel, FalseTelegram
from cosim.components.component import Component
from cosim.coupling.clocks import connect_clocks
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.coupling.plan import make_plan
from cosim.errors import CouplingError, RunError
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.iterate import Iterate
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.axis import TimeAxis
from cosim.master.control.doubling import DoublingStep
from cosim.master.control.fixed import FixedStep
from cosim.master.control.multirate import set_rates
from cosim.master.initialisation import initialise
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, parameter, state

BALISE = TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),))


class Jumper(HybridSystem):
    """Holds the last balise; nothing flows. With a share the output also follows a feedback at once."""

    name = "jumper"
    states = (state("held", "m"),)
    inputs = (input_signal("speed", "m/s"),)
    outputs = (output_signal("estimate", "m"),)
    events = (BALISE,)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"held": 0.0 * u.speed}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"estimate": x.held}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"held": u.balise_position}


class Looped(Jumper):
    """As `Jumper`, less half of what is fed back: ``estimate = held - fed / 2``."""

    name = "looped"
    inputs = (input_signal("fed", "m"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"held": 0.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"estimate": x.held - 0.5 * u.fed}


class Gain(HybridSystem):
    """``y = 2 u``."""

    name = "gain"
    inputs = (input_signal("u", "m"),)
    outputs = (output_signal("y", "m"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": 2.0 * u.u}


class Adder(HybridSystem):
    """A train at constant speed that integrates what it is told: ``di = u``."""

    name = "adder"
    states = (state("sum", "m.s"),)
    inputs = (input_signal("u", "m"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"), output_signal("i", "m.s"))
    parameters = (parameter("v0", "m/s", 10.0),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"sum": u.u}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": p.v0 * t, "speed": p.v0, "i": x.sum}


class Driven(Adder):
    """An adder whose speed follows what it is told a little: the receiver hangs in a loop with it."""

    name = "driven"
    states = (state("p", "m"), state("v", "m/s", 10.0))
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"p": x.v, "v": 0.01 * u.u}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.p, "speed": x.v}


# -- lines and jumps
# ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("inputs", ["hold", "interpolate", "extrapolate"])
@pytest.mark.parametrize("version", [2, 3])
def test_no_line_leads_over_the_jump_of_a_balise(inputs: str, version: int) -> None:
    """Told at 0.5 s, a communication point, the estimate is 5 from there on: held inputs are exact, and so is every
    line.
    """
    components = [block(Adder(), "plant"), block(Jumper(), "r", version)]
    pairs = [("r.estimate", "plant.u"), ("plant.speed", "r.speed")]
    seen = run(components, pairs, 0.1, 12, Balises(positions(5.0), receivers=["r"]), inputs=inputs)
    np.testing.assert_allclose(seen["plant.i"], 5.0 * np.maximum(seen.time - 0.5, 0.0), rtol=0.0, atol=1e-12)


def test_lines_begin_anew_with_the_values_after_an_event() -> None:
    """A sine that jumps at two instants between points, interpolated and integrated: of second order, without a stray
    term.
    """

    class Saw(Planned):
        outputs: ClassVar[dict[str, Any]] = {"events": 0.0, "y": 0.0}

        def __init__(self) -> None:
            super().__init__(lambda _t, n: [0.234, 0.567, math.inf][min(n, 2)])

        def compute(self) -> None:
            super().compute()
            self.v["y"] = math.sin(3.0 * self.time) + 5.0 * self.v["events"]

    exact = (1.0 - math.cos(3.0)) / 3.0 + 5.0 * (1.0 - 0.234) + 5.0 * (1.0 - 0.567)
    errors = [
        run([component(Saw(), "s"), component(Counter(), "i")], [("s.y", "i.rate")], 1.0 / n, n, inputs="interpolate")[
            "i.total"
        ][-1]
        - exact
        for n in (20, 40, 80, 160)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    # the trapezoidal rule over pieces; the partial steps differ in length
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


# -- balises in loops
# ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [2, 3])
def test_an_algebraic_loop_through_a_receiver_holds_in_the_row_after_a_balise(version: Any) -> None:
    """``y = 2 e``, ``e = held - y / 2``: ``e = held / 2`` at every communication point, also in the step of the
    balise.
    """
    components = {n: block(s, n, version) for n, s in (("plant", Motion()), ("r", Looped()), ("g", Gain()))}
    pairs = connect([("g.y", "r.fed"), ("r.estimate", "g.u")], components)
    groups = execution_groups(components, pairs, [("plant", "r")])
    for made in components.values():
        made.instantiate()
    plan = make_plan(components, pairs, [name for group in groups for name in group.names])
    loops = [group.names for group in groups if group.algebraic]
    service = _service(plan, Balises(positions(5.0, 9.0), receivers=["r"]))
    master = Master(plan, TimeAxis(0.0, 0.1, 10), service, algorithm=lambda plan: Iterate(plan, loops))
    master.run()
    close(plan)
    seen = ran(master)
    points = seen.table[[int(np.searchsorted(seen.time, master.axis[k])) for k in range(11)]]
    held = np.select([points["time"] > 9.0 / 13.9, points["time"] > 5.0 / 13.9], [9.0, 5.0])
    np.testing.assert_allclose(points["r.estimate"], held / 2.0, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(points["g.y"], held, rtol=0.0, atol=1e-8)
    assert [e.outcomes["r"] for e in seen.events] == ["accepted", "accepted"]


@pytest.mark.parametrize("version", [2, 3])
def test_a_plant_that_feels_in_an_iterated_loop_what_its_balises_did(version: int) -> None:
    """With the values at the end of each step: ``v(k+1) = v(k) + h / 100 * e(k+1)``; every balise is passed once."""
    components = [block(Driven(), "plant"), block(Jumper(), "r", version)]
    pairs = [("r.estimate", "plant.u"), ("plant.speed", "r.speed")]
    balises = Balises(positions(2.5, 5.5), receivers=["r"])
    seen = run(components, pairs, 0.1, 10, balises, algorithm=lambda plan: Iterate(plan, [["plant", "r"]]))
    points = seen.table[[int(np.searchsorted(seen.time, k * 0.1)) for k in range(11)]]
    assert points["r.estimate"].tolist() == [0.0] * 3 + [2.5] * 3 + [5.5] * 5
    np.testing.assert_allclose(np.diff(points["plant.speed"]), 1e-3 * points["r.estimate"][1:], rtol=0.0, atol=1e-12)
    assert seen.master.balises.passed == len(seen.events) == 2
    for event, k, reported in zip(
        seen.events, (2, 5), (2.5, 5.5), strict=True
    ):  # where it was in the step that was kept
        place, speed, push = points["plant.position"][k], points["plant.speed"][k], 0.01 * reported
        s = (np.sqrt(speed**2 + 2.0 * push * (reported - place)) - speed) / push
        assert event.stamp == pytest.approx(k * 0.1 + s, abs=1e-9)  # promised for 'rollback'


# -- step doubling
# ------------------------------------------------------------------------------------------------------


def doubling(system: Any) -> DoublingStep:
    return DoublingStep(system, 1e-3)


class Particular(Counter):
    """Refuses, or spoils, steps above 60 ms."""

    def __init__(self, refusal: bool) -> None:
        self.refusal = refusal
        super().__init__()

    def move(self, t: float, h: float) -> None:
        super().move(t, h)
        if h > 0.06:
            if self.refusal:
                raise FMICallException("fmi3DoStep", DISCARD)
            self.x["total"] = math.nan


@pytest.mark.parametrize("refusal", [True, False])
def test_a_trial_step_that_fails_or_gives_no_number_is_divided(refusal: bool) -> None:
    seen = run([component(Particular(refusal), "c")], [], 0.1, 5, control=doubling)
    np.testing.assert_allclose(seen["c.total"], seen.time, rtol=0.0, atol=1e-14)
    statistics = seen.master.control.statistics
    assert statistics.rejected >= 1
    assert math.isfinite(statistics.worst)
    assert statistics.worst <= 1.0


def test_a_step_that_fails_however_short_it_is_fails_with_its_own_reason() -> None:
    class Wall(Counter):
        def move(self, t: float, h: float) -> None:
            if t + h > 0.25:
                raise FMICallException("fmi3DoStep", DISCARD)
            super().move(t, h)

    master = prepare([component(Wall(), "c")], [], 0.1, 5, control=doubling)
    with pytest.raises(RunError, match=r"'c' at t = 0.25 s: doStep"):
        master.run()
    assert ran(master).time.tolist() == [0.0, 0.1, 0.2]


def test_components_that_cannot_vary_their_step_are_refused() -> None:
    class Rigid(Counter):
        capabilities: ClassVar[dict[str, Any]] = {"canHandleVariableCommunicationStepSize": False}

    with pytest.raises(CouplingError, match=r"divides communication steps, and these components cannot vary theirs: c"):
        prepare([component(Rigid(), "c")], [], 0.1, 5, control=doubling)


@pytest.mark.parametrize(("interval", "pieces"), [(0.0125, 1), (0.175, 4)])
def test_events_at_the_end_of_a_part_of_a_step_have_both_rows_and_count_once(
    interval: float, pieces: int, tmp_path: Path
) -> None:
    """Ticks at middles of steps, and at ends of the pieces of 25 ms that the error asks for: rows as with fixed
    steps.
    """
    tables, counts = [], []
    for control in (FixedStep, lambda system: DoublingStep(system, 2e-3)):
        components = [*parts(p=periodic_fmu(tmp_path, interval=interval, shift=interval)), block(Adder(), "plant")]
        seen = run(components, [("plant.i", "p.u"), ("plant.position", "plant.u")], 0.1, 4, control=control)
        tables.append(seen.table)
        counts.append(seen.master.system.events.iteration.count)  # type: ignore[union-attr]
    assert seen.master.control.statistics.shortest == pytest.approx(0.1 / pieces)
    assert counts == [len(periodic_ticks(0.4, interval, interval))] * 2
    np.testing.assert_allclose(tables[0]["time"], tables[1]["time"], rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(tables[0]["p.count"], tables[1]["p.count"])


@pytest.mark.parametrize("how", [{"control": doubling}, {"algorithm": lambda plan: Iterate(plan, [["a", "b"]])}])
def test_nothing_is_called_after_a_fatal_error(how: dict[str, Any]) -> None:
    class Dying(Counter):
        dead = False

        def move(self, t: float, h: float) -> None:
            if t + h > 0.25:
                self.dead = True
                raise FMICallException("fmi3DoStep", FATAL)
            super().move(t, h)

    slave = Dying()
    frees: list[bool] = []
    slave.freeFMUState = lambda _state: frees.append(slave.dead)  # type: ignore[method-assign]
    master = prepare(
        [component(slave, "a"), component(Counter(), "b")],
        [("a.total", "b.rate"), ("b.total", "a.rate")],
        0.1,
        5,
        **how,
    )
    with pytest.raises(RunError, match=r"'a' at t = 0.2 s: doStep failed: .*fatal"):
        master.run()
    close(master.plan)
    assert frees
    assert not any(frees)


# -- rates
# --------------------------------------------------------------------------------------------------------------


def test_a_component_that_asks_for_the_end_takes_no_more_substeps() -> None:
    class Leaving(Counter):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            super().doStep(t, h)
            return False, self.time > 0.13, False, self.time

    master = prepare([component(Leaving(), "c")], [], 0.1, 8)
    set_rates(master.plan, master.axis, {}, {"c": 5}, {})
    master.run()
    assert master.ended_early == "Component 'c' asked to terminate at t = 0.14 s."
    assert ran(master).time.tolist() == [0.0, 0.1]


def test_substeps_end_where_the_step_ends() -> None:
    assert 0.1 * 3 / 3 != 0.1
    master = prepare([component(Counter(), "c")], [], 0.1, 1)
    set_rates(master.plan, master.axis, {}, {"c": 3}, {})
    master.run()
    assert master.plan.steps[0].component.time == 0.1


def test_a_slow_component_finds_the_newest_inputs_wherever_it_is_listed() -> None:
    ends = []
    for names in (("slow", "fast"), ("fast", "slow")):
        s = Scenario(stop=0.8, step=0.1, master={"stepper": "python"})
        for name in names:
            more = {"every": 4} if name == "slow" else {}
            s.add(name, model="odometer", **more)  # type: ignore[arg-type]
        s.connect("slow.reading -> fast.wheel_speed", "fast.reading -> slow.wheel_speed")
        outcome = s.run(warn=lambda _text: None)
        assert outcome.failure is None
        ends.append(outcome.result.summary["master"]["algorithm"]["held"])
    assert ends[0] == ends[1]
    assert any(text.startswith("slow.") for text in ends[0])


def test_clocks_that_are_connected_tick_at_every_point(tmp_path: Path) -> None:
    s = Scenario(stop=1.0, step=0.1)
    s.add("s", fmu=str(triggered_fmu(tmp_path))).add("r", fmu=str(receiver_fmu(tmp_path)), every=5)
    s.connect("s.crossing -> r.tick", "s.crossing_value -> r.tick_value")
    with pytest.raises(CosimError, match=r"r: every = 5 is not possible: its clocks are connected"):
        s.run(warn=lambda _text: None)


# -- save, restore, redo: everything at once
# ----------------------------------------------------------------------------

ALGORITHMS: dict[str, Any] = {
    "gauss-seidel": GaussSeidel,
    "threads": lambda plan: Jacobi(plan, 2),
    "iterate": lambda plan: Iterate(plan, [["plant", "listener"], ["mass1", "mass2"]]),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("combinations")


def everything(
    folder: Path, algorithm: str, control: Any, inputs: Any, version: Any, rates: dict[str, int]
) -> Iterator[Master]:
    """Two coupled masses, a train whose observer feeds it back, late and false telegrams, clocks and time events."""
    cut = cuts(Chain.two(damping=0.1))["displacement-displacement"]
    made = {"s": triggered_fmu(folder), "r": receiver_fmu(folder), "t": timed_fmu(folder), "i": integrator_fmu(folder)}
    made |= {"c": countdown_fmu(folder), **cut.fmus(folder, 2, input_derivatives=True)}
    components: list[Component] = [block(Driven(), "plant"), block(Listener(), "listener", version), *parts(**made)]
    wires = [
        "plant.speed -> listener.speed",
        "listener.integrated -> plant.u",
        "s.crossing -> r.tick",
        *cut.connections,
    ]
    wires += ["s.crossing_value -> r.tick_value", "t.level -> i.u", "s.crossing -> c.start"]
    by_name = {c.name: c for c in components}
    clocks, pairs = connect_clocks([tuple(w.split(" -> ")) for w in wires], by_name)  # type: ignore[misc]
    connected = connect(pairs, by_name)
    order = execution_order(by_name, connected, [("plant", "listener")])
    for c in components:
        c.instantiate()
    plan = make_plan(by_name, connected, order, None, clocks)
    if inputs != "hold":
        attach_interpolators(plan, inputs)
    channel = Channel(
        latency=0.12, latency_jitter=0.1, missed_fraction=0.2, seed=3, false_telegrams=(FalseTelegram(0.35, 2.0),)
    )
    balises = Balises(positions(*(0.7 * k for k in range(1, 28))), receivers=["listener"], channel=channel)
    master = Master(
        plan, TimeAxis(0.0, 0.1, 6), _service(plan, balises), algorithm=ALGORITHMS[algorithm], control=control
    )
    set_rates(plan, master.axis, rates, {"mass1": 3}, {})
    initialise(plan, 0.0, 1.0)
    master.system.start(0.0)
    yield master
    master.system.algorithm.close()
    close(plan)


def steps(master: Master, first: int, last: int) -> list[Any]:
    seen: list[Any] = []
    for k in range(first, last):
        rows = master.control.step(master.axis[k], master.axis[k + 1])
        seen.append(([(t, row.tobytes()) for t, row in rows], master.plan.values.tobytes()))
    return seen


@pytest.mark.parametrize(
    ("algorithm", "control", "inputs", "version", "rates"),
    [
        ("gauss-seidel", FixedStep, "extrapolate", 2, {"mass2": 3}),
        ("threads", FixedStep, "extrapolate", 3, {"mass2": 3}),
        ("iterate", FixedStep, "interpolate", 3, {}),
        ("iterate", doubling, "interpolate", 2, {}),
        ("gauss-seidel", doubling, "extrapolate", 3, {}),
    ],
)
def test_what_follows_a_restore_is_bit_identical(
    folder: Path, algorithm: str, control: Any, inputs: str, version: int, rates: dict[str, int]
) -> None:
    how = (folder, algorithm, control, inputs, version, rates)
    for master in everything(*how):
        reference, log = steps(master, 0, 6), [repr(e) for e in master.balises.mailbox.log]  # type: ignore[union-attr]
    again = []
    for master in everything(*how):
        for k in range(6):
            saved, level = master.system.save(), getattr(master.control, "_level", None)
            ahead = steps(master, k, min(k + 2, 6))
            master.system.restore(saved)
            if level is not None:
                master.control._level = level  # type: ignore[attr-defined]
            again += steps(master, k, k + 1)
            assert again[-1] == ahead[0]
            master.system.release(saved)
        reported = [repr(e) for e in master.balises.mailbox.log]  # type: ignore[union-attr]
    assert again == reference
    assert reported == log
    assert len(log) > 3

"""Small hybrid systems with closed forms, and a run of the master without a scenario, for the tests of the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mock_slaves import set_start

from cosim.balises.delivery import Receiver
from cosim.balises.layout import Layout, by_positions
from cosim.balises.localise import Method, make_localiser
from cosim.balises.plant_monitor import PlantMonitor
from cosim.balises.service import BaliseService
from cosim.balises.telegram import Channel
from cosim.components.component import Component
from cosim.components.loading import load_block
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.coupling.plan import Plan, make_plan
from cosim.master.axis import TimeAxis
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close
from cosim.results.result import BaliseRecord
from fmu_observer.observers.train.high_gain_observer import HighGainTrainObserver
from plant_models.hybrid import HybridSystem, TriggeredEvent
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state


class Motion(HybridSystem):
    """A train on rails of time: ``p = p0 + v0 t + a t^2/2 + (A/w)(1 - cos w t)``, ``v`` its derivative."""

    name = "motion"
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (
        parameter("p0", "m", 0.0),
        parameter("v0", "m/s", 13.9),
        parameter("a", "m/s2", 0.0),
        parameter("A", "m/s", 0.0),
        parameter("w", "rad/s", 1.0),
    )

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        swing = p.A / p.w * (1.0 - np.cos(p.w * t))
        return {
            "position": p.p0 + p.v0 * t + 0.5 * p.a * t * t + swing,
            "speed": p.v0 + p.a * t + p.A * np.sin(p.w * t),
        }


class Pushed(HybridSystem):
    """``dp = v, dv = push``: exact for a held push with any steps (RK4 on a polynomial of order 2)."""

    name = "pushed"
    states = (state("p", "m"), state("v", "m/s", 10.0))
    inputs = (input_signal("push", "m/s2"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    internal_step = 1e-2

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"p": x.v, "v": u.push}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.p, "speed": x.v}


class Staircase(HybridSystem):
    """Effort and odometer that are constant on every ``(0.1 k, 0.1 (k + 1)]``: the value at the end of a step is the
    one of the whole step, so that holding it is exact for every communication step that divides 100 ms."""

    name = "staircase"
    outputs = (output_signal("effort", "N"), output_signal("odometer", "m/s"), output_signal("push", "m/s2"))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        k = np.ceil(10.0 * t - 1e-6)
        wave = np.sin(0.7 * k)
        return {"effort": 2e4 * wave, "odometer": 13.9 + 0.3 * np.cos(0.4 * k), "push": 0.5 * wave}


class IdealCdo(HighGainTrainObserver):
    """The high-gain observer of Bouchama 2024, (3.24)-(3.43), handed the true adhesion force: an exact model."""

    name = "ideal_cdo"

    def adhesion(self, x: Any, u: Any, p: Any) -> Any:
        return u.effort


class Listener(HybridSystem):
    """Keeps what it is told: the last position, when, how often; between balises it integrates its input."""

    name = "listener"
    states = (state("integral", "m"), memory("reported", "m"), memory("notified_at", "s", -1.0), memory("count", "1"))
    inputs = (input_signal("speed", "m/s"),)
    outputs = (
        output_signal("integrated", "m"),
        output_signal("last", "m", variability="discrete"),
        output_signal("at", "s", variability="discrete"),
        output_signal("heard", "1", variability="discrete"),
    )
    events = (TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),)),)
    internal_step = 1e-2

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"integral": u.speed}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"integrated": x.integral, "last": x.reported, "at": x.notified_at, "heard": x.count}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"reported": u.balise_position, "notified_at": t, "count": x.count + 1.0}


@dataclass
class Recorded:
    """What a run recorded."""

    table: np.ndarray

    @property
    def time(self) -> np.ndarray:
        return self.table["time"]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.table[name]


@dataclass
class Ran(Recorded):
    """What a run left behind."""

    events: list[BaliseRecord]
    master: Master
    plan: Plan

    def after(self, name: str) -> np.ndarray:
        """Values right after each telegram that was told to anybody, shape (telegrams,)."""
        stamps = [e.delivered_at for e in self.events if e.kind != "missed"]
        last = np.searchsorted(self.time, np.array(stamps) + 1e-9, side="right") - 1
        return self.table[name][last]


def block(system: HybridSystem, name: str, version: Any = 3, **arguments: Any) -> Component:
    return load_block(system, name, version, **arguments)


@dataclass
class Balises:
    """The balise side of a run: who is watched, who listens, and how."""

    layout: Layout
    plant: str = "plant"
    method: Method = "rollback"
    receivers: Sequence[str] = ()
    channel: Channel = field(default_factory=Channel)
    timing: Any = "exact"
    odometer: str | None = None
    clock: str | None = None
    scale: float = 1.0


def prepare(
    components: Sequence[Component],
    connections: Sequence[tuple[str, str]],
    h: float,
    count: int,
    balises: Balises | None = None,
    *,
    start: float = 0.0,
    starts: Mapping[str, Mapping[str, float]] | None = None,
    extra: Mapping[str, Sequence[str]] | None = None,
    inputs: Any = "hold",
    order: Sequence[str] = (),
    **how: Any,
) -> Master:
    """A master ready to run; `order` of execution where it is not left to the graph, `how` as for `Master`."""
    by_name = {c.name: c for c in components}
    pairs = connect(connections, by_name)
    before = [] if balises is None else [(balises.plant, name) for name in balises.receivers]
    order = order or execution_order(by_name, pairs, before, ["plant"])
    for component in components:
        component.instantiate()
        for name, value in (starts or {}).get(component.name, {}).items():
            set_start(component, name, value)
    plan = make_plan(by_name, pairs, order, extra)
    if inputs != "hold":
        attach_interpolators(plan, inputs)
    service = None if balises is None else _service(plan, balises)
    return Master(plan, TimeAxis(start, h, count), service, **how)


def execution_order(components: Mapping[str, Component], connections: Sequence[Any], *rules: Any) -> list[str]:
    """Component names in Gauss-Seidel order; rules as of `execution_groups`."""
    return [name for group in execution_groups(components, connections, *rules) for name in group.names]


def _service(plan: Plan, balises: Balises) -> BaliseService:
    planned = plan.find(balises.plant)
    names = planned.component.names("output")
    watch = PlantMonitor(
        planned, names.index("position"), names.index("speed"), (balises.scale, 0.0), (balises.scale, 0.0)
    )
    localiser = make_localiser(balises.method, watch, balises.layout, balises.clock)
    receivers = [Receiver(plan.find(name), timing=balises.timing) for name in balises.receivers]
    odometer = None if balises.odometer is None else plan.column(balises.odometer)
    position = plan.column(f"{balises.plant}.position")
    return BaliseService(localiser, balises.channel, receivers, odometer, position)


def run(*arguments: Any, **keywords: Any) -> Ran:
    """`prepare`, run, close."""
    master = prepare(*arguments, **keywords)
    try:
        master.run()
    finally:
        close(master.plan)
    return ran(master)


def ran(master: Master) -> Ran:
    events = [] if master.balises is None else list(master.balises.mailbox.log)
    return Ran(master.recorder.table(), events, master, master.plan)


def positions(*places: float) -> Layout:
    return by_positions(places)

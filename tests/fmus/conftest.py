"""Small systems that between them use everything a system can declare, and a common handle on FMI 2 and FMI 3
instances.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exchange_importer import INSTANCE, Exchange, callbacks_into, description_of, pass_initialization
from fmpy import extract
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from shipped import shipped
from toy_systems import Booster

from fmu_observer.description import can_exchange
from fmu_observer.event_protocol import EventProtocol
from fmus import RECIPES, cached_fmu
from plant_models.hybrid import CommunicationEvent, HybridSystem, PeriodicEvent, Runtime, TriggeredEvent, vector
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, scalar_names, state


class Oscillator(HybridSystem):
    """A damped oscillator: smooth, rk4, a tunable parameter, an output that depends directly on the input."""

    name = "oscillator"
    description = "Damped oscillator"
    states = (state("position", "m", 1.0), state("speed", "m/s"))
    inputs = (input_signal("force", "N"),)
    outputs = (output_signal("position_mm", "mm"), output_signal("acceleration", "m/s2"))
    parameters = (
        parameter("stiffness", "N/m", 40.0, min=0.0),
        parameter("damping", "N.s/m", 0.5, variability="tunable"),
    )
    presets: Mapping[str, Mapping[str, Any]] = {"soft": {"stiffness": 4.0, "position": 2.0}}
    internal_step = 0.002

    def _acceleration(self, x: Any, u: Any, p: Any) -> Any:
        return u.force - p.stiffness * x.position - p.damping * x.speed + 0.1 * np.sin(3.0 * x.position)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.speed, "speed": self._acceleration(x, u, p)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position_mm": 1000.0 * x.position, "acceleration": self._acceleration(x, u, p)}


class Slider(HybridSystem):
    """A stiff slider with dry friction: rosenbrock, set-valued friction."""

    name = "slider"
    states = (state("position", "m"), state("speed", "m/s", 0.5), state("filtered", "m/s"))
    inputs = (input_signal("force", "N"),)
    outputs = (output_signal("speed_out", "m/s", display_unit="km/h"), output_signal("filtered_out", "m/s"))
    parameters = (parameter("mass", "kg", 2.0, min=0.0), parameter("grip", "N", 1.5))
    frictions = ("speed",)
    method = "rosenbrock"
    internal_step = 0.005

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.speed, "speed": u.force / p.mass, "filtered": 2000.0 * (x.speed - x.filtered) + 0.1 * t}

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.grip / p.mass)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed_out": x.speed, "filtered_out": x.filtered}


class Sampler(HybridSystem):
    """Two noisy periodic events with different periods, one with an offset; memory and a vector; nothing flows."""

    name = "sampler"
    states = (memory("held", "m/s", 0.25), memory("ring", "m/s", (1.0, 2.0, 3.0), size=3))
    inputs = (input_signal("wheel_speed", "m/s"),)
    outputs = (output_signal("reading", "m/s", variability="discrete"), output_signal("mean", "m/s", size=3))
    parameters = (
        parameter("period", "s", 0.03),
        parameter("slow_period", "s", 0.1),
        parameter("slow_offset", "s", 0.004),
        parameter("deviation", "m/s", 0.2),
    )
    events = (
        PeriodicEvent("sample", "period", None, (input_signal("first_noise", "1"), input_signal("second_noise", "1"))),
        PeriodicEvent("shift", "slow_period", "slow_offset", (input_signal("third_noise", "1"),)),
    )
    internal_step = 0.01

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "sample":
            return {"held": u.wheel_speed + p.deviation * (u.first_noise + 0.5 * u.second_noise)}
        return {"ring": vector(x.held + u.third_noise, x.ring[0], x.ring[1])}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"reading": x.held, "mean": (x.ring + x.held) / 2.0}


class Tracker(HybridSystem):
    """A small observer: flows, jumps at two triggered events with payloads and at a periodic one."""

    name = "tracker"
    states = (state("position", "m"), state("speed", "m/s", 10.0), memory("innovation", "m"))
    inputs = (input_signal("odometer", "m/s", 10.0),)
    outputs = (output_signal("position_out", "m"), output_signal("innovation_out", "m", variability="discrete"))
    parameters = (parameter("gain", "1", 0.7), parameter("period", "s", 0.05))
    events = (
        TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),), "a balise is passed"),
        PeriodicEvent("filter", "period"),
        TriggeredEvent(
            "telegram",
            (
                input_signal("telegram_speed", "m/s", variability="discrete"),
                input_signal("telegram_weight", "1", 0.5, variability="discrete"),
            ),
        ),
    )
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.speed, "speed": 2.0 * (u.odometer - x.speed) + 0.3 * np.cos(t)}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "balise":
            innovation = u.balise_position - x.position
            return {"position": x.position + p.gain * innovation, "innovation": innovation}
        if event == "telegram":
            # order matters
            return {"speed": x.speed + u.telegram_weight * (u.telegram_speed - x.speed) + 0.1 * x.innovation}
        return {"innovation": 0.9 * x.innovation}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position_out": x.position, "innovation_out": x.innovation}


class Gain(HybridSystem):
    """No state at all: what goes in comes out."""

    name = "gain"
    inputs = (input_signal("force", "N", 3.0),)
    outputs = (output_signal("twice", "N"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"twice": 2.0 * u.force + t}


class Hopper(HybridSystem):
    """Everything that can be part of a replay: friction, a tunable parameter, noise, communication events, an integer
    output.
    """

    name = "hopper"
    states = (
        state("position", "m"),
        state("speed", "m/s", 0.4),
        memory("sample", "m"),
        memory("handed", "m"),
        memory("steps", "1"),
        memory("marks", "1"),
    )
    inputs = (input_signal("force", "N"), input_signal("wind", "N", (0.1, -0.2), size=2))
    outputs = (
        output_signal("position_out", "m"),
        output_signal("marks_out", "1", variability="discrete", integer=True),
    )
    parameters = (
        parameter("grip", "N", 0.3),
        parameter("drag", "N.s/m", 0.2, variability="tunable"),
        parameter("lift", "1", (0.5, 0.1), variability="tunable", size=2),
        parameter("period", "s", 0.07),
        parameter("offset", "s", 0.013),
    )
    events = (
        TriggeredEvent(
            "kick",
            (
                input_signal("kick_impulse", "N.s", variability="discrete"),
                input_signal("kick_share", "1", (0.5, 0.25), variability="discrete", size=2),
            ),
        ),
        PeriodicEvent("sampling", "period", "offset", (input_signal("jitter", "1", variability="discrete"),)),
        CommunicationEvent("handover"),
        TriggeredEvent("mark"),
    )
    frictions = ("speed",)
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "position": x.speed,
            "speed": 5.0 * u.force + u.wind[0] * t - u.wind[1] - p.drag * x.speed - 3.0 * x.position + 0.1 * x.handed,
        }

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.grip)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position_out": x.position + p.lift[1] * x.sample, "marks_out": x.marks}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "kick":
            return {"speed": 0.9 * x.speed + u.kick_share[0] * u.kick_impulse, "sample": x.sample + u.kick_share[1]}
        if event == "mark":
            return {"speed": p.lift[0] * x.speed, "marks": x.marks + 1.0}
        if event == "handover":
            return {"handed": 0.5 * x.handed + x.position, "steps": x.steps + 1.0}
        return {"sample": x.position + 0.1 * u.jitter}


SMALL: dict[str, type[HybridSystem]] = {
    cls.name: cls for cls in (Oscillator, Slider, Sampler, Tracker, Gain, Booster, Hopper)
}
SHIPPED = tuple(RECIPES)


@cache
def make_system(name: str) -> HybridSystem:
    """A small system of this file, or one that ships: one object in a process, so that it is traced once."""
    return SMALL[name]() if name in SMALL else shipped(name)


def kind(system: HybridSystem) -> tuple[object, ...]:
    """What of the runtime in C a system uses, by what it declares."""
    return (
        system.method,
        bool(system.frictions),
        bool(system.switchings),
        *sorted({type(event).__name__ for event in system.events}),
        bool(system.noises),
        bool(system.resources),
        any(signal.integer for signal in system.outputs),
        system.continuous_count < sum(signal.width for signal in system.states),
        can_exchange(system),
    )


OF_EACH_KIND = {
    kind(make_system(name)): name
    for name in sorted(SHIPPED, key=lambda name: make_system(name).state_count, reverse=True)
}
"""Of each kind the shipped system of the fewest states. The runtime in C is one for all, so the first tier builds these
and the small systems of this file; the second tier builds every system that ships as FMI 3.0, and these as FMI 2.0 too.
"""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Shipped systems that are none of `OF_EACH_KIND` belong to the second tier. Leave them out in FMI 2.0, which
    belongs there too, and in laws of ``each_kind``.
    """
    kinds = set(OF_EACH_KIND.values())
    beside = set()
    for item in items:
        names = _shipped(item)
        as_fmi2 = names and item.callspec.params.get("version") == 2  # type: ignore[attr-defined]
        other = names and not names & kinds
        if other and (as_fmi2 or item.get_closest_marker("each_kind")):
            beside.add(item)
        elif as_fmi2 or other:
            item.add_marker(pytest.mark.slow)
    if beside:
        config.hook.pytest_deselected(items=list(beside))
        items[:] = [item for item in items if item not in beside]


def _shipped(item: pytest.Item) -> set[str]:
    """Names of shipped systems among the parameters of a test."""
    parameters = getattr(getattr(item, "callspec", None), "params", {})
    return {parameters.get("name"), parameters.get("system_name")} & set(SHIPPED)


@pytest.fixture(scope="session")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], Path]:
    """Extracts an FMU once per session."""
    folders: dict[Path, Path] = {}

    def unpack(fmu: Path) -> Path:
        if fmu not in folders:
            folders[fmu] = Path(extract(str(fmu), str(tmp_path_factory.mktemp("unzipped"))))
        return folders[fmu]

    return unpack


class Component:
    """One FMU instance, FMI 2 or FMI 3, driven by names; `log` holds its messages."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        self.description = description_of(fmu)
        self.version = int(self.description.fmiVersion[0])
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.log: list[str] = []
        identity = {
            "guid": self.description.guid,
            "unzipDirectory": str(folder),
            "modelIdentifier": self.description.coSimulation.modelIdentifier,
            "instanceName": INSTANCE,
        }
        self.slave: Any = FMU2Slave(**identity) if self.version == 2 else FMU3Slave(**identity)
        self.early_return = False
        self.event_mode = self.version == 3 and self.description.coSimulation.hasEventMode

    def instantiate(self, logging: bool = False) -> None:
        if self.version == 2:
            self._callbacks = callbacks_into(self.log)
            self.slave.instantiate(callbacks=self._callbacks, loggingOn=logging)
        else:
            self.slave.instantiate(
                eventModeUsed=self.event_mode,
                earlyReturnAllowed=self.early_return,
                loggingOn=logging,
                logMessage=lambda *a: self.log.append(_text(a[3])),
            )

    def initialize(self, start_time: float = 0.0, **starts: float) -> None:
        self.set(**starts)
        pass_initialization(self.slave, self.version, start_time)
        if self.event_mode:
            self.slave.enterStepMode()

    def references(self, names: Sequence[str]) -> list[int]:
        return [self.by_name[name].valueReference for name in names]

    def set(self, **values: float) -> None:
        self.set_all(values)

    def set_all(self, values: Mapping[str, float]) -> None:
        setter = self.slave.setReal if self.version == 2 else self.slave.setFloat64
        setter(self.references(list(values)), list(values.values()))

    def get(self, *names: str) -> np.ndarray:
        return np.array([self._getter(name)(self.references([name]))[0] for name in names], dtype=float)

    def _getter(self, name: str) -> Callable[..., Any]:
        real = self.slave.getReal if self.version == 2 else self.slave.getFloat64
        others = {
            "Integer": "getInteger",
            "Int32": "getInt32",
            "Enumeration": "getInteger" if self.version == 2 else "getInt64",
        }
        kind = self.by_name[name].type
        return getattr(self.slave, others[kind]) if kind in others else real

    def values(self) -> np.ndarray:
        """All outputs and states; not what is derived from them, nor counts of events."""
        derived = ("der(", "event_indicator.", "events.")
        names = [v.name for v in self.description.modelVariables if v.causality in {"output", "local"}]
        return self.get(*(name for name in names if not name.startswith(derived)))

    def step(self, t: float, h: float) -> None:
        self.slave.doStep(t, h)

    def event(self, name: str, stamp: float | None = None, **payload: float) -> None:
        """By count: announce for the next step. By clock: event mode, now."""
        stamps = {} if stamp is None else {f"{name}_time": stamp}
        if f"{name}_count" in self.by_name:
            self.set_all(payload | stamps)
            self.raise_count(name)
            return
        self.slave.enterEventMode()
        self.slave.setClock(self.references([name]), [True])
        self.set_all(payload | stamps)
        self.slave.updateDiscreteStates()
        self.slave.enterStepMode()

    def raise_count(self, name: str, by: int = 1) -> None:
        """Raise the count of an event."""
        reference, slave = self.references([f"{name}_count"]), self.slave
        get, put = (slave.getInteger, slave.setInteger) if self.version == 2 else (slave.getInt32, slave.setInt32)
        put(reference, [get(reference)[0] + by])

    def set_policy(self, number: int) -> None:
        """Set the parameter `late_policy`."""
        (self.slave.setInteger if self.version == 2 else self.slave.setInt64)(
            self.references(["late_policy"]), [number]
        )

    def save(self) -> Any:
        return self.slave.getFMUstate() if self.version == 2 else self.slave.getFMUState()

    def restore(self, saved: Any) -> None:
        (self.slave.setFMUstate if self.version == 2 else self.slave.setFMUState)(saved)

    def free(self, saved: Any) -> None:
        (self.slave.freeFMUstate if self.version == 2 else self.slave.freeFMUState)(saved)

    def serialize(self, saved: Any) -> bytes:
        slave = self.slave
        return bytes(slave.serializeFMUstate(saved) if self.version == 2 else slave.serializeFMUState(saved))

    def deserialize(self, content: bytes) -> Any:
        slave = self.slave
        return slave.deSerializeFMUstate(content) if self.version == 2 else slave.deserializeFMUState(content)


def _text(message: Any) -> str:
    return message.decode() if isinstance(message, bytes) else str(message)


class Reference:
    """The Python runtime behind the same handle."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.runtime = Runtime(system, name=INSTANCE)
        self.inputs = {name: i for i, name in enumerate(scalar_names(system.input_signals))}
        self.parameters = {name: i for i, name in enumerate(scalar_names(system.parameter_signals))}
        self.states = {name: i for i, name in enumerate(scalar_names(system.states))}

    def initialize(self, start_time: float = 0.0, **starts: float) -> None:
        self.set(**starts)
        self.runtime.start(start_time)

    def set(self, **values: float) -> None:
        self.set_all(values)

    def set_all(self, values: Mapping[str, float]) -> None:
        runtime = self.runtime
        for name, value in values.items():
            for places, array in ((self.inputs, runtime.u), (self.parameters, runtime.p), (self.states, runtime.x)):
                if name in places:
                    array[places[name]] = value

    def values(self) -> np.ndarray:
        return np.concatenate([self.runtime.update_outputs(), self.runtime.x])

    def step(self, t: float, h: float) -> None:
        self.runtime.advance(t + h)
        self.runtime.communicate()


def archive(system: str | HybridSystem | Path, version: int, protocol: EventProtocol | None = None) -> Path:
    """The FMU of a system, stated by its name too, or the one that it is."""
    if isinstance(system, Path):
        return system
    made = make_system(system) if isinstance(system, str) else system
    return cached_fmu(made, version, protocol=protocol or EventProtocol())  # type: ignore[arg-type]


def kept(make: Callable[..., Any], free: Callable[[Any], None]) -> Iterator[Callable[..., Any]]:
    """A fixture that makes things, and frees them at the end."""
    alive: list[Any] = []

    def made(*arguments: Any, **keywords: Any) -> Any:
        alive.append(make(*arguments, **keywords))
        return alive[-1]

    yield made
    for one in alive:
        free(one)


@pytest.fixture
def component(unpacked: Callable[[Path], Path]) -> Iterator[Callable[..., Component]]:
    """Instances of FMUs, freed at the end: ``component(name, system or path, fmi_version)``; not yet initialised. With
    `counts`, one that is told of events by counts in FMI 3 too."""

    def make(system: str | HybridSystem | Path, version: int, logging: bool = False, counts: bool = False) -> Component:
        fmu = archive(system, version, EventProtocol("counts" if counts else None))
        made = Component(fmu, unpacked(fmu))
        made.instantiate(logging)
        return made

    yield from kept(make, lambda one: one.slave.freeInstance())


@pytest.fixture
def handle() -> type[Component]:
    """The handle on an instance itself, for an FMU that the test has unpacked."""
    return Component


@pytest.fixture
def exchange(unpacked: Callable[[Path], Path]) -> Iterator[Callable[..., Exchange]]:
    """Model exchange instances, freed at the end: ``exchange(name, system or path, fmi_version)``; not yet
    initialised.
    """

    def make(system: str | HybridSystem | Path, version: int, logging: bool = False) -> Exchange:
        fmu = archive(system, version)
        return Exchange(fmu, unpacked(fmu), logging)

    yield from kept(make, lambda one: one.model.freeInstance())


@pytest.fixture
def reference() -> Callable[[str], Reference]:
    """The Python runtime of a system, by name."""
    return lambda name: Reference(make_system(name))


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def version(request: pytest.FixtureRequest) -> int:
    """Both FMI versions."""
    return int(request.param)


@pytest.fixture(params=[*SMALL, *SHIPPED])
def system_name(request: pytest.FixtureRequest) -> str:
    """Every small system and every system that ships."""
    return str(request.param)


@pytest.fixture
def system(system_name: str) -> HybridSystem:
    """Every small system and every system that ships."""
    return make_system(system_name)


@pytest.fixture
def drive() -> Callable[..., np.ndarray]:
    """Runs a component or the reference with inputs that vary: ``drive(one, start, step, count)`` -> values after each
    step.
    """

    def run(one: Component | Reference, h: float, count: int, first: int = 0) -> np.ndarray:
        rows = []
        for k in range(first, first + count):
            one.set_all(_inputs(one, k * h))
            one.step(k * h, h)
            rows.append(one.values())
        return np.array(rows)

    return run


def _inputs(one: Component | Reference, t: float) -> dict[str, float]:
    """Continuous and discrete inputs as smooth functions of time, of a size that makes the systems move."""
    if isinstance(one, Component):
        names = [v.name for v in one.description.modelVariables if v.causality == "input"]
        clocks = {v.name for v in one.description.modelVariables if v.type == "Clock"}
        events = clocks | {name.removesuffix("_count") for name in names if name.endswith("_count")}
        payloads = {name for name in names if any(name == event or name.startswith(f"{event}_") for event in events)}
    else:
        names = list(scalar_names(one.system.inputs))
        payloads = set()
    return {name: _value(name, i, t) for i, name in enumerate(n for n in names if n not in payloads)}


def _value(name: str, i: int, t: float) -> float:
    size = {"effort": 2.0e4, "force": 4.0, "load_torque": 0.02}.get(name, 5.0)
    return size * (1.0 + np.sin(1.7 * t + i) * 1.3)

"""Small systems that between them use everything a system can declare, and a common handle on FMI 2 and FMI 3 instances."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

from fmus import RECIPES, cached_fmu, recipe
from plant_models.hybrid import (
    HybridSystem,
    PeriodicEvent,
    Runtime,
    TriggeredEvent,
    input_signal,
    memory,
    output_signal,
    parameter,
    scalar_names,
    state,
    vector,
)


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
        return u.force - p.stiffness * x[0] - p.damping * x[1] + 0.1 * np.sin(3.0 * x[0])

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[1], self._acceleration(x, u, p))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position_mm": 1000.0 * x[0], "acceleration": self._acceleration(x, u, p)}


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

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[1], u.force / p.mass, 2000.0 * (x[1] - x[2]) + 0.1 * t)

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.grip / p.mass)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed_out": x[1], "filtered_out": x[2]}


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

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        if event == "sample":
            return vector(u.wheel_speed + p.deviation * (u.first_noise + 0.5 * u.second_noise), x[1], x[2], x[3])
        return vector(x[0], x[0] + u.third_noise, x[1], x[2])

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"reading": x[0], "mean": (x[1:4] + x[0]) / 2.0}


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

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[1], 2.0 * (u.odometer - x[1]) + 0.3 * np.cos(t))

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        if event == "balise":
            innovation = u.balise_position - x[0]
            return vector(x[0] + p.gain * innovation, x[1], innovation)
        if event == "telegram":
            return vector(x[0], x[1] + u.telegram_weight * (u.telegram_speed - x[1]) + 0.1 * x[2], x[2])  # order matters
        return vector(x[0], x[1], 0.9 * x[2])

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position_out": x[0], "innovation_out": x[2]}


class Gain(HybridSystem):
    """No state at all: what goes in comes out."""

    name = "gain"
    inputs = (input_signal("force", "N", 3.0),)
    outputs = (output_signal("twice", "N"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"twice": 2.0 * u.force + t}


SMALL: dict[str, type[HybridSystem]] = {cls.name: cls for cls in (Oscillator, Slider, Sampler, Tracker, Gain)}
SHIPPED = tuple(RECIPES)


def make_system(name: str) -> HybridSystem:
    """A small system of this file, or one that ships."""
    return SMALL[name]() if name in SMALL else recipe(name)


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """FMUs of the tests are cached for the session and never in the user's own cache."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("fmu_cache")
        patch.setenv("FMU_OBSERVER_CACHE", str(folder))
        yield folder


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
        self.description = read_model_description(str(fmu), validate=False)
        self.version = int(self.description.fmiVersion[0])
        self.by_name = {v.name: v for v in self.description.modelVariables}
        self.log: list[str] = []
        identity = {
            "guid": self.description.guid,
            "unzipDirectory": str(folder),
            "modelIdentifier": self.description.coSimulation.modelIdentifier,
            "instanceName": "component",
        }
        self.slave: Any = FMU2Slave(**identity) if self.version == 2 else FMU3Slave(**identity)
        self.event_mode = self.version == 3 and self.description.coSimulation.hasEventMode

    def instantiate(self, logging: bool = False) -> None:
        if self.version == 2:
            self._callbacks = fmi2CallbackFunctions()
            self._callbacks.logger = fmi2CallbackLoggerTYPE(lambda *a: self.log.append(_text(a[4])))
            self.slave.instantiate(callbacks=self._callbacks, loggingOn=logging)
        else:
            self.slave.instantiate(
                eventModeUsed=self.event_mode, loggingOn=logging, logMessage=lambda *a: self.log.append(_text(a[3]))
            )

    def initialize(self, start_time: float = 0.0, **starts: float) -> None:
        self.set(**starts)
        if self.version == 2:
            self.slave.setupExperiment(startTime=start_time)
            self.slave.enterInitializationMode()
        else:
            self.slave.enterInitializationMode(startTime=start_time)
        self.slave.exitInitializationMode()
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
        getter = self.slave.getReal if self.version == 2 else self.slave.getFloat64
        return np.array(getter(self.references(names)))

    def values(self) -> np.ndarray:
        """All outputs and states."""
        return self.get(*(v.name for v in self.description.modelVariables if v.causality in {"output", "local"}))

    def step(self, t: float, h: float) -> None:
        self.slave.doStep(t, h)

    def event(self, name: str, stamp: float | None = None, **payload: float) -> None:
        """FMI 2: announce for the next step. FMI 3: event mode, now."""
        stamps = {} if stamp is None else {f"{name}_time": stamp}
        if self.version == 2:
            reference = self.references([f"{name}_count"])
            self.set(**payload, **stamps)
            self.slave.setInteger(reference, [self.slave.getInteger(reference)[0] + 1])
            return
        self.slave.enterEventMode()
        self.slave.setClock(self.references([name]), [True])
        self.set(**payload, **stamps)
        self.slave.updateDiscreteStates()
        self.slave.enterStepMode()

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
        self.runtime = Runtime(system)
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


@pytest.fixture
def component(unpacked: Callable[[Path], Path]) -> Iterator[Callable[..., Component]]:
    """Instances of FMUs, freed at the end: ``component(name or system, fmi_version)``; not yet initialised."""
    alive: list[Component] = []

    def make(system: str | HybridSystem, version: int, logging: bool = False) -> Component:
        fmu = cached_fmu(make_system(system) if isinstance(system, str) else system, version)  # type: ignore[arg-type]
        made = Component(fmu, unpacked(fmu))
        made.instantiate(logging)
        alive.append(made)
        return made

    yield make
    for one in alive:
        one.slave.freeInstance()


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
    """Runs a component or the reference with inputs that vary: ``drive(one, start, step, count)`` -> values after each step."""

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
        payloads = {name for name in names if name.startswith(("balise", "telegram"))}
    else:
        names = list(scalar_names(one.system.inputs))
        payloads = set()
    return {name: _value(name, i, t) for i, name in enumerate(n for n in names if n not in payloads)}


def _value(name: str, i: int, t: float) -> float:
    size = {"effort": 2.0e4, "force": 4.0}.get(name, 5.0)
    return size * (1.0 + np.sin(1.7 * t + i) * 1.3)

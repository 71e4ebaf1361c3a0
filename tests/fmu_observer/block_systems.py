"""Small hybrid systems for the tests of the block, and a handle that drives either FMI interface, or the runtime, by
names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fmu_observer.block import FMI2Block, FMI3Block, make_block
from plant_models.hybrid import HybridSystem, PeriodicEvent, Runtime, TriggeredEvent, vector
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, scalar_names, state

H = 0.05
"""Communication step of the tests [s]: five internal steps of `Swing`."""


class Swing(HybridSystem):
    """A forced, sampled, kicked and marked pendulum: nonlinear, explicit in time, noisy; its jumps do not commute."""

    name = "swing"
    description = "Pendulum with every kind of event"
    states = (
        state("angle", "rad", 0.3),
        state("rate", "rad/s"),
        memory("sample", "rad"),
        memory("sampled_at", "s", -1.0),
        memory("marks", "1", (0.0, 0.0), size=2),
    )
    inputs = (input_signal("torque", "N.m", 0.5), input_signal("wind", "N", (0.1, -0.2), size=2))
    outputs = (
        output_signal("energy", "J"),
        output_signal("last_sample", "rad", variability="discrete"),
        output_signal("net_torque", "N.m", display_unit="kN.m"),
    )
    parameters = (
        parameter("stiffness", "N.m/rad", (3.0, 0.5), size=2, min=0.0),
        parameter("damping", "N.m.s/rad", 0.2, variability="tunable"),
        parameter("period", "s", 0.07),
        parameter("offset", "s", 0.013),
    )
    events = (
        TriggeredEvent(
            "kick",
            (
                input_signal("kick_impulse", "N.m.s", variability="discrete"),
                input_signal("kick_share", "1", (0.5, 0.25), variability="discrete", size=2),
            ),
            "somebody kicks",
        ),
        PeriodicEvent("sampling", "period", "offset", noises=(input_signal("jitter", "1", variability="discrete"),)),
        TriggeredEvent("mark"),
    )
    presets: Mapping[str, Mapping[str, Any]] = {
        "soft": {"stiffness": (0.5, 0.1), "angle": 1.5, "seed": 7, "internal_step": 0.005}
    }
    internal_step = 0.01

    def _torque(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        spring = p.stiffness[0] * np.sin(x.angle) + p.stiffness[1] * x.angle**3
        return u.torque + u.wind[0] * np.sin(t) + u.wind[1] - spring - p.damping * x.rate

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"angle": x.rate, "rate": self._torque(t, x, u, p)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "energy": 0.5 * x.rate**2 + p.stiffness[0] * (1.0 - np.cos(x.angle)),
            "last_sample": x.sample,
            "net_torque": u.torque + u.wind[1] - p.damping * x.rate,
        }

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "kick":
            return {"rate": 0.9 * x.rate + u.kick_share[0] * u.kick_impulse, "sample": x.sample + u.kick_share[1]}
        if event == "mark":
            return {"rate": 0.8 * x.rate + 0.1 * u.torque * p.damping, "marks": vector(x.marks[0] + 1.0, x.rate)}
        return {"sample": x.angle + 0.1 * u.jitter, "sampled_at": t}


class Doorman(HybridSystem):
    """Ordinary Python: it branches on values, keeps no graph and cannot be traced."""

    name = "doorman"
    states = (state("travelled", "m"), memory("doors", "1"))
    inputs = (input_signal("speed", "m/s", 1.0),)
    outputs = (output_signal("travelled_out", "m"), output_signal("doors_out", "1", variability="discrete"))
    parameters = (parameter("limit", "m/s", 2.0),)
    events = (TriggeredEvent("stop", (input_signal("stop_length", "s", variability="discrete"),)),)
    traceable = False
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if u.speed > p.limit:
            return {"travelled": p.limit}
        if u.speed < 0.0:
            raise RuntimeError("no reverse gear")
        return {"travelled": float(u.speed)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"travelled_out": x.travelled, "doors_out": x.doors}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"doors": x.doors + 1.0 if u.stop_length > 20.0 else x.doors}


class Explosion(HybridSystem):
    """``dx = x^2`` with ``x(0) = 1``: without bound at t = 1 s."""

    name = "explosion"
    states = (state("x", "1", 1.0), memory("quiet", "1"), memory("noise", "1"))
    outputs = (output_signal("size", "1"),)
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": x.x * x.x}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"size": x.x}


class Driven:
    """A block driven by the names of its variables, the same way through either interface.

    An event is told with its stamp: in FMI 3 at once, in FMI 2 with the next step.
    """

    def __init__(self, system: HybridSystem, version: int, **arguments: Any) -> None:
        self.block: FMI2Block | FMI3Block = make_block(system, version, **arguments)  # type: ignore[arg-type]
        self.version = version
        self.references = {v.name: v.valueReference for v in self.block.model_description.modelVariables}
        self._set = getattr(self.block, f"set{self.block.real_type}")
        self._get = getattr(self.block, f"get{self.block.real_type}")

    def instantiate(self) -> Driven:
        self.block.instantiate(**({"eventModeUsed": True} if self.version == 3 else {}))
        return self

    def enter_initialization(self, start_time: float = 0.0) -> None:
        if self.version == 2:
            self.block.setupExperiment(startTime=start_time)
            self.block.enterInitializationMode()
        else:
            self.block.enterInitializationMode(startTime=start_time)

    def exit_initialization(self) -> None:
        self.block.exitInitializationMode()
        if self.version == 3:
            self.block.updateDiscreteStates()
            self.block.enterStepMode()

    def start(self, start_time: float = 0.0, **starts: float) -> Driven:
        """From anywhere to step mode at `start_time`."""
        self.instantiate()
        self.set(**starts)
        self.enter_initialization(start_time)
        self.exit_initialization()
        return self

    def vr(self, *names: str) -> list[int]:
        return [self.references[name] for name in names]

    def set(self, **values: float) -> None:
        self.set_all(values)

    def set_all(self, values: Mapping[str, float]) -> None:
        self._set(self.vr(*values), list(values.values()))

    def get(self, *names: str) -> np.ndarray:
        return np.array(self._get(self.vr(*names)))

    def step(self, t: float, h: float = H) -> None:
        self.block.doStep(t, h)

    def event(self, name: str, stamp: float | None = None, payload: Mapping[str, float] | None = None) -> None:
        values = dict(payload or {}) | ({} if stamp is None else {f"{name}_time": stamp})
        if self.version == 2:
            count = self.vr(f"{name}_count")
            self.set_all(values)
            self.block.setInteger(count, [self.block.getInteger(count)[0] + 1])
            return
        self.block.enterEventMode()
        self.block.setClock(self.vr(name), [True])
        self.set_all(values)
        self.block.updateDiscreteStates()
        self.block.enterStepMode()

    def everything(self) -> np.ndarray:
        """All real variables."""
        description = self.block.model_description
        real = [v.name for v in description.modelVariables if v.type in ("Real", "Float64")]
        return self.get(*real)

    def what_matters(self) -> np.ndarray:
        """All real variables but the payloads: those stand as they were set last and are read only at their own
        events.
        """
        payloads = {name for event in self.block.system.triggered_events for name in scalar_names(event.payload)}
        variables = self.block.model_description.modelVariables
        return self.get(*(v.name for v in variables if v.type in ("Real", "Float64") and v.name not in payloads))


class Reference:
    """The bare runtime behind the same names, events told in the order of their stamps."""

    def __init__(self, system: HybridSystem) -> None:
        self.system, self.runtime = system, Runtime(system)

    def start(self, start_time: float = 0.0, **starts: float) -> Reference:
        self.runtime.reset()
        self.set_all(starts)
        self.runtime.start(start_time)
        return self

    def set_all(self, values: Mapping[str, float]) -> None:
        system, runtime = self.system, self.runtime
        groups = ((system.input_signals, runtime.u), (system.states, runtime.x), (system.parameter_signals, runtime.p))
        for signals, array in groups:
            names = scalar_names(signals)
            for name in set(values) & set(names):
                array[names.index(name)] = values[name]

    def step(self, t: float, h: float = H, events: Sequence[tuple[float, str, Mapping[str, float]]] = ()) -> None:
        """Advance through the events, which are given as (stamp, name, payload), sorted."""
        for stamp, name, payload in events:
            self.runtime.advance(stamp)
            self.set_all(payload)
            self.runtime.trigger(name)
        self.runtime.advance(t + h)

    def values(self) -> np.ndarray:
        """Outputs and state."""
        return np.concatenate([self.runtime.update_outputs(), self.runtime.x])


SWING = Swing()
"""One object for all tests: it is traced once."""


def weather(k: int) -> dict[str, float]:
    """What is set before step number `k` of `Swing`: inputs proper and the tunable parameter."""
    return {
        "torque": float(np.sin(0.7 * k)),
        "wind[1]": 0.3 * float(np.cos(1.3 * k)),
        "wind[2]": 0.01 * k,
        "damping": 0.2 + 0.1 * float(np.sin(0.4 * k)),
    }


def kick(impulse: float) -> dict[str, float]:
    """Payload of a kick of `Swing`."""
    return {"kick_impulse": impulse, "kick_share[1]": 0.5 + 0.1 * impulse, "kick_share[2]": -0.1 * impulse}

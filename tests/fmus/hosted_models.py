"""Models in ordinary Python for the tests of hosted FMUs: loops and branches on values, which no tracer can follow."""

from __future__ import annotations

from statistics import mean
from typing import Any

import numpy as np
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

from plant_models.hybrid import HybridSystem, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state


class Gatekeeper(HybridSystem):
    """Counts train crossings and decides with loops and branches; sampled, marked and noisy."""

    name = "gatekeeper"
    description = "Ordinary Python with every kind of event"
    states = (state("place", "m", 1.0), memory("passed", "1"), memory("sample", "m"), memory("last", "m"))
    inputs = (input_signal("speed", "m/s", 1.0),)
    outputs = (output_signal("doubled", "m"), output_signal("passed_out", "1", variability="discrete"))
    parameters = (parameter("limit", "m/s", 2.0), parameter("period", "s", 0.07), parameter("offset", "s", 0.013))
    events = (
        TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),)),
        PeriodicEvent("sampling", "period", "offset", noises=(input_signal("jitter", "1", variability="discrete"),)),
    )
    traceable = False
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if u.speed < 0.0:
            mean(())  # FAILS HERE, and deeper inside a library
        speed, share = 0.0, u.speed
        while share > 0.1:
            share /= 2.0
            speed += share
        return {"place": min(speed, p.limit) - 0.01 * x.place * x.passed}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"doubled": 2.0 * x.place, "passed_out": x.passed}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "balise":
            return {"place": 0.7 * x.place + 0.3 * u.balise_position, "passed": x.passed + 1.0, "last": t * x.place}
        return {"sample": x.place + 0.1 * u.jitter}


class Needy(Gatekeeper):
    """A model with an option, and one value of it that it cannot take."""

    name = "needy"

    def __init__(self, gain: float = 1.0) -> None:
        if gain < 0.0:
            raise ValueError("gain must not be negative")
        super().__init__()
        self.gain = gain


class Lister:
    """No hybrid system but an object with the calls of a block: keeps all that it was ever given in a list."""

    def __init__(self) -> None:
        real = {"type": "Real", "python_type": float}
        u = ModelVariable(name="u", valueReference=0, causality="input", variability="continuous", start="0.0", **real)
        y = ModelVariable(
            name="y", valueReference=1, causality="output", variability="continuous", initial="calculated", **real
        )
        self.model_description = ModelDescription(
            fmiVersion="2.0",
            modelName="lister",
            description="A list",
            instantiationToken="{1}",
            variableNamingConvention="flat",
            coSimulation=CoSimulation(modelIdentifier="lister", canGetAndSetFMUstate=True, canSerializeFMUstate=True),
            modelVariables=[u, y],
            outputs=[Unknown(index=2, variable=y)],
            initialUnknowns=[Unknown(index=2, variable=y)],
        )
        self.instantiate()

    def instantiate(self) -> None:
        self.u, self.past = 0.0, []  # type: float, list[float]

    def setupExperiment(self, *_: Any) -> None:
        pass

    enterInitializationMode = exitInitializationMode = terminate = reset = setupExperiment

    def doStep(self, t: float, h: float) -> None:
        self.past.append(self.u * h)

    def getReal(self, vr: list[int]) -> list[float]:
        return [self.u if reference == 0 else sum(self.past) for reference in vr]

    def setReal(self, vr: list[int], value: list[float]) -> None:
        self.u = value[-1]

    def getFMUstate(self) -> list[float]:
        return [self.u, *self.past]

    def setFMUstate(self, saved: list[float]) -> None:
        self.u, *self.past = saved

    def serializeFMUstate(self, saved: list[float]) -> bytes:
        return np.array(saved).tobytes()

    def deSerializeFMUstate(self, content: bytes) -> list[float]:
        return list(np.frombuffer(content))


def not_a_block() -> object:
    """Makes nothing that could be hosted."""
    return object()

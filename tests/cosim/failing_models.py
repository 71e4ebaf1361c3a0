"""Components that fail at 0.3 s in words of their own, one for each way in which a component can be written."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.observers.train import DiscreteMeasurementObserver
from plant_models.hybrid import HybridSystem, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.signal import input_signal, output_signal, parameter, state

WORDS = "the table of the boiler ends at 12 bar"
FROM = 0.29  # [s]


def fail(t: Any, begin: float = FROM) -> None:
    if float(t) > begin:
        raise ValueError(WORDS)


class InFlow(HybridSystem):
    name = "failing"
    traceable = False
    internal_step = 0.01
    states = (state("x", "m", 0.0, "State"),)
    inputs = (input_signal("measured", "m", 0.0, "Measured"),)
    outputs = (output_signal("y", "m", "State"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        fail(t)
        return {"x": 1.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.x}


class InOutput(InFlow):
    description = "Fails in its outputs"

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": 1.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        fail(t)
        return {"y": x.x}


class InSample(InFlow):
    description = "Fails at a sample"
    parameters = (parameter("period", "s", 0.1, "Period"),)
    events = (PeriodicEvent("tick", "period"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": 1.0}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        fail(t)
        return {}


class InPacket(InSample):
    description = "Fails when a packet comes"
    parameters = ()
    events = (TriggeredEvent("packet", (input_signal("packet_z", "m", 0.0, "Z", variability="discrete"),), "A packet"),)


class Traced(InFlow):
    """Fails as soon as its equations are looked at: what is traced knows no time."""

    traceable = True

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        raise RuntimeError(WORDS)


class Worn(InFlow):
    """Fails from a time on that a scenario tells."""

    parameters = (parameter("from_when", "s", 0.29, "From then on"), parameter("gain", "1/s", 1.0, "Gain", min=0.0))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        fail(t, p.from_when)
        return {"x": p.gain * (1.0 - x.x)}


class Evaluated(DiscreteMeasurementObserver):
    """Fails where it is asked for what it knows of itself."""

    def error_bounds(self, *_: Any) -> Any:
        raise RuntimeError(WORDS)

    def findings(self, *_: Any) -> Any:
        raise RuntimeError(WORDS)


class PlainStep:
    """Plain Python that fails in a step."""

    inputs = {"measured": "m"}  # noqa: RUF012 - as a user writes it
    outputs = {"y": "m"}  # noqa: RUF012

    def __init__(self) -> None:
        self.y = 0.0

    def step(self, t: float, inputs: Any, h: float) -> None:
        fail(t)


class PlainStart(PlainStep):
    """Plain Python that fails when it is made."""

    def __init__(self) -> None:
        fail(np.inf)


class Sine(HybridSystem):
    name = "sine"
    outputs = (output_signal("y", "m", "Sine"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": np.sin(t)}


class PlainSpeed:
    """A plain observer that fails in a step."""

    inputs = ("odometer",)
    outputs = ("speed",)

    def __init__(self) -> None:
        self.speed = 0.0

    def step(self, t: float, inputs: Any, h: float) -> None:
        fail(t)

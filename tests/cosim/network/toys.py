"""A source, a listener and scenarios of them for the tests of networks."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim import Outcome, Scenario
from plant_models.hybrid import HybridSystem, TriggeredEvent, vector
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state

STOP = 2.0


class Source(HybridSystem):
    """Outputs that are known at any time: ``3 sin(2 t)``, ``cos(2 t)`` and a ramp."""

    name = "source"
    internal_step = 1e-3
    states = (state("ramp", "m", 0.0, "Ramp"),)
    outputs = (
        output_signal("sine", "m", "Sine"),
        output_signal("cosine", "m", "Cosine"),
        output_signal("ramp_value", "m", "Ramp"),
    )
    parameters = (parameter("rate", "m/s", 1.0, "Slope of the ramp"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"ramp": p.rate}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"sine": 3.0 * np.sin(2.0 * t), "cosine": np.cos(2.0 * t), "ramp_value": x.ramp}


class Listener(HybridSystem):
    """Integrates `speed`, and is set to what packets of node 2 say; remembers all that it was told."""

    name = "listener"
    internal_step = 1e-2
    states = (
        state("place", "m", 0.0, "Integral"),
        memory("reported", "m", 0.0, "Last values told", size=2),
        memory("count", "1", 0.0, "Packets told"),
    )
    inputs = (input_signal("speed", "m/s", 1.0, "Speed"), input_signal("held", "m", 0.0, "A held value"))
    outputs = (
        output_signal("estimate", "m", "Estimate"),
        output_signal("first", "m", "First value told", variability="discrete"),
        output_signal("second", "m", "Second value told", variability="discrete"),
        output_signal("packets", "1", "Packets told", variability="discrete"),
        output_signal("passed_on", "m", "The held input"),
    )
    events = (
        TriggeredEvent(
            "packet",
            tuple(
                input_signal(f"packet_{name}", "m" if name != "node" else "1", 0.0, name, variability="discrete")
                for name in ("first", "second", "node")
            ),
            "A packet",
        ),
    )

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.speed}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        place = np.where(u.packet_node == 2.0, u.packet_second, x.place)
        return {"place": place, "reported": vector(u.packet_first, u.packet_second), "count": x.count + 1.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "estimate": x.place,
            "first": x.reported[0],
            "second": x.reported[1],
            "packets": x.count,
            "passed_on": u.held,
        }


def scenario(step: float = 0.01, backend: str = "block3", stop: float = STOP, **network: Any) -> Scenario:
    """A source whose sine and ramp go over a network to a listener, by events, and whose cosine it holds."""
    made = Scenario(stop=stop, step=step)
    made.add("source", model=Source, **{"as": backend})
    made.add("listener", model=Listener, **{"as": backend})
    made.connect(
        "source.sine -> listener.packet_first",
        "source.ramp_value -> listener.packet_second",
        "source.cosine -> listener.held",
    )
    nodes = {"front": ["source.sine", "source.cosine"], "rear": ["source.ramp_value"]}
    return made.network(**({"nodes": nodes, "period": 0.037} | network))


def run(step: float = 0.01, backend: str = "block3", stop: float = STOP, **network: Any) -> Outcome:
    """The same, run."""
    outcome = scenario(step, backend, stop, **network).run(warn=lambda _: None)
    assert outcome.failure is None, outcome.failure
    return outcome

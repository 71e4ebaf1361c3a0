"""Small hybrid systems with closed forms, for the tests of the foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import HybridSystem, PeriodicEvent, TriggeredEvent, vector
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state


class Hyperbola(HybridSystem):
    """``dx = -2 t x^2`` with ``x(0) = 1``: ``x = 1 / (1 + t^2)``. Nonlinear and explicit in time."""

    name = "hyperbola"
    states = (state("x", "1", 1.0),)
    outputs = (output_signal("y", "1"),)
    internal_step = 0.1

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -2.0 * t * x.x * x.x}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.x}


class ImplicitHyperbola(Hyperbola):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class Stiff(HybridSystem):
    """``dx = -rate (x - cos t) - sin t`` with ``x(0) = 1``: ``x = cos t`` at any rate."""

    name = "stiff"
    states = (state("x", "1", 1.0),)
    parameters = (parameter("rate", "1/s", 1e6),)
    method = "rosenbrock"
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -p.rate * (x.x - np.cos(t)) - np.sin(t)}


class Clockwork(HybridSystem):
    """A damped oscillator that is sampled, kicked and measured: every feature of the foundation at once."""

    name = "clockwork"
    states = (
        state("position_state", "m", 1.0),
        state("speed_state", "m/s", 0.0),
        memory("sample", "m"),
        memory("sample_time", "s", -1.0),
        memory("samples", "1"),
        memory("drawn", "1"),
        memory("kicks", "1"),
    )
    inputs = (input_signal("force", "N", 0.5),)
    outputs = (output_signal("energy", "J"), output_signal("last", "m", variability="discrete"))
    parameters = (
        parameter("stiffness", "N/m", (3.0, 0.5), size=2),
        parameter("period", "s", 0.07),
        parameter("offset", "s", 0.013),
    )
    events = (
        PeriodicEvent("sampling", "period", "offset", noises=(input_signal("jitter", "1", variability="discrete"),)),
        TriggeredEvent("kick", (input_signal("kick_impulse", "N.s", variability="discrete"),)),
    )
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        spring = p.stiffness[0] * x.position_state + p.stiffness[1] * x.position_state**3
        return {"position_state": x.speed_state, "speed_state": u.force + np.sin(t) - spring - 0.2 * x.speed_state}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"energy": 0.5 * x.speed_state**2 + 0.5 * p.stiffness[0] * x.position_state**2, "last": x.sample}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "sampling":
            return {
                "sample": x.position_state + 0.1 * u.jitter,
                "sample_time": t,
                "samples": x.samples + 1.0,
                "drawn": u.jitter,
            }
        return {"speed_state": x.speed_state + u.kick_impulse, "kicks": x.kicks + 1.0}


class ImplicitClockwork(Clockwork):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class Slider(HybridSystem):
    """A block on a rough floor: ``dv = a(t) - friction``; dry friction alone decides when it stops and when it
    starts.
    """

    name = "slider"
    states = (state("x", "m"), state("v", "m/s", 1.0))
    inputs = (input_signal("push", "m/s2"),)
    outputs = (output_signal("speed", "m/s"),)
    parameters = (parameter("friction_level", "m/s2", 0.5),)
    frictions = ("v",)
    internal_step = 1e-2

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": x.v, "v": u.push}

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.friction_level)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x.v}


class Booster(HybridSystem):
    """A body pushed by 3 m/s2 on one stretch of its way and by 2 m/s2 in one span of time: a parabola between
    switches.
    """

    name = "booster"
    states = (state("place", "m"), state("rate", "m/s", 1.0))
    outputs = (output_signal("speed", "m/s"), output_signal("pushed", "m/s2"))
    parameters = (parameter("stretch", "m", (0.25, 0.6), size=2), parameter("span", "s", (0.3141, 0.7), size=2))
    switchings = ("stretch[1]", "stretch[2]", "span[1]", "span[2]")
    internal_step = 0.01

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        place, now = x.place, t + 0.0 * x.place
        return vector(place - p.stretch[0], place - p.stretch[1], now - p.span[0], now - p.span[1])

    def requirements(self, p: Any) -> dict[str, Any]:
        return {"the stretch has no length": np.where(p.stretch[1] > p.stretch[0], 1.0, 0.0)}

    def _push(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        passed = self.switches(t, x, u, p)
        return 3.0 * (passed[0] - passed[1]) + 2.0 * (passed[2] - passed[3])

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": x.rate, "rate": self._push(t, x, u, p)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x.rate, "pushed": self._push(t, x, u, p)}


class ImplicitBooster(Booster):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class ImplicitSlider(Slider):
    """The same by the linearly implicit step."""

    method = "rosenbrock"

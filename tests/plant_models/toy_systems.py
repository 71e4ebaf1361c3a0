"""Small hybrid systems with closed forms, for the tests of the foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import (
    HybridSystem,
    PeriodicEvent,
    TriggeredEvent,
    input_signal,
    memory,
    output_signal,
    parameter,
    state,
    vector,
)


class Hyperbola(HybridSystem):
    """``dx = -2 t x^2`` with ``x(0) = 1``: ``x = 1 / (1 + t^2)``. Nonlinear and explicit in time."""

    by_name = False

    name = "hyperbola"
    states = (state("x", "1", 1.0),)
    outputs = (output_signal("y", "1"),)
    internal_step = 0.1

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(-2.0 * t * x[0] * x[0])

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x[0]}


class ImplicitHyperbola(Hyperbola):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class Stiff(HybridSystem):
    """``dx = -rate (x - cos t) - sin t`` with ``x(0) = 1``: ``x = cos t`` at any rate."""

    by_name = False

    name = "stiff"
    states = (state("x", "1", 1.0),)
    parameters = (parameter("rate", "1/s", 1e6),)
    method = "rosenbrock"
    internal_step = 0.01

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(-p.rate * (x[0] - np.cos(t)) - np.sin(t))


class Clockwork(HybridSystem):
    """A damped oscillator that is sampled, kicked and measured: every feature of the foundation at once."""

    by_name = False

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

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        spring = p.stiffness[0] * x[0] + p.stiffness[1] * x[0] ** 3
        return vector(x[1], u.force + np.sin(t) - spring - 0.2 * x[1])

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"energy": 0.5 * x[1] ** 2 + 0.5 * p.stiffness[0] * x[0] ** 2, "last": x[2]}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        if event == "sampling":
            return vector(x[0], x[1], x[0] + 0.1 * u.jitter, t, x[4] + 1.0, u.jitter, x[6])
        return vector(x[0], x[1] + u.kick_impulse, x[2], x[3], x[4], x[5], x[6] + 1.0)


class ImplicitClockwork(Clockwork):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class Slider(HybridSystem):
    """A block on a rough floor: ``dv = a(t) - friction``; dry friction alone decides when it stops and when it
    starts.
    """

    by_name = False

    name = "slider"
    states = (state("x", "m"), state("v", "m/s", 1.0))
    inputs = (input_signal("push", "m/s2"),)
    outputs = (output_signal("speed", "m/s"),)
    parameters = (parameter("friction_level", "m/s2", 0.5),)
    frictions = ("v",)
    internal_step = 1e-2

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[1], u.push)

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(p.friction_level)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x[1]}


class Booster(HybridSystem):
    """A body pushed by 3 m/s2 on one stretch of its way and by 2 m/s2 in one span of time: a parabola between
    switches.
    """

    by_name = False

    name = "booster"
    states = (state("place", "m"), state("rate", "m/s", 1.0))
    outputs = (output_signal("speed", "m/s"), output_signal("pushed", "m/s2"))
    parameters = (parameter("stretch", "m", (0.25, 0.6), size=2), parameter("span", "s", (0.3141, 0.7), size=2))
    switchings = ("stretch[1]", "stretch[2]", "span[1]", "span[2]")
    internal_step = 0.01

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[0] - p.stretch[0], x[0] - p.stretch[1], t - p.span[0] + 0.0 * x[0], t - p.span[1] + 0.0 * x[0])

    def requirements(self, p: Any) -> dict[str, Any]:
        return {"the stretch has no length": np.where(p.stretch[1] > p.stretch[0], 1.0, 0.0)}

    def _push(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        passed = self.switches(t, x, u, p)
        return 3.0 * (passed[0] - passed[1]) + 2.0 * (passed[2] - passed[3])

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x[1], self._push(t, x, u, p))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"speed": x[1], "pushed": self._push(t, x, u, p)}


class ImplicitBooster(Booster):
    """The same by the linearly implicit step."""

    method = "rosenbrock"


class ImplicitSlider(Slider):
    """The same by the linearly implicit step."""

    method = "rosenbrock"

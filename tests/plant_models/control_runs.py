"""What the tests of the controllers share: named inputs, one look at a time, and closed loops on masses and trains."""

from __future__ import annotations

from typing import Any

import numpy as np
from railway_runs import outputs, started

from plant_models.hybrid import HybridSystem, Runtime, scalar_names
from plant_models.railway.control import Mission


class Controller:
    """A controller whose inputs are set and whose memory is read by name; `at(t)` moves it there."""

    def __init__(
        self, system: HybridSystem, preset: str | None = None, start: dict[str, float] | None = None, **changes: float
    ):
        self.system = system
        self.inputs = list(scalar_names(system.input_signals))
        self.states = list(scalar_names(system.states))
        self.runtime: Runtime = started(system, preset, u0=self._array(start or {}), **changes)

    def _array(self, values: dict[str, float]) -> np.ndarray:
        u = self.system.start_inputs()
        for name, value in values.items():
            u[self.inputs.index(name)] = value
        return u

    def at(self, t: float, **inputs: float) -> dict[str, float]:
        """Set inputs by name (others stay), move to `t`, and return the outputs."""
        for name, value in inputs.items():
            self.runtime.u[self.inputs.index(name)] = value
        self.runtime.advance(t)
        return outputs(self.runtime)

    def memory(self, name: str) -> float:
        """One state by name."""
        return float(self.runtime.x[self.states.index(name)])

    def set(self, **values: float) -> None:
        """Overwrite states by name."""
        for name, value in values.items():
            self.runtime.x[self.states.index(name)] = value


def journey(
    train: Runtime, controller: Controller, mission: Runtime, duration: float, step: float = 0.1
) -> dict[str, np.ndarray]:
    """Mission, controller and train in one loop with perfect estimates, exchanged every `step` [s]: every output by
    name.
    """
    rows = []
    air = [i for i, s in enumerate(train.system.inputs) if s.name == "brake_demand"]
    assert isinstance(mission.system, Mission)
    for k in range(round(duration / step) + 1):
        t = k * step
        train.advance(t)
        seen = outputs(train)
        if mission.system.inputs:
            mission.u[0] = seen["position"]
        mission.advance(t)
        plan = outputs(mission)
        reported = {name: value for name, value in estimates(seen, plan).items() if name in controller.inputs}
        asked = controller.at(t, **reported)
        train.u[0] = asked["effort"]
        for i in air:
            train.u[i] = asked["brake_demand"]
        rows.append({"time": t, **seen, **plan, **asked, "estimated_slip": estimates(seen, plan)["slip"]})
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def estimates(seen: dict[str, float], plan: dict[str, float]) -> dict[str, Any]:
    """What a perfect observer would tell a controller of a train."""
    wheel, speed = seen["wheel_speed"], seen["speed"]
    slip = (wheel - speed) / max(abs(wheel), 0.5)
    return {
        "odometer": wheel,
        "speed": speed,
        "slip": slip,
        "adhesion_force": seen["adhesion_force"],
        "adhesion_condition": 2.0 if abs(slip) > 0.02 and max(abs(wheel), abs(speed)) > 0.5 else 1.0,
        "coupler_force": seen.get("coupler_force[1]", 0.0),
        "speed_reference": plan["speed_reference"],
        "acceleration_reference": plan["acceleration_reference"],
    }

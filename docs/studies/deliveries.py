"""New deliveries of the locomotive, each with one thing changed. They are built as FMUs of the same model name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from plant_models.hybrid import CommunicationEvent, memory, output_signal
from plant_models.railway.vehicle.locomotive import Locomotive

KMH = 3.6  # km/h in a metre a second


def _outputs(without: str = "", **changes: Mapping[str, Any]) -> Any:
    """The outputs of the locomotive, one left out or with other attributes."""
    return tuple(replace(s, **changes.get(s.name, {})) for s in Locomotive.outputs if s.name != without)


class SignOfOutput(Locomotive):
    """Acceleration with the other sign."""

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        return {**stated, "acceleration": -stated["acceleration"]}


class SignOfInput(Locomotive):
    """Traction brakes, and a brake drives."""

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return super().flow(t, x, u._replace(effort=-u.effort), p)

    def friction(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return super().friction(t, x, u._replace(effort=-u.effort), p)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return super().output(t, x, u._replace(effort=-u.effort), p)


class _OtherWheelSpeed(Locomotive):
    """Another unit, or other numbers, for the speed of the wheel."""

    unit, factor = "m/s", 1.0

    def __init__(self) -> None:
        super().__init__()
        self.outputs = _outputs(wheel_speed={"unit": self.unit, "display_unit": None})

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        return {**stated, "wheel_speed": self.factor * stated["wheel_speed"]}


class OtherUnit(_OtherWheelSpeed):
    """Declared in km/h, and in km/h."""

    unit, factor = "km/h", KMH


class WrongUnit(_OtherWheelSpeed):
    """Declared in km/h, but still in m/s."""

    unit = "km/h"


class WrongNumbers(_OtherWheelSpeed):
    """Declared in m/s, but in km/h."""

    factor = KMH


class NoUnit(_OtherWheelSpeed):
    """A pure number."""

    unit = "1"


class Renamed(Locomotive):
    """Slip under another name."""

    outputs = _outputs(slip={"name": "creepage"})

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        slip = stated.pop("slip")
        return {**stated, "creepage": slip}


class Swapped(Locomotive):
    """Two forces in each other's place."""

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        return {**stated, "adhesion_force": stated["gradient_force"], "gradient_force": stated["adhesion_force"]}


class Dropped(Locomotive):
    """One output less."""

    outputs = _outputs("gradient_force")

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        del stated["gradient_force"]
        return stated


class Added(Locomotive):
    """One output more."""

    outputs: Any = (*Locomotive.outputs, output_signal("wheel_rotation", "rad/s", "Angular speed of the wheel"))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {**super().output(t, x, u, p), "wheel_rotation": x.wheel_rate}


class OtherDefault(Locomotive):
    """Mass 1 % larger by default; nobody sets it."""

    presets: Mapping[str, Any] = {
        **Locomotive.presets,
        "chapter_3": {**Locomotive.presets["chapter_3"], "mass": 90.9e3},
    }


class HalfStep(Locomotive):
    """Half the internal step."""

    internal_step = Locomotive.internal_step / 2.0


class DoubleStep(Locomotive):
    """Twice the internal step."""

    internal_step = Locomotive.internal_step * 2.0


class CoarseStep(Locomotive):
    """An internal step of a hundredth of a second."""

    internal_step = 1e-2


class Gain(Locomotive):
    """Every output 1 % larger."""

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {name: 1.01 * value for name, value in super().output(t, x, u, p).items()}


class OneSampleLate(Locomotive):
    """The speeds of train and wheel are those of the communication point before, which both ends of a step sample."""

    states: Any = (
        *Locomotive.states,
        *(memory(f"{age}_{name}", "m/s") for age in ("last", "former") for name in ("speed", "wheel_speed")),
    )
    events = (CommunicationEvent("sampling", description="Speeds are sampled"),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        now = super().output(t, x, u, p)
        return {
            "former_speed": x.last_speed,
            "former_wheel_speed": x.last_wheel_speed,
            "last_speed": now["speed"],
            "last_wheel_speed": now["wheel_speed"],
        }

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        stated = super().output(t, x, u, p)
        return {**stated, "speed": x.former_speed, "wheel_speed": x.former_wheel_speed}

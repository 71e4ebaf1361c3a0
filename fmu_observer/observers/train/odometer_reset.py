"""The plainest train observer: the odometer, integrated, and reset at balises. What all others are compared with."""

from __future__ import annotations

from typing import Any

from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.innovation_gate import WARN
from fmu_observer.observers.train.train_signals import BALISE, INNOVATION_OUTPUT, LAST_INNOVATION, ODOMETER, POSITION
from plant_models.hybrid import Array, output_signal


class OdometerReset(GatedObserver):
    """Sensor only: ``dp = y``, and ``p = p_B`` at a balise: Aguiar Cota 2019, section 3.3.2.

    The speed is the odometer's. A jam makes the position lag until the next balise, a skid makes it lead. It believes
    every balise (its `gate` starts as 1: doubted ones are used and counted), for whoever has only an odometer cannot
    say which of the two lies.
    """

    name = "odometer_reset"
    description = "Integrated odometer, reset at balises"
    source = "Aguiar Cota 2019, section 3.3.2"
    internal_step = 1e-2  # the flow is exact for a held input, whatever the step
    gate_start = WARN
    weighing = "position"
    states = (POSITION, LAST_INNOVATION)
    inputs = (ODOMETER,)
    outputs = (
        output_signal("position", "m", "Position of the odometer"),
        output_signal("speed", "m/s", "Speed of the odometer", display_unit="km/h"),
        INNOVATION_OUTPUT,
    )
    events = (BALISE,)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {POSITION.name: u.odometer}

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The position is that of the balise."""
        reported = u.balise_position
        return {POSITION.name: reported, "last_innovation": x.estimated_position - reported}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"position": x.estimated_position, "speed": u.odometer, "innovation": x.last_innovation}

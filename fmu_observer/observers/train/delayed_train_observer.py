"""The train whose odometer and balises are two nodes of a network: position and speed now from late measurements."""

from __future__ import annotations

from typing import Any, Self

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.small_gain import independent_gap_limit, with_independent_samples
from fmu_observer.models.train.freight_train_model import networked_train
from fmu_observer.observers.generic.delayed.delayed_state_observer import (
    BETWEEN,
    MEMORY_PLACES,
    Between,
    DelayedStateObserver,
)
from plant_models.hybrid import Array, TriggeredEvent, input_signal, vector


class DelayedTrainObserver(DelayedStateObserver):
    """The `delayed_state_observer` of a train with two nodes, notified of each by an event of its own: the odometer by
    `packet`, balises by `balise`, all a constant `delay` after their measurement.

    Both act when they arrive, not at their stamps; a balise passes the gate of all train observers, against the
    position a delay ago. Between two balises the position follows from the speed, between two packets the speed from
    the effort. The train is that of the model `networked_train`: 90 t, with the resistance of Bouchama 2024, chapter 3;
    it has no wheelset, so what it knows of a slipping wheel is the odometer.

    Args:
        predictors, memory_places, between_samples: as for `delayed_state_observer`.

    Raises:
        ValueError: an option is not legal.
    """

    name = "delayed_train_observer"
    description = "Train observer: position and speed now, from late odometer packets and late balises"
    source = "Hann 2014, (2.16), (2.57); the train by Bouchama 2024, (3.24)-(3.25)"
    theta_start = 2.0  # [1/s] [ours]
    option_choices = {"predictors": (1, 0, 2, 3), "between_samples": BETWEEN}

    def __init__(
        self, *, predictors: int = 1, memory_places: int = MEMORY_PLACES, between_samples: Between = "predicted"
    ) -> None:
        super().__init__(
            networked_train(), predictors=predictors, memory_places=memory_places, between_samples=between_samples
        )
        del self.options["model"], self.options["nodes"]

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A balise sets the position a delay ago, a packet the speed; a reading moves memory on."""
        if event == "reading":
            return super().update(event, t, x, u, p)
        position, speed = self.sampled_part(x)
        after = (u.balise_position, speed) if event == "balise" else (position, u.packet_speed)
        return self.named_part(vector(*after))

    @property
    def certified_turns(self) -> tuple[tuple[int, ...], ...]:
        """Both measurements together; that they come each at its own instants is checked beside it."""
        return (tuple(range(self.outputs_count)),)

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate where balises and packets come together, and a small-gain condition where they do not."""
        found, n = super().gap_finding(gap, p), self.model.order
        errors = [self.error_generator(drift, p) for drift in self.model.drifts]
        limits = [independent_gap_limit(e[:n, :n], e[:n, n:], e[n:, :n], e[n:, n:]) for e in errors]
        return with_independent_samples(found, min(limits))

    @property
    def node_events(self) -> tuple[str, ...]:
        """Balises show the position, packets the speed."""
        return ("balise", "packet")

    def remembering(self, memory_places: int) -> Self:
        """The same observer with another memory.

        Args:
            memory_places: see the class.
        """
        between: Between = "predicted" if self.predicts_output else "held"
        return type(self)(predictors=self.predictors, memory_places=memory_places, between_samples=between)

    def _events(self) -> tuple[Any, ...]:
        position, speed = self.model.measurements
        balise = input_signal("balise_position", "m", 0.0, position.description, variability="discrete")
        packet = input_signal("packet_speed", "m/s", 0.0, speed.description, variability="discrete")
        *_, reading = super()._events()
        return (
            TriggeredEvent("balise", (balise,), "The telegram of a balise arrives, a delay after its passing"),
            TriggeredEvent(
                "packet",
                (packet,),
                "A packet of the odometer arrives, a delay after its measurement",
                samples=(packet.name,),
            ),
            reading,
        )

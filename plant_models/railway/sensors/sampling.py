"""The instants at which a sensor is read, each with its noise. It knows only the hybrid foundation."""

from __future__ import annotations

from plant_models.hybrid import PeriodicEvent, standard_normal

READING_NOISE = standard_normal("reading_noise", "Standard normal number of this reading")


def sampling_event(description: str, offset: str | None = None) -> PeriodicEvent:
    """The periodic event of a sensor: its period is the parameter `sample_period`, its noise `reading_noise`.

    Args:
        description: one line. offset: parameter with the time of the first reading after the start; None for zero.
    """
    return PeriodicEvent("sampling", "sample_period", offset, noises=(READING_NOISE,), description=description)

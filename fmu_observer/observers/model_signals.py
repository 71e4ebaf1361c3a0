"""Signals of an observer that follow from those of its model: estimates, measurements, matrices of gains and noises.

It knows signals and events, and nothing of observers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from plant_models.hybrid import PeriodicEvent, TriggeredEvent
from plant_models.hybrid.signal import Signal, Variability, input_signal, memory, output_signal, parameter, state

LAST_NIS = memory("last_nis", "1", 0.0, "Last normalised innovation squared")
LOG_LIKELIHOOD = memory("log_likelihood", "1", 0.0, "Logarithm of the likelihood of all innovations so far")


def estimate_states(
    signals: Iterable[Signal], kind: Callable[..., Signal] = state, prefix: str = "estimated_"
) -> tuple[Signal, ...]:
    """A state for the estimate of each signal, which starts where it does.

    Args:
        signals: of the model. kind: `state` or `memory`. prefix: of the names.
    """
    return tuple(kind(f"{prefix}{s.name}", s.unit, s.start, f"Estimate: {s.description}") for s in signals)


def estimate_outputs(signals: Iterable[Signal], kind: Callable[..., Signal] = output_signal) -> tuple[Signal, ...]:
    """An output for the estimate of each signal, under its own name.

    Args:
        signals: of the model. kind: `output_signal` or `discrete_output`.
    """
    return tuple(kind(s.name, s.unit, f"Estimate: {s.description}") for s in signals)


def deviation_outputs(signals: Iterable[Signal], kind: Callable[..., Signal] = output_signal) -> tuple[Signal, ...]:
    """An output ``<name>_std`` for each signal, the standard deviation of its estimate.

    Args:
        signals: of the model. kind: `output_signal` or `discrete_output`.
    """
    return tuple(kind(f"{s.name}_std", s.unit, f"Standard deviation of the estimate: {s.description}") for s in signals)


def measured_inputs(
    signals: Iterable[Signal], prefix: str = "measured_", variability: Variability = "continuous"
) -> tuple[Signal, ...]:
    """An input for each measurement.

    Args:
        signals: measurements of the model. prefix: of the names. variability: ``discrete`` for the payload of an event.
    """
    return tuple(
        input_signal(f"{prefix}{s.name}", s.unit, s.start, s.description, variability=variability) for s in signals
    )


def sampling_event(
    names: Sequence[str], text: str = "The measurements are read", *, leaves_out: bool = False
) -> PeriodicEvent:
    """The event ``sampling``, every `sample_period`.

    Args:
        names: inputs that are read. text: one line. leaves_out: see `PeriodicEvent`.
    """
    return PeriodicEvent("sampling", "sample_period", description=text, samples=tuple(names), leaves_out=leaves_out)


def arrival_event(name: str, signals: Iterable[Signal], *, leaves_out: bool = False) -> TriggeredEvent:
    """The event of measurements that arrive at their own time stamp, as its payload ``<event>_<measurement>``.

    Args:
        name: of the event. signals: measurements of the model. leaves_out: see `TriggeredEvent`.
    """
    payload = measured_inputs(signals, f"{name}_", "discrete")
    text, samples = "A measurement arrives, at its own time stamp", tuple(s.name for s in payload)
    return TriggeredEvent(name, payload, text, samples=samples, leaves_out=leaves_out)


def matrix_parameter(name: str, values: np.ndarray, text: str, unit: str = "1") -> Signal:
    """A matrix as a parameter, flat, row by row.

    Args:
        name: of the parameter. values: its start, any shape. text: one line. unit: SI, as FMI writes units.
    """
    return parameter(name, unit, tuple(map(float, np.ravel(values))), text, size=np.size(values))

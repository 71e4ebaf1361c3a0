"""The hybrid system: signals, events, flow and jumps; traced, integrated and run through time."""

from plant_models.hybrid.event import CommunicationEvent, Event, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.kernel import NumpyKernel, TracedKernel, make_kernel
from plant_models.hybrid.resource import Resource
from plant_models.hybrid.runtime import Runtime, Snapshot
from plant_models.hybrid.signal import (
    Signal,
    input_signal,
    memory,
    output_signal,
    parameter,
    scalar_names,
    state,
    width,
)
from plant_models.hybrid.system import HybridSystem, vector
from plant_models.hybrid.tracing import TracedSystem, TracingError

__all__ = [
    "CommunicationEvent",
    "Event",
    "HybridSystem",
    "NumpyKernel",
    "PeriodicEvent",
    "Resource",
    "Runtime",
    "Signal",
    "Snapshot",
    "TracedKernel",
    "TracedSystem",
    "TracingError",
    "TriggeredEvent",
    "input_signal",
    "make_kernel",
    "memory",
    "output_signal",
    "parameter",
    "scalar_names",
    "state",
    "vector",
    "width",
]

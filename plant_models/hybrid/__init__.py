"""The hybrid system: signals, events, flow and jumps; traced, integrated and run through time.

What traces and runs systems loads CasADi, so it is loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.hybrid.arrays import Array, matrix, vector
from plant_models.hybrid.event import CommunicationEvent, Event, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.resource import Resource
from plant_models.hybrid.signal import (
    OutputWarning,
    Signal,
    discrete_output,
    input_signal,
    memory,
    output_signal,
    parameter,
    scalar_names,
    standard_normal,
    state,
    warning_output,
    width,
)
from plant_models.hybrid.system import HybridSystem
from plant_models.registry import lazy_imports

if TYPE_CHECKING:
    from plant_models.hybrid.kernel import NumpyKernel, TracedKernel, make_kernel
    from plant_models.hybrid.runtime import Runtime, Snapshot
    from plant_models.hybrid.tracing import TracedSystem, traced_once
    from plant_models.hybrid.tracing_error import TracingError

__all__ = [
    "Array",
    "CommunicationEvent",
    "Event",
    "HybridSystem",
    "NumpyKernel",
    "OutputWarning",
    "PeriodicEvent",
    "Resource",
    "Runtime",
    "Signal",
    "Snapshot",
    "TracedKernel",
    "TracedSystem",
    "TracingError",
    "TriggeredEvent",
    "discrete_output",
    "input_signal",
    "make_kernel",
    "matrix",
    "memory",
    "output_signal",
    "parameter",
    "scalar_names",
    "standard_normal",
    "state",
    "traced_once",
    "vector",
    "warning_output",
    "width",
]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "NumpyKernel": "plant_models.hybrid.kernel",
        "Runtime": "plant_models.hybrid.runtime",
        "Snapshot": "plant_models.hybrid.runtime",
        "TracedKernel": "plant_models.hybrid.kernel",
        "TracedSystem": "plant_models.hybrid.tracing",
        "TracingError": "plant_models.hybrid.tracing_error",
        "make_kernel": "plant_models.hybrid.kernel",
        "traced_once": "plant_models.hybrid.tracing",
    },
)

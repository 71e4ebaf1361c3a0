"""Words and numbers of the standard that every version and interface type shares."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription

CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED_EXECUTION = "coSimulation", "modelExchange", "scheduledExecution"

INTERFACES = {
    CO_SIMULATION: "co-simulation",
    MODEL_EXCHANGE: "model exchange",
    SCHEDULED_EXECUTION: "scheduled execution",
}
"""Interface types as fmpy calls them, and in words."""

Interface = Literal["co-simulation", "model-exchange"]
"""Those that can be stepped, in the words of a user."""

STEPPED: dict[Interface, str] = {"co-simulation": CO_SIMULATION, "model-exchange": MODEL_EXCHANGE}

Method = Literal["bdf", "adams"]
"""Multistep formulas of a solver: for stiff equations, and for others."""

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
"""Names of the FMI statuses, by number."""

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(len(STATUS))
"""After `FATAL` no function of the instance may be called."""

TIME_TOLERANCE = 1e-9
"""Communication times closer than this are the same [s]; a billionth of a second is above rounding at 1e5 s."""

NEVER = math.inf
"""The time of an event that is not due [s]."""

MAX_EVENT_ITERATIONS = 100
"""Updates of discrete states at one time, before they are said not to settle."""

MAX_RETURNS_PER_STEP = 10_000
"""Early returns from one communication step, before it is given up."""

OWN_TOOL = "fmu-observer"
"""What the FMUs that this package exports name as their tool."""


def fmi_version(description: ModelDescription) -> int:
    """The FMI version of a model description: 1, 2 or 3."""
    return int(str(description.fmiVersion)[0])

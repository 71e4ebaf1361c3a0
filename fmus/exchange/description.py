"""What a model exchange FMU says it can do once a solver steps it: the description with an element of co-simulation."""

from __future__ import annotations

from copy import copy
from typing import Any

from fmpy.model_description import CoSimulation, ModelDescription

from fmus.fmi.standard import MODEL_EXCHANGE, STEPPED, Interface, fmi_version
from fmus.fmi.types import is_continuous


class SolvedCoSimulation(CoSimulation):  # type: ignore[misc]
    """What a model exchange FMU can do once a solver moves it here."""


def is_solved(description: ModelDescription) -> bool:
    """Whether a description is that of a model exchange FMU that a solver here moves: see `as_stepped`.

    Args:
        description: of the slave.
    """
    return isinstance(description.coSimulation, SolvedCoSimulation)


def hides_nothing(description: ModelDescription) -> bool:
    """Whether nothing is declared that an event changes, so that time, states and inputs may be all of the state.

    Args:
        description: of the FMU.
    """
    if fmi_version(description) == 1 or description.numberOfEventIndicators:
        return False
    given = ("input", "parameter", "structuralParameter", "calculatedParameter", "independent")
    own = [v for v in description.modelVariables if v.causality not in given]
    changing = [v for v in own if v.variability not in ("constant", "fixed")]
    return all(is_continuous(v) for v in changing) and not any(v.type == "Clock" for v in description.modelVariables)


def stepped_by(description: ModelDescription, interface: Interface | None = None) -> str | None:
    """Which interface type of an FMU is stepped, in the words of fmpy; None where it does not offer it.

    Args:
        description: as read from the FMU.
        interface: that is asked for; None for co-simulation, and model exchange where there is nothing else.
    """
    offered = [kind for kind in STEPPED.values() if getattr(description, kind) is not None]
    chosen = offered[:1] if interface is None else [kind for kind in offered if kind == STEPPED[interface]]
    return chosen[0] if chosen else None


def as_stepped(description: ModelDescription, interface: Interface | None = None) -> ModelDescription:
    """The description of an FMU as a slave: that of one whose model exchange is stepped says what it can do then.

    Args:
        description: as read from the FMU. interface: as for `stepped_by`.
    """
    if stepped_by(description, interface) != MODEL_EXCHANGE:
        return description
    own, version = description.modelExchange, fmi_version(description)
    shared: dict[str, Any] = {
        name: getattr(own, name, False)
        for name in (
            "needsExecutionTool",
            "canBeInstantiatedOnlyOncePerProcess",
            "providesDirectionalDerivative",
            "providesAdjointDerivatives",
            "canNotUseMemoryManagementFunctions",
            "providesPerElementDependencies",
        )
    }
    saves = getattr(own, "canGetAndSetFMUstate", False)
    shared["canGetAndSetFMUstate"] = saves or hides_nothing(description)
    shared["canSerializeFMUstate"] = saves and getattr(own, "canSerializeFMUstate", False)
    stepped = copy(description)
    in_events = version == 3
    stepped.coSimulation = SolvedCoSimulation(
        modelIdentifier=own.modelIdentifier,
        canHandleVariableCommunicationStepSize=True,
        hasEventMode=in_events,
        mightReturnEarlyFromDoStep=in_events and bool(description.numberOfEventIndicators),
        **shared,
    )
    return stepped

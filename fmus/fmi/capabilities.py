"""Capabilities: what an FMU of any FMI version says it can do, read once from its model description. Knows descriptions
only.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from fmpy.model_description import ModelDescription

from fmus.fmi.standard import CO_SIMULATION

HELD_AS = {
    "canGetAndSetFMUState": "canGetAndSetFMUstate",
    "canSerializeFMUState": "canSerializeFMUstate",
    "providesDirectionalDerivatives": "providesDirectionalDerivative",
}
"""Attributes that fmpy holds under the name of FMI 2.0 for every version."""


@dataclass(frozen=True)
class Capabilities:
    """Capability flags of co-simulation, in the words of FMI 3.0 where it has them, else in those of 2.0.

    A flag that an FMI version does not have is at its default. What a flag says is believed only as far as the probe
    saw it.

    Args:
        needsExecutionTool: another program must be installed.
        canBeInstantiatedOnlyOncePerProcess: two instances in one process are not allowed.
        canNotUseMemoryManagementFunctions: it ignores the callbacks for memory (FMI 1, 2); they are passed all the
            same.
        canRunAsynchronuously: its doStep may return before it is done (FMI 1, 2), if the master can wait; this one
            cannot.
        canHandleVariableCommunicationStepSize: the communication step may vary.
        fixedInternalStepSize: its own step [s], where it says so (FMI 3).
        canInterpolateInputs: it takes derivatives of inputs (FMI 1, 2).
        maxOutputDerivativeOrder: highest order of output derivatives it gives.
        recommendedIntermediateInputSmoothness: how smooth inputs set during a step should be (FMI 3).
        providesIntermediateUpdate: it calls back during a step (FMI 3).
        mightReturnEarlyFromDoStep: a step may end early (FMI 3).
        canReturnEarlyAfterIntermediateUpdate: the master may ask for an early end during a step (FMI 3).
        hasEventMode: it has Event Mode (FMI 3).
        providesEvaluateDiscreteStates: discrete states may be evaluated without being taken over (FMI 3).
        canGetAndSetFMUState, canSerializeFMUState: its state can be saved, and turned into bytes.
        providesDirectionalDerivatives, providesAdjointDerivatives: it has these derivatives.
        providesPerElementDependencies: dependencies are known element by element (FMI 3).
    """

    needsExecutionTool: bool = False
    canBeInstantiatedOnlyOncePerProcess: bool = False
    canNotUseMemoryManagementFunctions: bool = False
    canRunAsynchronuously: bool = False
    canHandleVariableCommunicationStepSize: bool = False
    fixedInternalStepSize: float | None = None
    canInterpolateInputs: bool = False
    maxOutputDerivativeOrder: int = 0
    recommendedIntermediateInputSmoothness: int = 0
    providesIntermediateUpdate: bool = False
    mightReturnEarlyFromDoStep: bool = False
    canReturnEarlyAfterIntermediateUpdate: bool = False
    hasEventMode: bool = False
    providesEvaluateDiscreteStates: bool = False
    canGetAndSetFMUState: bool = False
    canSerializeFMUState: bool = False
    providesDirectionalDerivatives: bool = False
    providesAdjointDerivatives: bool = False
    providesPerElementDependencies: bool = False

    def declared(self) -> dict[str, Any]:
        """Those that differ from the default, by name."""
        return {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) != f.default}


def read_capabilities(description: ModelDescription, interface: str = CO_SIMULATION) -> Capabilities:
    """The capabilities a model description declares for an interface type; defaults where it has none of it.

    Args:
        description: as read from the FMU.
        interface: ``coSimulation`` or ``modelExchange``.
    """
    element = getattr(description, interface)
    if element is None:
        return Capabilities()
    found: dict[str, Any] = {
        f.name: getattr(element, HELD_AS.get(f.name, f.name), f.default) for f in fields(Capabilities)
    }
    step = found["fixedInternalStepSize"]
    found["fixedInternalStepSize"] = None if step is None else float(step)  # fmpy leaves it a text
    return Capabilities(**found)


def tool_warning(name: str, description: ModelDescription) -> str | None:
    """What to warn the user of before the run of an FMU that needs another program, or None.

    Args:
        name: of the component. description: of its FMU.
    """
    if not read_capabilities(description).needsExecutionTool:
        return None
    tool = description.generationTool
    which = f"it was made with {tool}" if tool else "its description does not say which"
    return f"{name}: the FMU needs another program to be installed (needsExecutionTool); {which}."

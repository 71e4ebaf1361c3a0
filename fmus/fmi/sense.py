"""Sense: what a model description can say and must not, although it can be read. Knows descriptions only."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from fmpy.model_description import ModelDescription, ModelVariable

MAX_REFERENCE = 2**32 - 1
MAX_CONNECTORS = 1_000_000
"""Elements of an input or output array: each has a name and a column in the results."""
INTERNAL = ("local", "internal", None)
"""Causalities of variables that nobody has to name, in the words of FMI 1 to 3."""
SHARED = " (value reference "
CLOCKS = ("calculated", "constant", "fixed", "tunable", "changing", "countdown", "triggered")
"""What ``intervalVariability`` can be (FMI 3.0.2, 2.2.8.3)."""


def distinguish(description: ModelDescription) -> None:
    """Give internal variables that share one name a name each: nobody can mean one of them by it, and nobody needs to.

    Public FMUs have such pairs. Inputs, outputs and parameters are left as they are: they are set and connected by
    name, so that two of one name are refused.

    Args:
        description: model description of the FMU.
    """
    named: dict[str, list[ModelVariable]] = {}
    for variable in description.modelVariables:
        named.setdefault(variable.name, []).append(variable)
    for name, equal in named.items():
        different = {(v.type, v.valueReference) for v in equal}
        if len(different) > 1 and all(v.causality in INTERNAL for v in equal):
            for variable in equal:
                variable.name = f"{name}{SHARED}{variable.valueReference})"


def doubled_names(description: ModelDescription) -> str | None:
    """Which internal variables had to be distinguished, as a sentence, or None.

    Args:
        description: model description of the FMU.
    """
    shared = [v.name for v in description.modelVariables if SHARED in v.name]
    if not shared:
        return None
    names = sorted({name.partition(SHARED)[0] for name in shared})
    stated = f"the names {', '.join(map(repr, names))} are" if len(names) > 1 else f"the name {names[0]!r} is"
    return f"{stated} given to more than one internal variable; they are called {', '.join(map(repr, shared))} here."


def nonsense(description: ModelDescription) -> str | None:
    """The first thing that nobody could act on without guessing, as a sentence; None where all is well.

    Args:
        description: model description of the FMU.
    """
    return next(_faults(description), None)


def shape_fault(variable: ModelVariable) -> str | None:
    """What is wrong with the shape of an array, as a sentence, or None.

    Args:
        variable: in the model description.
    """
    shape = tuple(variable.shape or ())
    if any(extent < 0 for extent in shape):
        return f"array '{variable.name}' has the shape {shape}; no dimension may be negative."
    if variable.causality in ("input", "output") and math.prod(shape) > MAX_CONNECTORS:
        most = f"an {variable.causality} has at most {MAX_CONNECTORS} values"
        return f"array '{variable.name}' of shape {shape} is too large: {most}."
    return None


def _faults(description: ModelDescription) -> Iterator[str]:
    variables: Sequence[ModelVariable] = description.modelVariables
    seen: dict[str, ModelVariable] = {}
    for variable in variables:
        other, reference = seen.setdefault(variable.name, variable), variable.valueReference
        if (other.type, other.valueReference) != (variable.type, reference):
            yield (
                f"two variables are named '{variable.name}', value references {other.valueReference} and {reference}; "
                "a name must be unique."
            )
        if not 0 <= reference <= MAX_REFERENCE:
            yield f"variable '{variable.name}' has the value reference {reference}, expected 0 to {MAX_REFERENCE}."
        if variable.type == "Clock" and variable.causality == "input" and variable.intervalVariability not in CLOCKS:
            found = variable.intervalVariability
            yield f"clock '{variable.name}' has the intervalVariability {found!r}, expected one of {', '.join(CLOCKS)}."
        fault = shape_fault(variable)
        if fault is not None:
            yield fault
    yield from _items(description)


def _items(description: ModelDescription) -> Iterator[str]:
    for declared in description.typeDefinitions:
        for item in declared.items:
            try:
                int(item.value)
            except (TypeError, ValueError):
                what = f"item '{item.name}' of enumeration '{declared.name}'"
                yield f"{what} has the value {item.value!r}, expected a whole number."

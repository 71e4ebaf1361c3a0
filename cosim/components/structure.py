"""Structural parameters of FMI 3: the dimensions of arrays that the user chooses. Knows descriptions only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.errors import CouplingError
from fmus.fmi.sense import shape_fault

STRUCTURAL = "structuralParameter"


def resize(description: ModelDescription, structure: Mapping[str, int]) -> None:
    """Shapes of all arrays for these values of the structural parameters; the others have their start values.

    Args:
        description: whose arrays get their shapes.
        structure: values of structural parameters by name.

    Raises:
        CouplingError: an array would become too large.
    """
    by_reference = {v.valueReference: structure[v.name] for v in description.modelVariables if v.name in structure}
    for variable in description.modelVariables:
        if variable.dimensions:
            variable.shape = tuple(_extent(dimension, by_reference) for dimension in variable.dimensions)
            fault = shape_fault(variable)
            if fault is not None:
                given = ", ".join(f"{name} = {value}" for name, value in structure.items())
                raise CouplingError(f"With {given or 'its start values'}: {fault}")


def _extent(dimension: Any, given: Mapping[int, int]) -> int:
    if dimension.start is not None:
        return int(dimension.start)
    if dimension.valueReference in given:
        return given[dimension.valueReference]
    return int(dimension.variable.start)

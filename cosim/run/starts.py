"""From the parameters in the tables of components to start values of variables, elements and arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from fmpy.model_description import ModelVariable

from cosim.components.component import Component
from cosim.components.start_values import StartValue, refusal, typed_value, typed_values
from cosim.components.structure import STRUCTURAL
from cosim.errors import CouplingError
from cosim.run.component_models import protocol_parameters
from cosim.run.run_seeds import component_seed
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from fmus.fmi.types import NUMERIC_TYPES, enumeration_items


def given_values(table: ScenarioTable) -> dict[str, list[str]]:
    """Names of the variables whose start values the scenario gives, by component.

    Args:
        table: of the scenario.
    """
    return {name: list(component.parameters) for name, component in table.components.items()}


def all_start_values(table: ScenarioTable, components: Mapping[str, Component]) -> dict[str, dict[str, StartValue]]:
    """Start values of a run by component and name: parameters, what is done with late events, and seeds.

    Args:
        table: the scenario. components: by name, loaded.

    Raises:
        ScenarioError, CouplingError: as for `start_values`; a component without a parameter that its table sets.
    """
    return {
        name: _start_values(table.components[name], component, table.seed) for name, component in components.items()
    }


def _start_values(table: ComponentTable, component: Component, run_seed: int) -> dict[str, StartValue]:
    if table.filter is not None:
        return {}  # they are those of its FMU, which has taken them
    late = protocol_parameters(table, component, f"components.{component.name}")
    return start_values(component, late | table.parameters | component_seed(component, table.parameters, run_seed))


def start_values(component: Component, parameters: Mapping[str, Any]) -> dict[str, StartValue]:
    """Start values by name, structural parameters first, each of its variable's type.

    A list for a vector of scalars sets ``name[1]``, ``name[2]``, ..., a number for one sets all its elements; an array
    of FMI 3 takes a list, nested or row by row, or one value for all. A text is a text, the name of an item of an
    enumeration, or the bytes of a binary in hexadecimal.

    Raises:
        CouplingError: a name is unknown (the nearest are suggested), a list is shorter than its vector, or a value is
            not of the variable's type or lies outside what the component declares.
    """
    starts: dict[str, StartValue] = {}
    for name, value in parameters.items():
        starts |= {single: _checked(component, single, given) for single, given in _spread(component, name, value)}
    structural = {n: v for n, v in starts.items() if component.variable(n).causality == STRUCTURAL}
    return structural | starts


def _spread(component: Component, name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Vectors of FMI 2 and of blocks are scalars named ``name[1]``, ``name[2]``, ..."""
    vector = [n for n in component.variables if n.startswith(f"{name}[")] if name not in component.variables else []
    if f"{name}[1]" not in vector:
        yield name, value
    elif isinstance(value, list):
        if len(value) < len(vector):  # a longer one ends with a name that is unknown
            raise CouplingError(
                f"{component.name}.{name}: expected {len(vector)} values, one for each element, or one number for all "
                f"(got {len(value)})."
            )
        yield from ((f"{name}[{i}]", entry) for i, entry in enumerate(value, 1))
    else:
        yield from ((n, value) for n in vector)


def _checked(component: Component, name: str, value: Any) -> StartValue:
    variable = component.settable(name)
    is_array = bool(variable.shape) and name in component.variables
    try:
        values = typed_values(variable, value) if is_array else [typed_value(variable, value)]
    except ValueError as error:
        raise CouplingError(refusal(f"{component.name}.{name}", error)) from error
    if variable.type == "Binary":
        return list(value) if isinstance(value, list) else str(value)  # as it was written: bytes go into no summary
    if variable.type in NUMERIC_TYPES:
        for number in values:
            _check_range(component, name, variable, number)
    return values if is_array else values[0]


def _check_range(component: Component, name: str, variable: ModelVariable, value: float) -> None:
    declared = variable.declaredType
    items = enumeration_items(variable)
    if variable.type == "Enumeration" and items and value not in items.values():
        names = ", ".join(f"{item} ({number})" for item, number in items.items())
        raise CouplingError(f"{component.name}.{name} = {value:g} is no item of the enumeration: {names}.")
    lowest = variable.min if variable.min is not None else getattr(declared, "min", None)
    highest = variable.max if variable.max is not None else getattr(declared, "max", None)
    if (lowest is not None and value < float(lowest)) or (highest is not None and value > float(highest)):
        low, high = ("-inf" if lowest is None else lowest), ("inf" if highest is None else highest)
        allowed = f"{low} to {high} {variable.unit or ''}".rstrip()
        raise CouplingError(f"{component.name}.{name} = {value:g} lies outside what the component declares: {allowed}.")

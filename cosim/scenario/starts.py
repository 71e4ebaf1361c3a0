"""Start values: from the parameters of a component's table to scalar variables."""

from __future__ import annotations

from collections.abc import Mapping

from cosim.components.component import Component
from cosim.errors import CouplingError, nearest


def start_values(component: Component, parameters: Mapping[str, float | list[float] | str]) -> dict[str, float]:
    """Scalar start values by name: a list sets ``name[1]``, ``name[2]``, ..., a number for a vector sets all its elements, a
    text is the name of an item of an enumeration.

    Raises:
        CouplingError: a name is unknown (the nearest are suggested), or a value lies outside what the component declares.
    """
    starts: dict[str, float] = {}
    for name, value in parameters.items():
        if isinstance(value, str):
            starts[name] = _item_number(component, name, value)
        elif isinstance(value, list):
            starts |= {f"{name}[{i + 1}]": float(v) for i, v in enumerate(value)}
        elif name not in component.variables and f"{name}[1]" in component.variables:
            starts |= dict.fromkeys((n for n in component.variables if n.startswith(f"{name}[")), float(value))
        else:
            starts[name] = float(value)
    for name, number in starts.items():
        _check_range(component, name, number)
    return starts


def _item_number(component: Component, name: str, item: str) -> float:
    variable = component.variable(name)
    items = {i.name: float(i.value) for i in getattr(variable.declaredType, "items", None) or []}
    if variable.type != "Enumeration":
        raise CouplingError(f"{component.name}.{name}: expected a number, or a list of numbers for a vector (got {item!r}).")
    if item not in items:
        raise CouplingError(f"{component.name}.{name} has no item {item!r}; {nearest(item, items)}")
    return items[item]


def _check_range(component: Component, name: str, value: float) -> None:
    variable = component.variable(name)
    declared = variable.declaredType
    numbers = [float(item.value) for item in getattr(declared, "items", None) or []]
    if variable.type == "Enumeration" and numbers and value not in numbers:
        names = ", ".join(f"{item.name} ({item.value})" for item in declared.items)
        raise CouplingError(f"{component.name}.{name} = {value:g} is no item of the enumeration: {names}.")
    lowest = variable.min if variable.min is not None else getattr(declared, "min", None)
    highest = variable.max if variable.max is not None else getattr(declared, "max", None)
    if (lowest is not None and value < float(lowest)) or (highest is not None and value > float(highest)):
        low, high = ("-inf" if lowest is None else lowest), ("inf" if highest is None else highest)
        allowed = f"{low} to {high} {variable.unit or ''}".rstrip()
        raise CouplingError(f"{component.name}.{name} = {value:g} lies outside what the component declares: {allowed}.")

"""Start values: from the parameters of a component's table to scalar variables."""

from __future__ import annotations

from collections.abc import Mapping

from cosim.components.component import Component
from cosim.errors import CouplingError


def start_values(component: Component, parameters: Mapping[str, float | list[float]]) -> dict[str, float]:
    """Scalar start values by name: a list sets ``name[1]``, ``name[2]``, ..., a number for a vector sets all its elements.

    Raises:
        CouplingError: a name is unknown (the nearest are suggested), or a value lies outside what the component declares.
    """
    starts: dict[str, float] = {}
    for name, value in parameters.items():
        if isinstance(value, list):
            starts |= {f"{name}[{i + 1}]": float(v) for i, v in enumerate(value)}
        elif name not in component.variables and f"{name}[1]" in component.variables:
            starts |= dict.fromkeys((n for n in component.variables if n.startswith(f"{name}[")), float(value))
        else:
            starts[name] = float(value)
    for name, number in starts.items():
        _check_range(component, name, number)
    return starts


def _check_range(component: Component, name: str, value: float) -> None:
    variable = component.variable(name)
    declared = variable.declaredType
    lowest = variable.min if variable.min is not None else getattr(declared, "min", None)
    highest = variable.max if variable.max is not None else getattr(declared, "max", None)
    if (lowest is not None and value < float(lowest)) or (highest is not None and value > float(highest)):
        low, high = ("-inf" if lowest is None else lowest), ("inf" if highest is None else highest)
        allowed = f"{low} to {high} {variable.unit or ''}".rstrip()
        raise CouplingError(f"{component.name}.{name} = {value:g} lies outside what the component declares: {allowed}.")

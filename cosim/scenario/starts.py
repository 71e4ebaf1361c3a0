"""Start values: from the parameters of a component's table to scalar variables."""

from __future__ import annotations

from collections.abc import Mapping

from cosim.components.component import Component


def start_values(component: Component, parameters: Mapping[str, float | list[float]]) -> dict[str, float]:
    """Scalar start values by name: a list sets ``name[1]``, ``name[2]``, ..., a number for a vector sets all its elements.

    Raises:
        CouplingError: a name is unknown; the nearest are suggested.
    """
    starts: dict[str, float] = {}
    for name, value in parameters.items():
        if isinstance(value, list):
            starts |= {f"{name}[{i + 1}]": float(v) for i, v in enumerate(value)}
        elif name not in component.variables and f"{name}[1]" in component.variables:
            starts |= dict.fromkeys((n for n in component.variables if n.startswith(f"{name}[")), float(value))
        else:
            starts[name] = float(value)
    for name in starts:
        component.variable(name)
    return starts

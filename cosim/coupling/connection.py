"""Connections: one output to one input, units checked and converted. Knows components, not time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cosim.components.component import NUMERIC_TYPES, Component
from cosim.errors import CouplingError, nearest
from plant_models.hybrid.units import UnitError, conversion


@dataclass(frozen=True)
class Connection:
    """``target = factor * source + offset``.

    Args:
        source: (component, output). target: (component, input). factor, offset: unit conversion.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float = 1.0
    offset: float = 0.0

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


def split_name(name: str, components: Iterable[str], what: str) -> tuple[str, str]:
    """``component.signal`` as a pair; the signal's own name may hold dots.

    Raises:
        CouplingError: the name has no dot or the component does not exist.
    """
    component, dot, signal = name.partition(".")
    known = list(components)
    if not dot or component not in known:
        expected = "expected 'component.signal' with a component of this run"
        raise CouplingError(f"{what} {name!r}: {expected}; {nearest(component, known)}")
    return component, signal


def connect(pairs: Sequence[tuple[str, str]], components: Mapping[str, Component]) -> list[Connection]:
    """Checked connections from ``(source, target)`` names.

    Raises:
        CouplingError: an unknown variable, a wrong causality, a type that is not numeric, units that do not fit, or two
            sources for one input.
    """
    connections: list[Connection] = []
    taken: dict[tuple[str, str], str] = {}
    for source_name, target_name in pairs:
        source = split_name(source_name, components, "Connection source")
        target = split_name(target_name, components, "Connection target")
        _check_variable(components[source[0]], source[1], "output")
        _check_variable(components[target[0]], target[1], "input")
        if target in taken:
            raise CouplingError(
                f"Input {target_name} has two sources, {taken[target]} and {source_name}; an input takes one. "
                "Remove one connection."
            )
        taken[target] = source_name
        factor, offset = _conversion(components, source, target)
        connections.append(Connection(source, target, factor, offset))
    return connections


def unconnected_inputs(connections: Sequence[Connection], components: Iterable[Component]) -> list[str]:
    """Names of inputs without a source; they keep their start values."""
    taken = {c.target for c in connections}
    return [f"{c.name}.{i}" for c in components for i in c.names("input") if (c.name, i) not in taken]


def _check_variable(component: Component, name: str, causality: str) -> None:
    variable = component.variable(name, causality)
    if variable.type not in NUMERIC_TYPES or variable.shape:
        kind = f"an array of shape {variable.shape}" if variable.shape else f"a {variable.type}"
        raise CouplingError(f"{component.name}.{name} is {kind}; only scalar numeric variables can be connected.")
    if causality == "input" and variable.valueReference in component.event_references():
        raise CouplingError(f"{component.name}.{name} belongs to an event; the master sets it, it cannot be connected.")


def _conversion(components: Mapping[str, Component], source: tuple[str, str], target: tuple[str, str]) -> tuple[float, float]:
    sender, receiver = components[source[0]], components[target[0]]
    names = sender.unit_name(source[1]), receiver.unit_name(target[1])
    try:
        units = sender.unit(source[1]), receiver.unit(target[1])
        if units[0] is None or units[1] is None:
            return 1.0, 0.0
        return conversion(units[0], units[1])
    except UnitError as error:
        if names[0] == names[1] and not _both_defined(sender, receiver, source[1], target[1]):
            return 1.0, 0.0  # a unit that neither explains, but both call the same
        where = f"{'.'.join(source)} -> {'.'.join(target)}"
        raise CouplingError(f"Connection {where}: units {names[0]!r} and {names[1]!r} do not fit: {error}.") from error


def _both_defined(sender: Component, receiver: Component, output: str, name: str) -> bool:
    try:
        return sender.unit(output) is not None and receiver.unit(name) is not None
    except UnitError:
        return False

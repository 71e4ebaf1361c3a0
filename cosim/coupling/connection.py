"""Connections: one output to one input, types and units checked and converted. Knows components, not time.

A connection joins two scalars or two elements; whole arrays are joined element by element. Numbers travel as doubles;
texts, bytes and 64-bit integers, which doubles cannot hold, travel as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from fmpy.model_description import ModelVariable

from cosim.components.component import Component
from cosim.components.start_values import typed_value
from cosim.coupling.transformation import Transformation
from cosim.errors import CouplingError, nearest
from fmu_observer.annotated_variable import is_optional
from fmus.fmi.elements import Element, described, elements_of
from fmus.fmi.types import FLOATING_TYPES, NUMERIC_TYPES, getter_type
from plant_models.hybrid.units import UnitError

Link = tuple[str, str] | tuple[str, str, Transformation]
"""Names of a source and a target, and what happens to the number on its way besides units."""

_LONG_TYPES = frozenset({"Int64", "UInt64"})
"""Types with values that a double cannot hold."""


SOURCES = ("output", "local")
"""What may be connected to an input. A local variable may be read like an output; what acts on it at once is never
declared.
"""


@dataclass(frozen=True)
class Connection:
    """``target = factor * source + offset``.

    Args:
        source: (component, output). target: (component, input). factor, offset: unit conversion and linear
            transformation.
        table: (source, target) values of a discrete signal, where it is mapped; a value without an entry passes
            unchanged.
        exact: whether the value travels as it is instead of as a double.
        source_array, target_array: the array that the source or target is an element of, or an empty name.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float = 1.0
    offset: float = 0.0
    table: tuple[tuple[float, float], ...] = ()
    exact: bool = False
    source_array: str = ""
    target_array: str = ""

    @property
    def source_variable(self) -> tuple[str, str]:
        """(component, variable) of the source; of an element its array, which is what dependencies are declared for."""
        return self.source[0], self.source_array or self.source[1]

    @property
    def target_variable(self) -> tuple[str, str]:
        """(component, variable) of the target; of an element its array."""
        return self.target[0], self.target_array or self.target[1]

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


def split_name(name: str, components: Iterable[str], what: str) -> tuple[str, str]:
    """``component.signal`` as a pair; the signal's own name may hold dots.

    Args:
        components: names of the components. what: kind of name, for the message.

    Raises:
        CouplingError: the name has no dot or the component does not exist.
    """
    component, dot, signal = name.partition(".")
    known = list(components)
    if component not in known:
        expected = "expected 'component.signal' with a component of this run"
        raise CouplingError(f"{what} {name!r}: {expected}; {nearest(component, known)}")
    if not dot:
        raise CouplingError(f"{what} {name!r}: expected 'component.signal'; which signal of {name}?")
    return component, signal


def connect(pairs: Sequence[Link], components: Mapping[str, Component]) -> list[Connection]:
    """Checked connections from ``(source, target)`` names, with a transformation or without; one for each element of
    arrays.

    Args:
        pairs: links as the scenario has them. components: by name, or those to look at.

    Raises:
        CouplingError: an unknown variable, a wrong causality, types, shapes or units that do not fit, or two sources
        for one
            input.
    """
    connections: list[Connection] = []
    taken: dict[tuple[str, str], str] = {}
    for pair in pairs:
        for made in _of_elements(pair, components):
            take_source(taken, made.target, pair[0], "input")
            connections.append(made)
    return connections


def take_source(taken: dict[tuple[str, str], str], target: tuple[str, str], source: str, kind: str) -> None:
    """Note the source of a target.

    Args:
        taken: sources by target so far. target: component and signal. source: as it was written. kind: of the target,
            in a word.

    Raises:
        CouplingError: it has a source already.
    """
    if target in taken:
        raise CouplingError(
            f"{kind.capitalize()} {'.'.join(target)} has two sources, {taken[target]} and {source}; it takes one. "
            "Remove one connection."
        )
    taken[target] = source


def _of_elements(pair: Link, components: Mapping[str, Component]) -> list[Connection]:
    """The connections of one link, one for each element."""
    source_name, target_name, *more = pair
    transformation = more[0] if more else Transformation()
    source = split_name(source_name, components, "Connection source")
    target = split_name(target_name, components, "Connection target")
    components[source[0]].variable(source[1], *SOURCES)
    if components[source[0]].texts(source[1]):
        transformation = _by_item(components, source, target, transformation)
    exact = _exact(components, source, target, transformation)
    _require_leaving_out(components, source, target)
    factor, offset = _conversion(components, source, target) if transformation.convert_units else (1.0, 0.0)
    return [
        Connection(
            (source[0], output.name),
            (target[0], name.name),
            *transformation.after(factor, offset),
            transformation.table,
            exact,
            _array(output),
            _array(name),
        )
        for output, name in _elements(components, source, target)
    ]


def event_connection(pair: Link, components: Mapping[str, Component]) -> Connection:
    """A checked connection of a number to a field of an event, which the master notifies: it is sent with the event.

    Args:
        pair: link as the scenario has it. components: by name.

    Raises:
        CouplingError: an unknown variable, a wrong causality, or units that do not fit.
    """
    source_name, target_name, *stated = pair
    transformation = stated[0] if stated else Transformation()
    source = split_name(source_name, components, "Connection source")
    target = split_name(target_name, components, "Connection target")
    components[source[0]].variable(source[1], *SOURCES)
    components[target[0]].variable(target[1], "input")
    _require_leaving_out(components, source, target)
    factor, offset = _conversion(components, source, target) if transformation.convert_units else (1.0, 0.0)
    return Connection(source, target, *transformation.after(factor, offset))


def _require_leaving_out(components: Mapping[str, Component], source: tuple[str, str], target: tuple[str, str]) -> None:
    """What can be missing goes only to those that leave it out.

    Raises:
        CouplingError: the target would compute with NaN.
    """
    if not components[source[0]].can_be_missing(source[1]) or components[target[0]].can_be_missing(target[1]):
        return
    able = [n for n in components[target[0]].names("input") if components[target[0]].can_be_missing(n)]
    inputs = f"; of {target[0]} these do: {', '.join(able)}" if able else ""
    raise CouplingError(
        f"Connection {'.'.join(source)} -> {'.'.join(target)}: {'.'.join(source)} can be missing (NaN), and "
        f"{'.'.join(target)} does not leave out what is missing{inputs}. Connect it to a filter or observer that does, "
        f"or, where the component takes NaN for a missing value itself, declare can_be_missing = ['{target[1]}'] in "
        f"[components.{target[0]}]."
    )


def _elements(
    components: Mapping[str, Component], source: tuple[str, str], target: tuple[str, str]
) -> Iterable[tuple[Element, Element]]:
    """Pairs of elements, row by row.

    Raises:
        CouplingError: the shapes differ.
    """
    sides = [(components[name], signal) for name, signal in (source, target)]
    outputs, inputs = (component.elements(signal) for component, signal in sides)
    shapes = [tuple(c.variables[s].shape or ()) if s in c.variables else () for c, s in sides]
    if shapes[0] != shapes[1]:
        words = [f"{c.name}.{s} is {_article(shape)}" for (c, s), shape in zip(sides, shapes, strict=True)]
        raise CouplingError(
            f"{words[0]}, {words[1]}; connect arrays of one shape, or their elements ('a.x[1] -> b.u')."
        )
    return zip(outputs, inputs, strict=True)


def _article(shape: tuple[int, ...]) -> str:
    return f"an array of shape {shape}" if shape else "a scalar"


def _array(element: Element) -> str:
    return "" if element.index is None else str(element.variable.name)


def _exact(
    components: Mapping[str, Component],
    source: tuple[str, str],
    target: tuple[str, str],
    transformation: Transformation,
) -> bool:
    """Whether a value travels as it is.

    Raises:
        CouplingError: the types do not fit.
    """
    output = _connectable(components[source[0]], source[1], *SOURCES)
    name = _connectable(components[target[0]], target[1], "input")
    reason = _misfit(output, name)
    known = components[source[0]].known_values(source[1]) if _would_be_rounded(output, name) else None
    if known is not None:
        reason = _unfit_value(known, name, transformation)
    if reason:
        types = f"{'.'.join(source)} is a {output.type}, {'.'.join(target)} is a {name.type}"
        raise CouplingError(f"Connection {'.'.join(source)} -> {'.'.join(target)}: {types}; {reason}.")
    if output.type not in NUMERIC_TYPES:
        if transformation != Transformation():
            raise CouplingError(
                f"Connection {'.'.join(source)} -> {'.'.join(target)}: a {output.type} cannot be transformed."
            )
        return True
    versions = [components[end[0]].fmi_version for end in (source, target)]
    kinds = {getter_type(v.type, version) for v, version in zip((output, name), versions, strict=True)}
    return kinds <= _LONG_TYPES and transformation == Transformation()


def _by_item(
    components: Mapping[str, Component], source: tuple[str, str], target: tuple[str, str], stated: Transformation
) -> Transformation:
    """What a column of texts does to its target: each text is the item, or the truth value, that it names.

    Raises:
        CouplingError: a text names nothing of the target, or something else is stated for the connection.
    """
    sender, variable = components[source[0]], components[target[0]].variable(target[1], "input")
    where = f"Connection {'.'.join(source)} -> {'.'.join(target)}"
    if stated != Transformation() or variable.type not in ("Enumeration", "Boolean"):
        raise CouplingError(
            f"{where}: the column holds texts, which drive enumerations and truth values as they are; "
            f"{'.'.join(target)} is a {variable.type}."
        )
    items, table = sender.texts(source[1]), list[tuple[float, float]]()
    for number, place in sender.known_values(source[1]) or ():
        try:
            table.append((number, float(typed_value(variable, items[int(number) - 1]))))
        except ValueError as error:
            raise CouplingError(f"{where}: {place}: {error}") from error
    return Transformation(table=tuple(table))


def _misfit(source: ModelVariable, target: ModelVariable) -> str:
    """Why a value of one type is no value of another, or an empty text.

    Floating-point numbers fit one another, and so do integers, truth values and enumerations; those also fit
    floating-point inputs, not the other way round, unless all values are known. Texts fit texts, bytes fit bytes.
    """
    if source.type not in NUMERIC_TYPES or target.type not in NUMERIC_TYPES:
        return "" if source.type == target.type else "only equal types fit here"
    if _would_be_rounded(source, target):
        return "a floating-point number is not rounded on its way; round it in a component between them"
    return ""


def _would_be_rounded(source: ModelVariable, target: ModelVariable) -> bool:
    return source.type in FLOATING_TYPES and target.type in NUMERIC_TYPES - FLOATING_TYPES


def _unfit_value(known: Sequence[tuple[float, str]], target: ModelVariable, transformation: Transformation) -> str:
    """Which of the values that a column has is none of the target, and where it stands; empty where all are."""
    for value, place in known:
        try:
            typed_value(target, transformation.of(value))
        except ValueError as error:
            return f"{place}: {str(error).rstrip('.')}"
    return ""


def unconnected_inputs(
    connections: Sequence[Connection],
    components: Iterable[Component],
    stated: Mapping[str, Iterable[str]] | None = None,
) -> list[str]:
    """Names of inputs, and of elements of arrays, without a source; they keep their start values.

    Those that are declared optional are left out: there the start value is meant.

    Args:
        connections: checked. components: all of them.
        stated: by component the names whose values were given on purpose; they are not reported.
    """
    set_by_hand = {(name, signal) for name, signals in (stated or {}).items() for signal in signals}
    taken = {c.target for c in connections} | set_by_hand
    return [
        f"{c.name}.{name}" for c in components for v in _to_connect(c, taken) for name in _without_source(c, v, taken)
    ]


def _to_connect(component: Component, taken: set[tuple[str, str]]) -> list[ModelVariable]:
    """The inputs that are to be connected; an FMI 3 alias is its variable, and one that is taken takes it."""
    hidden = component.event_references()
    inputs = [
        v
        for v in component.description.modelVariables
        if v.causality == "input" and v.type != "Clock" and v.alias is None
    ]
    by_alias = {v.name for v in inputs if any((component.name, alias.name) in taken for alias in v.aliases)}
    return [v for v in inputs if v.valueReference not in hidden and v.name not in by_alias and not is_optional(v)]


def _without_source(component: Component, variable: ModelVariable, taken: set[tuple[str, str]]) -> list[str]:
    """The elements without a source; the array itself where no element has one."""
    elements = elements_of(variable)
    if (component.name, variable.name) in taken:
        return []
    free = [element.name for element in elements if (component.name, element.name) not in taken]
    return [variable.name] if len(free) == len(elements) else free


def local_sources(connections: Iterable[Connection], components: Mapping[str, Component]) -> dict[str, list[str]]:
    """Local variables that other components read, element by element, by component: sealed FMUs hide what others
    need.

    Args:
        connections: of the run.
    """
    found: dict[str, list[str]] = {}
    for c in connections:
        name = c.source[0]
        if components[name].variable(c.source[1]).causality == "local" and c.source[1] not in found.setdefault(
            name, []
        ):
            found[name].append(c.source[1])
    return {name: signals for name, signals in found.items() if signals}


def _connectable(component: Component, name: str, *causalities: str) -> ModelVariable:
    variable = component.variable(name, *causalities)
    if variable.type == "Clock":
        raise CouplingError(
            f"{component.name}.{name} is a {described(variable)}; it has no value that could be connected."
        )
    if variable.causality == "input" and variable.valueReference in component.event_references():
        raise CouplingError(
            f"{component.name}.{name} belongs to an event, which the master notifies; connect its count too, or leave "
            f"all of it."
        )
    return variable


def _conversion(
    components: Mapping[str, Component], source: tuple[str, str], target: tuple[str, str]
) -> tuple[float, float]:
    sender, receiver = components[source[0]], components[target[0]]
    if sender.variables[source[1]].type not in FLOATING_TYPES:
        return 1.0, 0.0  # only floating-point numbers have units
    own, wanted = sender.named_unit(source[1]), receiver.named_unit(target[1])
    if own is None or wanted is None:
        return 1.0, 0.0
    try:
        return own.to(wanted)
    except UnitError as error:
        where = f"{'.'.join(source)} -> {'.'.join(target)}"
        raise CouplingError(
            f"Connection {where}: units {own.name!r} and {wanted.name!r} do not fit: {error}."
        ) from error

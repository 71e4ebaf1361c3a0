"""What an SSP says, as plain data: systems, components, connectors, connections, bindings. Knows no FMU.

Every part keeps the element it was read from, so that a fault found later can name file and line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cosim.ssp.common import Step, Type
from cosim.ssp.document import Node
from fmus.fmi.standard import Interface


@dataclass(frozen=True)
class Connector:
    """A connector of an element, or an entry of a signal dictionary.

    Args:
        name, kind: as written; an entry is ``inout``. type: None where none is given. dimensions: number of them.
    """

    name: str
    kind: str
    type: Type | None
    dimensions: int
    node: Node = field(compare=False)


@dataclass(frozen=True)
class End:
    """One end of a connection: a connector of an element, or of the system itself where `element` is None.

    Args:
        indices: of the one element of an array that is meant; empty for the whole.
    """

    element: str | None
    connector: str
    indices: tuple[int, ...] = ()


@dataclass(frozen=True)
class SsdConnection:
    """A connection as it is written: start and end say nothing about the direction.

    Args:
        suppress: whether units are left alone. step: its transformation.
    """

    start: End
    end: End
    suppress: bool
    step: Step | None
    node: Node = field(compare=False)


@dataclass(frozen=True)
class Parameter:
    """A parameter of a parameter set.

    Args:
        values: as written, one text for each element of an array, in row-major order. array: whether it has dimensions.
    """

    name: str
    type: Type
    values: tuple[str, ...]
    array: bool
    node: Node = field(compare=False)


@dataclass(frozen=True)
class SsdEntry:
    """An entry of a parameter mapping."""

    source: str
    target: str
    suppress: bool
    step: Step | None
    node: Node = field(compare=False)


@dataclass(frozen=True)
class Binding:
    """A parameter set applied to an element.

    Args:
        parameters: names with the prefix of the binding. mapping: entries, or None where all apply under their own
            names.
    """

    parameters: tuple[Parameter, ...]
    mapping: tuple[SsdEntry, ...] | None
    node: Node = field(compare=False)


@dataclass
class SsdElement:
    """What all elements of a system have. Connectors by name; bindings in the order in which they apply."""

    name: str
    connectors: dict[str, Connector]
    bindings: list[Binding]
    node: Node


@dataclass
class ComponentElement(SsdElement):
    """An FMU.

    Args:
        fmu: the unpacked file. member: its name in the package. extras: what our own annotation says of it.
        interface: which one is stepped; None for co-simulation, and model exchange where there is nothing else.
    """

    fmu: Path
    member: str
    extras: Mapping[str, object]
    interface: Interface | None


@dataclass
class DictionaryReference(SsdElement):
    """A place where the signals of a dictionary can be reached. Args: `dictionary`: its name."""

    dictionary: str


@dataclass
class SystemElement(SsdElement):
    """A system: its elements by name, the connections between them, its signal dictionaries (entries by name)."""

    elements: dict[str, SsdElement]
    wires: list[SsdConnection]
    dictionaries: dict[str, dict[str, Connector]]


@dataclass
class SsdStructure:
    """A whole system structure description.

    Args:
        name, description: of it. system: the root. start, stop: of the default experiment [s], where given.
        version: of SSP. extras: what our own annotation says of it.
        step: communication step that another tool's annotation asks for [s], where one does.
    """

    name: str
    description: str
    version: str
    system: SystemElement
    start: float | None
    stop: float | None
    extras: Mapping[str, object]
    step: float | None

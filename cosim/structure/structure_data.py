"""Components, connections, groups, loops and order of a run, as plain data. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

Signal = tuple[str, str]
"""(component, variable)"""


@dataclass(frozen=True)
class Port:
    """An input or output of a component.

    Args:
        name: of the variable.
        unit: its unit, or None where it declares none.
        kind: type of the variable in FMI's words (``Float64``, ``Boolean``, ...), with its shape where it is an array.
        connected: whether a connection begins or ends here.
        depends_on: for an output, the inputs that act on it directly; None where the FMU does not say.
        ticks: for an input clock its ``intervalVariability``, else None.
    """

    name: str
    unit: str | None
    kind: str
    connected: bool
    depends_on: tuple[str, ...] | None = None
    ticks: str | None = None

    @property
    def text(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Part:
    """A component of the run.

    Args:
        name: in the scenario. kind: ``FMU`` or ``block``. fmi_version: as the description says. model: its model name.
        source: file or origin. inputs, outputs: without the triggers and payloads of events. events: triggered ones it
            declares.
        abilities: capabilities that matter to a master, in words. group: index of its group in `StructureData.groups`.
        rate: every how many communication steps it runs, or how many times in one, in words; empty for once a step.
        chain: how it moves over a step, in words: the stages, outermost first, then what is done within them.
    """

    name: str
    kind: str
    fmi_version: str
    model: str
    source: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    events: tuple[str, ...]
    abilities: tuple[str, ...]
    group: int
    rate: str = ""
    chain: tuple[str, ...] = ()


@dataclass(frozen=True)
class Link:
    """A connection.

    Args:
        source, target: its ends. factor, offset: unit conversion ``target = factor * source + offset``.
        held: the target uses the value of the start of a step, as all targets of this signal do.
        in_loop: whether it is part of an algebraic loop. iterated: whether it is iterated until it settles.
        mapped: whether values are mapped one by one. line: the target follows the line of a table within the step.
    """

    source: Signal
    target: Signal
    factor: float = 1.0
    offset: float = 0.0
    held: bool = False
    in_loop: bool = False
    iterated: bool = False
    mapped: bool = False
    line: bool = False

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"

    @property
    def converts(self) -> bool:
        """Whether units are converted."""
        return (self.factor, self.offset) != (1.0, 0.0)


@dataclass(frozen=True)
class Balises:
    """Who finds the balises, and who is notified.

    Args:
        plant: the watched component. position, speed: its outputs, empty where telegrams are recorded.
        receivers: components that are notified.
        method: as asked for; ``auto`` is decided by a probe of the plant when the run is set up. timing: ``exact`` or
            ``stale``.
        odometer: output whose reading the telegrams carry, or None.
    """

    plant: str
    position: str
    speed: str
    receivers: tuple[str, ...]
    method: str
    timing: str
    odometer: str | None = None


@dataclass(frozen=True)
class Packets:
    """The network of a run.

    Args:
        nodes: signals by node. protocol: which node sends. period: between two transmissions [s].
        delay: kind of delay. notified: components that are notified by events, with their event. held: components whose
            inputs hold what came last.
    """

    nodes: Mapping[str, tuple[str, ...]]
    protocol: str
    period: float
    delay: str
    notified: tuple[str, ...] = ()
    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class StructureData:
    """How the components of a run hang together, known before it, as plain data.

    Args:
        name, title: of the scenario. start, stop, step: [s].
        parts: components in execution order. links: connections in the order given.
        groups: names of the strongly connected groups in execution order; most hold one component.
        loops: algebraic loops, each a closed path of signals along direct feedthrough.
        algorithm: how the components are stepped. reason: why so.
        balises: or None. clocks: connections between clocks. network: or None.
        warnings: what the run would warn of, or refuse.
    """

    name: str
    title: str
    start: float
    stop: float
    step: float
    parts: tuple[Part, ...]
    links: tuple[Link, ...]
    groups: tuple[tuple[str, ...], ...]
    loops: tuple[tuple[Signal, ...], ...] = ()
    algorithm: str = "gauss-seidel"
    reason: str = ""
    balises: Balises | None = None
    clocks: tuple[Link, ...] = ()
    warnings: tuple[str, ...] = field(default=())
    network: Packets | None = None

    def part(self, name: str) -> Part:
        """The component of this name."""
        return next(p for p in self.parts if p.name == name)

    @property
    def order(self) -> tuple[str, ...]:
        """Names in execution order."""
        return tuple(p.name for p in self.parts)

    @property
    def held(self) -> tuple[Link, ...]:
        """Connections whose value is that of the start of a step."""
        return tuple(link for link in self.links if link.held)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"order": list(self.order)}

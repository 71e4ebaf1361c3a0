"""The structure of a run as tables. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fmus.tables.table import Parts, Table, name_column, pairs_table, text_column

if TYPE_CHECKING:
    from cosim.structure.structure_data import Link, Part, Port, StructureData

DASH = "-"


def structure_parts(structure: StructureData) -> Parts:
    """Components, signals, connections, groups, loops, balises, algorithm, warnings.

    Args:
        structure: what is described.
    """
    algorithm = f"{structure.algorithm}: {structure.reason}" if structure.reason else structure.algorithm
    return [
        _heading(structure),
        _components(structure),
        _ports(structure),
        _connections(structure) if structure.links or structure.clocks else "Connections\n  none",
        _section("Groups", _groups(structure)),
        _section("Algebraic loops", _loops(structure)),
        pairs_table(
            "chains",
            {part.name: " > ".join(part.chain) for part in structure.parts if part.chain},
            "Movement over a step, outermost stage first",
        ),
        pairs_table("balise service", _balises(structure), "Balises"),
        pairs_table("network nodes", _network(structure), "Network"),
        _section("Algorithm", [algorithm]),
        _section("Warnings", structure.warnings),
    ]


def _section(title: str, lines: Sequence[str]) -> str:
    return "\n".join([title, *(f"  {line}".rstrip() for line in lines)]) if lines else ""


def _heading(structure: StructureData) -> str:
    count = round((structure.stop - structure.start) / structure.step)
    steps = "1 step" if count == 1 else f"{count} steps"
    return (
        f"{structure.name}: {structure.title}\n{structure.start:g} s to {structure.stop:g} s in {steps} of "
        f"{structure.step:g} s; {len(structure.parts)} components, {len(structure.links)} connections"
    )


_PART_COLUMNS = (
    name_column("number", "#", "Place in the order of execution"),
    name_column("name", "name"),
    *(text_column(key, key) for key in ("kind", "FMI", "model")),
    text_column("inputs", "inputs", "How many are connected, of all"),
    text_column("outputs", "outputs", "How many are connected, of all"),
    text_column("steps", "steps", "Own steps in a communication step"),
    text_column("declares", "declares"),
)


def _components(structure: StructureData) -> Table:
    rates = any(part.rate for part in structure.parts)
    rows = [
        [
            *(str(number), part.name, part.kind, part.fmi_version, part.model),
            *(_used(part.inputs), _used(part.outputs)),
            *((part.rate or "1") if rates else None, ", ".join(part.abilities) or DASH),
        ]
        for number, part in enumerate(structure.parts, start=1)
    ]
    notes = ["", "inputs, outputs: connected of all"]
    return Table("parts", _PART_COLUMNS, rows, "Components, in execution order", notes).filled()


def _used(ports: Sequence[Port]) -> str:
    return f"{sum(port.connected for port in ports)} of {len(ports)}" if ports else DASH


def _ports(structure: StructureData) -> Table:
    every = [*structure.links, *structure.clocks]
    into = {link.target: link for link in every}
    out_of: dict[tuple[str, str], list[Link]] = {}
    for link in every:
        out_of.setdefault(link.source, []).append(link)
    rows = []
    for part in structure.parts:
        for port in part.inputs:
            sources = [".".join(link.source) for target, link in into.items() if _is_end(target, part, port)]
            rows.append([f"{part.name}.{port.name}", "input", port.unit or DASH, port.kind, _from(sources, port)])
        for port in part.outputs:
            targets = [
                ".".join(k.target) for source, links in out_of.items() if _is_end(source, part, port) for k in links
            ]
            rows.append(
                [f"{part.name}.{port.name}", "output", port.unit or DASH, port.kind, _to(targets) + _direct(port)]
            )
    columns = [name_column("signal", "signal"), *(text_column(key, key) for key in ("causality", "unit", "type"))]
    return Table("signals", [*columns, text_column("course")], rows, "Inputs and outputs")


def _is_end(end: tuple[str, str], part: Part, port: Port) -> bool:
    return end[0] == part.name and (end[1] == port.name or end[1].startswith(f"{port.name}["))


def _from(sources: Sequence[str], port: Port) -> str:
    if sources:
        return f"<- {', '.join(sources)}"
    return "keeps its start value" if port.ticks is None else f"ticks by the time ({port.ticks})"


def _to(targets: Sequence[str]) -> str:
    return f"-> {', '.join(targets)}" if targets else "recorded only"


def _direct(port: Port) -> str:
    if port.depends_on is None:
        return "; does not say which inputs act on it directly"
    return f"; direct from {', '.join(port.depends_on)}" if port.depends_on else ""


def _connections(structure: StructureData) -> Table:
    links = [(link, when(link), _conversion(link)) for link in structure.links]
    links += [(link, "clock, ticks at its own instant", "") for link in structure.clocks]
    rows = [[".".join(k.source), f"-> {'.'.join(k.target)}", value, conversion] for k, value, conversion in links]
    columns = [name_column("source", "source"), name_column("target", "   target")]
    columns += [text_column("value", "value used"), text_column("conversion", "conversion")]
    return Table("connections", columns, rows, "Connections")


def when(link: Link) -> str:
    """Which value the target uses.

    Args:
        link: between two components.
    """
    text = (
        "held, of the start of the step"
        if link.held
        else "iterated"
        if link.iterated
        else "a line, its course within the step"
        if link.line
        else "fresh, of the end of the step"
    )
    return f"{text}; in an algebraic loop" if link.in_loop else text


def _conversion(link: Link) -> str:
    if link.mapped:
        return "mapped value by value"
    if not link.converts:
        return ""
    return f"x {link.factor:.6g}" + (f" {link.offset:+.6g}" if link.offset else "")


def _groups(structure: StructureData) -> list[str]:
    lines = []
    for number, group in enumerate(structure.groups, start=1):
        inner = [link for link in structure.links if link.source[0] in group and link.target[0] in group]
        back = [str(link) for link in inner if link.held]
        what = [f"held: {'; '.join(back)}"] if back else []
        what += ["iterated"] if any(link.iterated for link in inner) else []
        knot = f" (influence one another; {', '.join(what) or 'nothing is held'})" if len(group) > 1 else ""
        lines.append(f"{number}  {', '.join(group)}{knot}")
    return lines


def _loops(structure: StructureData) -> list[str]:
    return [" -> ".join(".".join(node) for node in loop) for loop in structure.loops] or ["none"]


def _balises(structure: StructureData) -> dict[str, str]:
    balises = structure.balises
    if balises is None:
        return {}
    how = "chosen by a probe of the plant when the run is set up" if balises.method == "auto" else "asked for"
    return {
        "monitored plant": f"{balises.plant} ({balises.position}, {balises.speed})" if balises.position else "none",
        "notified": ", ".join(balises.receivers) or "nobody",
        "localisation": f"{balises.method}, {how}",
        "timing": balises.timing,
    } | ({"odometer reading": balises.odometer} if balises.odometer else {})


def _network(structure: StructureData) -> dict[str, str]:
    network = structure.network
    if network is None:
        return {}
    return {f"node {name}": ", ".join(signals) for name, signals in network.nodes.items()} | {
        "protocol": f"{network.protocol}, a transmission every {network.period:g} s, delay {network.delay}",
        "notified": ", ".join(network.notified) or "nobody",
        "last value held": ", ".join(network.held) or "nowhere",
    }

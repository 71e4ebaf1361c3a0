"""The structure of a run as tables for a terminal. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import TextWrapper
from typing import TYPE_CHECKING

from fmus.text_table import text_table

if TYPE_CHECKING:
    from cosim.structure.structure_data import Link, Part, Port, StructureData

DASH = "-"


def structure_text(structure: StructureData, width: int | None = None) -> str:
    """Components, signals, connections, groups, loops, balises, algorithm, warnings; ends without a line break.

    Args:
        structure: what to tell. width: columns at which long lists are broken; None for no limit.
    """
    sections = [
        _heading(structure),
        _section("Components, in execution order", _components(structure)),
        _section("Inputs and outputs", _ports(structure)),
        _section("Connections", _connections(structure)),
        _section("Groups", _groups(structure)),
        _section("Algebraic loops", _loops(structure)),
        _section("Movement over a step, outermost stage first", _chains(structure)),
        _section("Balises", _balises(structure)),
        _section("Network", _network(structure)),
        _section(
            "Algorithm", [f"{structure.algorithm}: {structure.reason}" if structure.reason else structure.algorithm]
        ),
        _section("Warnings", structure.warnings),
    ]
    return "\n\n".join(_broken(section, width) for section in sections if section)


def _section(title: str, lines: Sequence[str]) -> str:
    return "\n".join([title, *(f"  {line}".rstrip() for line in lines)]) if lines else ""


def _heading(structure: StructureData) -> str:
    count = round((structure.stop - structure.start) / structure.step)
    steps = "1 step" if count == 1 else f"{count} steps"
    return (
        f"{structure.name}: {structure.title}\n{structure.start:g} s to {structure.stop:g} s in {steps} of "
        f"{structure.step:g} s; {len(structure.parts)} components, {len(structure.links)} connections"
    )


def _components(structure: StructureData) -> list[str]:
    rates = any(part.rate for part in structure.parts)
    headings = ["#", "name", "kind", "FMI", "model", "inputs", "outputs", *(["steps"] if rates else []), "declares"]
    rows = [
        [
            str(number),
            part.name,
            part.kind,
            part.fmi_version,
            part.model,
            _used(part.inputs),
            _used(part.outputs),
            *([part.rate or "1"] if rates else []),
            ", ".join(part.abilities) or DASH,
        ]
        for number, part in enumerate(structure.parts, start=1)
    ]
    return [*text_table([headings, *rows], left=range(1, len(headings))), "", "inputs, outputs: connected of all"]


def _used(ports: Sequence[Port]) -> str:
    return f"{sum(port.connected for port in ports)} of {len(ports)}" if ports else DASH


def _ports(structure: StructureData) -> list[str]:
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
    return text_table([["signal", "causality", "unit", "type", ""], *rows], left=range(5))


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


def _connections(structure: StructureData) -> list[str]:
    rows = [
        [".".join(link.source), f"-> {'.'.join(link.target)}", when(link), _conversion(link)]
        for link in structure.links
    ]
    rows += [
        [".".join(link.source), f"-> {'.'.join(link.target)}", "clock, ticks at its own instant", ""]
        for link in structure.clocks
    ]
    return text_table([["source", "   target", "value used", "conversion"], *rows], left=range(4)) if rows else ["none"]


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


def _chains(structure: StructureData) -> list[str]:
    rows = [[part.name, " > ".join(part.chain)] for part in structure.parts if part.chain]
    return text_table(rows, (0, 1)) if rows else []


def _balises(structure: StructureData) -> list[str]:
    balises = structure.balises
    if balises is None:
        return []
    how = "chosen by a probe of the plant when the run is set up" if balises.method == "auto" else "asked for"
    rows = [
        ["monitored plant", f"{balises.plant} ({balises.position}, {balises.speed})" if balises.position else "none"],
        ["notified", ", ".join(balises.receivers) or "nobody"],
        ["localisation", f"{balises.method}, {how}"],
        ["timing", balises.timing],
    ]
    rows += [["odometer reading", balises.odometer]] if balises.odometer else []
    return text_table(rows, left=(0, 1))


def _network(structure: StructureData) -> list[str]:
    network = structure.network
    if network is None:
        return []
    rows = [[f"node {name}", ", ".join(signals)] for name, signals in network.nodes.items()]
    rows += [
        ["protocol", f"{network.protocol}, a transmission every {network.period:g} s, delay {network.delay}"],
        ["notified", ", ".join(network.told) or "nobody"],
        ["last value held", ", ".join(network.held) or "nowhere"],
    ]
    return text_table(rows, left=(0, 1))


def _broken(section: str, width: int | None) -> str:
    if width is None:
        return section
    lines: list[str] = []
    for line in section.split("\n"):
        lines += [line] if len(line) <= width else _wrapped(line, width)
    return "\n".join(lines)


def _wrapped(line: str, width: int) -> list[str]:
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return TextWrapper(
        width, subsequent_indent=indent, replace_whitespace=False, break_long_words=False, break_on_hyphens=False
    ).wrap(line)

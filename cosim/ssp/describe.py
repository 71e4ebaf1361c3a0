"""What is in an SSP, as plain data and as text, for those who want to know before they run it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.scenario.package_names import split_variant
from cosim.ssp.lapses import Lapses
from cosim.ssp.package import Package, Unpacked
from cosim.ssp.package_data import ComponentElement, DictionaryReference, SsdElement, SystemElement
from cosim.ssp.package_loading import find_variant, load_structure
from cosim.ssp.system_structure import read_structure


def describe_package(name: str) -> dict[str, Any]:
    """An SSP as plain data: its variants, and the system of one of them.

    Args:
        name: path of the file, with ``#VARIANT`` for another structure than ``SystemStructure.ssd``.

    Raises:
        CosimError: it cannot be read.
    """
    path, variant = split_variant(name)
    package = Package(Path(path), path, Unpacked(), Lapses())
    structure = read_structure(package, find_variant(package, variant))
    loaded = load_structure(structure, package)
    tables = loaded.tables
    return {
        "file": path,
        "name": structure.name,
        "description": structure.description,
        "SSP version": structure.version,
        "variants": [member.removesuffix(".ssd") for member in package.variants],
        **{key: tables.get(key) for key in ("start", "stop", "step")},
        "system": list(_tree(structure.system, 0)),
        "components": list(tables["components"]),
        "connections": [line if isinstance(line, str) else dict(line) for line in tables["connections"]],
        "doubts": loaded.warnings,
    }


def text_of_package(data: dict[str, Any]) -> str:
    """The same for people.

    Args:
        data: plain data of `describe`.
    """
    lines = [f"{data['name']}: {data['description']}".rstrip(": ")]
    lines += [f"SSP {data['SSP version']}, variants: {', '.join(data['variants'])}"]
    times = {key: "not given" if data[key] is None else f"{data[key]:g} s" for key in ("start", "stop", "step")}
    lines += [
        ", ".join(f"{key} {text}" for key, text in times.items()),
        "system:",
        *(f"  {line}" for line in data["system"]),
    ]
    lines += ["components of the scenario:", *(f"  {name}" for name in data["components"])]
    lines += ["connections:", *(f"  {_line(item)}" for item in data["connections"])]
    lines += ["doubts:", *(f"  {doubt}" for doubt in data["doubts"])] if data["doubts"] else []
    return "\n".join(lines)


def _tree(element: SsdElement, depth: int) -> Iterator[str]:
    kind = "system"
    if isinstance(element, ComponentElement):
        kind = element.member
    elif isinstance(element, DictionaryReference):
        kind = f"signal dictionary {element.dictionary}"
    connectors = {
        k: [c.name for c in element.connectors.values() if c.kind == k] for k in ("input", "output", "parameter")
    }
    shown = "; ".join(f"{k}s {', '.join(names)}" for k, names in connectors.items() if names)
    yield f"{'  ' * depth}{element.name} ({kind})" + (f": {shown}" if shown else "")
    if isinstance(element, SystemElement):
        for child in element.elements.values():
            yield from _tree(child, depth + 1)


def _line(item: str | dict[str, Any]) -> str:
    if isinstance(item, str):
        return item
    rest = ", ".join(f"{key} {value}" for key, value in item.items() if key not in ("from", "to"))
    return f"{item['from']} -> {item['to']} ({rest})"

"""``cosim list``: scenarios, plants and observers that ship, with their sources; or the variants in an SSP file."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cosim import ssp
from cosim.scenario.package_names import is_package
from cosim.scenario.shipped import shipped_scenarios, shipped_tables
from fmu_observer import OBSERVERS
from fmus.catalogue import CatalogueEntry, by_room
from fmus.catalogue import catalogue as models
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.tables.table import Table, name_column, pairs_table, text_column
from plant_models import PLANTS

KINDS = ("scenarios", "models", "observers", "all")
_COLUMNS = (name_column("name"), text_column("description"))


def _what(text: str) -> str:
    if text not in KINDS and not is_package(text):
        raise argparse.ArgumentTypeError(f"choose from {', '.join(KINDS)}, or give an .ssp file (got {text!r})")
    return text


GROUP = "Models and files"
HELP = "list scenarios, plants and observers"
PARSER = {"description": "Scenarios, plants and observers with their sources."}
ARGUMENTS = (argument("what", nargs="?", type=_what, default="all", help=f"{', '.join(KINDS)}, or an .ssp file"),)


def execute(options: argparse.Namespace) -> Output:
    """The lists."""
    if is_package(options.what):
        variants = ssp.list_variants(options.what)
        return Output(["variants:", pairs_table("variants", variants)], {"variants": variants})
    known = models()
    data = {kind: entries for kind, entries in catalogue(known).items() if options.what in (kind, "all")}
    parts: list[Table | str] = []
    for kind, entries in data.items():
        parts += [f"{kind}:", *_tables(kind, entries, known)]
    return Output(parts, data)


def _tables(kind: str, entries: Mapping[str, Any], known: Mapping[str, CatalogueEntry]) -> list[Table]:
    """A table for each room that the models live in; scenarios live in none."""
    rooms: Mapping[str, Sequence[str]] = {"": list(entries)}
    if kind != "scenarios":
        members = by_room([entry for name, entry in known.items() if name in entries])
        rooms = {f"# {room}": [entry.name for entry in found] for room, found in members.items()}
    return [
        Table(kind, _COLUMNS, [[name, _described(entries[name])] for name in names], title=title)
        for title, names in rooms.items()
    ]


def _described(entry: Mapping[str, Any]) -> str:
    """Description and source, and of a model presets and options, a line each."""
    lines = [entry["description"], *([f"[{entry['source']}]"] if entry["source"] else [])]
    if "presets" in entry:
        lines += [f"presets: {', '.join(entry['presets'])}"] if entry["presets"] else []
        options = [f"{option} ({values})" if values else option for option, values in entry["choices"].items()]
        lines += [f"options: {', '.join(options)}"] if options else []
    return "\n".join(lines)


def catalogue(known: Mapping[str, CatalogueEntry]) -> dict[str, dict[str, dict[str, Any]]]:
    """Everything that ships, as plain data.

    Args:
        known: the models by name.
    """
    scenarios = {}
    for name in shipped_scenarios():
        data = shipped_tables(name)
        scenarios[name] = {"description": data.get("title", ""), "source": data.get("source", "")}
    return {"scenarios": scenarios, "models": _systems(PLANTS, known), "observers": _systems(OBSERVERS, known)}


def _systems(registry: Iterable[str], known: Mapping[str, CatalogueEntry]) -> dict[str, dict[str, Any]]:
    return {
        name: {
            "description": " ".join(known[name].description.split()),
            "room": known[name].room,
            "source": known[name].source,
            "presets": list(known[name].presets),
            "options": [option.name for option in known[name].options if option.listed],
            "choices": {
                o.name: o.legal.removeprefix(", ").removeprefix("one of ") for o in known[name].options if o.listed
            },
        }
        for name in registry
    }

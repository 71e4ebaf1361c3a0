"""``cosim list``: scenarios, plants and observers that ship, with their sources; or the variants in an SSP file."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping
from typing import Any

from cosim import ssp
from cosim.cli.arguments import PLAIN_JSON
from cosim.scenario.package_names import is_package
from cosim.scenario.shipped import shipped_scenarios, shipped_tables
from fmu_observer import OBSERVERS
from fmus.catalogue import CatalogueEntry, by_room
from fmus.catalogue import catalogue as models
from fmus.cli.commands import argument
from fmus.text_table import text_table
from plant_models import PLANTS

KINDS = ("scenarios", "models", "observers", "all")


def _what(text: str) -> str:
    if text not in KINDS and not is_package(text):
        raise argparse.ArgumentTypeError(f"choose from {', '.join(KINDS)}, or give an .ssp file (got {text!r})")
    return text


PARSER = {"description": "Scenarios, plants and observers with their sources."}
ARGUMENTS = (
    argument("what", nargs="?", type=_what, default="all", help=f"{', '.join(KINDS)}, or an .ssp file"),
    PLAIN_JSON,
)


def execute(options: argparse.Namespace) -> int:
    """Print the lists.

    Args:
        options: of the command line.
    """
    if is_package(options.what):
        return _execute_package(options)
    known = models()
    data = {kind: entries for kind, entries in catalogue(known).items() if options.what in (kind, "all")}
    if options.json:
        print(json.dumps(data, indent=2))
        return 0
    for kind, entries in data.items():
        print(f"{kind}:")
        for room, names in _rooms(kind, entries, known).items():
            if room:
                print(f"\n  # {room}")
            rows = []
            for name in names:
                lines = _details(entries[name], known.get(name))
                rows += [[name, entries[name]["description"]], *(["", line] for line in lines)]
            for line in text_table(rows, left=(0, 1)):
                print(f"  {line}")
        print()
    return 0


def _rooms(kind: str, entries: Mapping[str, Any], known: Mapping[str, CatalogueEntry]) -> dict[str, list[str]]:
    """Names by the room they live in; scenarios live in none."""
    if kind == "scenarios":
        return {"": list(entries)}
    chosen = [entry for name, entry in known.items() if name in entries]
    return {room: [entry.name for entry in members] for room, members in by_room(chosen).items()}


def _details(entry: Mapping[str, Any], model: CatalogueEntry | None) -> list[str]:
    """Source, presets and options of a model, a line each; of a scenario its source."""
    lines = [f"[{entry['source']}]"] if entry["source"] else []
    if model is None or "presets" not in entry:
        return lines
    if model.presets:
        lines.append(f"presets: {', '.join(model.presets)}")
    if entry["options"]:
        words = {o.name: o.legal.removeprefix(", ").removeprefix("one of ") for o in model.options if o.listed}
        lines.append(
            "options: " + ", ".join(f"{option} ({values})" if values else option for option, values in words.items())
        )
    return lines


def _execute_package(options: argparse.Namespace) -> int:
    variants = ssp.list_variants(options.what)
    if options.json:
        print(json.dumps({"variants": variants}, indent=2))
        return 0
    print("variants:")
    for line in text_table(list(variants.items()), left=(0, 1)):
        print(f"  {line}")
    return 0


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
        }
        for name in registry
    }

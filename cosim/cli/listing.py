"""``cosim list``: scenarios, plants and observers that ship, with their sources; or the variants in an SSP file."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import Any

import fmu_observer
import plant_models
from cosim.scenario.includes import shipped_scenarios
from cosim.scenario.package_names import is_package
from cosim.simulation.scenario import Scenario
from cosim.ssp.load import list_variants
from fmus.recipes import RECIPES, by_room, legal_values, recipe_presets
from fmus.text_table import text_table

KINDS = ("scenarios", "models", "observers", "all")


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    parser = commands.add_parser("list", description="Scenarios, plants and observers with their sources.")
    parser.add_argument("what", nargs="?", type=_what, default="all", help=f"{', '.join(KINDS)}, or an .ssp file")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print the lists.

    Args:
        options: of the command line.
    """
    if is_package(options.what):
        return _execute_package(options)
    data = {kind: entries for kind, entries in catalogue().items() if options.what in (kind, "all")}
    if options.json:
        print(json.dumps(data, indent=2))
        return 0
    for kind, entries in data.items():
        print(f"{kind}:")
        for room, names in _rooms(kind, entries).items():
            if room:
                print(f"\n  # {room}")
            rows = []
            for name in names:
                entry = entries[name]
                rows += [[name, entry["description"]], *(["", line] for line in _details(kind, name, entry))]
            for line in text_table(rows, left=(0, 1)):
                print(f"  {line}")
        print()
    return 0


def _rooms(kind: str, entries: Mapping[str, Any]) -> dict[str, list[str]]:
    """Names by the room they live in; scenarios live in none."""
    if kind == "scenarios":
        return {"": list(entries)}
    return by_room(entries)


def _details(kind: str, name: str, entry: Mapping[str, Any]) -> list[str]:
    """Source, presets and options of an entry, a line each."""
    lines = [f"[{entry['source']}]"] if entry["source"] else []
    if kind == "scenarios":
        return lines
    choices = RECIPES[name].option_choices
    if entry["presets"]:
        lines.append(f"presets: {', '.join(entry['presets'])}")
    if entry["options"]:
        words = {
            option: legal_values(choices[option]).removeprefix(", ").removeprefix("one of ")
            for option in entry["options"]
        }
        lines.append(
            "options: " + ", ".join(f"{option} ({values})" if values else option for option, values in words.items())
        )
    return lines


def _what(text: str) -> str:
    if text not in KINDS and not is_package(text):
        raise argparse.ArgumentTypeError(f"choose from {', '.join(KINDS)}, or give an .ssp file (got {text!r})")
    return text


def _execute_package(options: argparse.Namespace) -> int:
    variants = list_variants(options.what)
    if options.json:
        print(json.dumps({"variants": variants}, indent=2))
        return 0
    print("variants:")
    for line in text_table(list(variants.items()), left=(0, 1)):
        print(f"  {line}")
    return 0


def catalogue() -> dict[str, dict[str, dict[str, Any]]]:
    """Everything that ships, as plain data."""
    scenarios = {}
    for name in shipped_scenarios():
        table = Scenario.load(name).table()
        scenarios[name] = {"description": table.title, "source": table.source}
    return {
        "scenarios": scenarios,
        "models": _systems(plant_models.PLANTS),
        "observers": _systems(fmu_observer.OBSERVERS),
    }


def _systems(registry: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    return {
        name: {
            "description": " ".join(system.description.split()),
            "source": system.source,
            "presets": recipe_presets(name)[0],
            "options": list(system.option_choices),
        }
        for name, system in registry.items()
    }

"""``cosim list``: scenarios, plants and observers that ship, with their sources."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import Any

from cosim.scenario import Scenario, shipped_scenarios


def register(commands: Any) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "list", help="list what ships", description="Scenarios, plants and observers with their sources."
    )
    parser.add_argument("what", nargs="?", choices=("scenarios", "models", "observers", "all"), default="all")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print the lists."""
    data = {kind: entries for kind, entries in catalogue().items() if options.what in (kind, "all")}
    if options.json:
        print(json.dumps(data, indent=2))
        return 0
    for kind, entries in data.items():
        print(f"{kind}:")
        width = max(map(len, entries), default=0)
        for name, entry in entries.items():
            print(f"  {name:<{width}}  {entry['description']}")
            extras = [f"[{entry['source']}]"] if entry["source"] else []
            extras += [f"presets: {', '.join(entry['presets'])}"] if entry.get("presets") else []
            extras += [f"options: {', '.join(entry['options'])}"] if entry.get("options") else []
            if extras:
                print(f"  {'':<{width}}  {'; '.join(extras)}")
    return 0


def catalogue() -> dict[str, dict[str, dict[str, Any]]]:
    """Everything that ships, as plain data."""
    import fmu_observer  # noqa: PLC0415 - CasADi is loaded only by those who list
    import plant_models  # noqa: PLC0415

    scenarios = {}
    for name in shipped_scenarios():
        table = Scenario.load(name).table()
        scenarios[name] = {"description": table.title, "source": table.source}
    return {"scenarios": scenarios, "models": _systems(plant_models.PLANTS), "observers": _systems(fmu_observer.OBSERVERS)}


def _systems(registry: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    return {
        name: {
            "description": " ".join(system.description.split()),
            "source": system.source,
            "presets": list(system.presets),
            "options": list(system.option_choices),
        }
        for name, system in registry.items()
    }

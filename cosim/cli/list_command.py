"""``cosim list``: scenarios, plants and observers that ship, with their sources; or the variants in an SSP file."""

from __future__ import annotations

import argparse
from typing import Any

from cosim import ssp
from cosim.scenario.package_names import is_package
from cosim.scenario.shipped import shipped_scenarios, shipped_tables
from fmu_observer import OBSERVERS
from fmus.catalogue import catalogue
from fmus.cli.commands import argument
from fmus.cli.list_command import COLUMNS, model_data, model_tables
from fmus.cli.output import Output
from fmus.tables.table import Table, pairs_table
from plant_models import PLANTS

KINDS = ("scenarios", "models", "observers", "all")


def _what(text: str) -> str:
    if text not in KINDS and not is_package(text):
        raise argparse.ArgumentTypeError(f"choose from {', '.join(KINDS)}, or give an .ssp file (got {text!r})")
    return text


GROUP = "Models and files"
PLACE = 1
HELP = "list scenarios, plants and observers"
PARSER = {"description": "Scenarios, plants and observers with their sources."}
ARGUMENTS = (argument("what", nargs="?", type=_what, default="all", help=f"{', '.join(KINDS)}, or an .ssp file"),)


def execute(options: argparse.Namespace) -> Output:
    """The lists that the options ask for."""
    if is_package(options.what):
        variants = ssp.list_variants(options.what)
        return Output(["variants:", pairs_table("variants", variants)], {"variants": variants})
    parts: list[Table | str] = []
    data: dict[str, Any] = {}
    if options.what in ("scenarios", "all"):
        data["scenarios"] = scenarios = {name: _scenario(name) for name in shipped_scenarios()}
        rows = [[name, "\n".join([s["description"], f"[{s['source']}]"])] for name, s in scenarios.items()]
        parts += ["scenarios:", Table("scenarios", COLUMNS, rows)]
    known = catalogue()
    for kind, registry in (("models", PLANTS), ("observers", OBSERVERS)):
        if options.what in (kind, "all"):
            entries = [known[name] for name in registry]
            parts += [f"{kind}:", *model_tables(kind, entries)]
            data[kind] = model_data(entries)
    return Output(parts, data)


def _scenario(name: str) -> dict[str, Any]:
    tables = shipped_tables(name)
    return {"description": tables.get("title", ""), "source": tables.get("source", "")}

"""Command line: ``fmus list``."""

from __future__ import annotations

import argparse
from typing import Any

from fmus.catalogue import CatalogueEntry, by_room, catalogue
from fmus.cli.output import Output
from fmus.tables.table import Table, name_column, text_column

GROUP = "Models"
HELP = "models that can be exported, with their presets and options"
PARSER: dict[str, Any] = {}
ARGUMENTS = ()
_COLUMNS = (name_column("name"), text_column("description"))


def execute(_options: argparse.Namespace) -> Output:
    """The models, by the room they live in."""
    rooms = by_room(catalogue().values())
    tables = [
        Table("models", _COLUMNS, [[entry.name, _described(entry)] for entry in entries], title=f"# {room}")
        for room, entries in rooms.items()
    ]
    return Output(tables, {"models": {e.name: _data(room, e) for room, entries in rooms.items() for e in entries}})


def _data(room: str, entry: CatalogueEntry) -> dict[str, Any]:
    options = {
        option.name: {"default": option.default, "values": option.legal.removeprefix(", ")} for option in entry.options
    }
    presets = {"presets": list(entry.presets), "preset": entry.preset}
    return {"description": entry.description, "room": room, "source": entry.source} | presets | {"options": options}


def _described(entry: CatalogueEntry) -> str:
    """First line of the description; presets and options, a line each; an option that no word can set is left out."""
    lines = [next(iter(entry.description.strip().splitlines()), "")]
    if entry.presets:
        default = f" (default {entry.preset})" if entry.preset else ""
        lines.append(f"  presets: {', '.join(entry.presets)}{default}")
    settable = [option for option in entry.options if option.legal or option.default is not None]
    return "\n".join([*lines, *(f"  option {option.name} = {option.default}{option.legal}" for option in settable)])

"""Command line: ``fmus list``."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from fmus.catalogue import CatalogueEntry, Option, by_room, catalogue
from fmus.cli.output import Output
from fmus.tables.table import Table, name_column, text_column

GROUP = "Models"
PLACE = 1
HELP = "models that can be exported, with their presets and options"
LOOKS = True
EXAMPLES = (
    "fmus list",
    "fmus list --json",
)
PARSER: dict[str, Any] = {}
ARGUMENTS = ()
COLUMNS = (name_column("name"), text_column("description"))


def execute(_options: argparse.Namespace) -> Output:
    """The models."""
    entries = catalogue().values()
    return Output(model_tables("models", entries), {"models": model_data(entries)})


def summary(entry: CatalogueEntry) -> str:
    """What a model is, in one line.

    Args:
        entry: of the catalogue.
    """
    return " ".join(entry.description.split())


def model_tables(key: str, entries: Iterable[CatalogueEntry], *, brief: bool = False) -> list[Table]:
    """Models with their descriptions, sources, presets and options, a table for each room that they live in.

    Args:
        key: in data. entries: of the catalogue. brief: whether descriptions alone are shown.
    """
    return [
        Table(key, COLUMNS, [[e.name, summary(e) if brief else _described(e)] for e in members], title=f"# {room}")
        for room, members in by_room(entries).items()
    ]


def model_data(entries: Iterable[CatalogueEntry]) -> dict[str, dict[str, Any]]:
    """The same as plain data, by name; an option that no word can set is left out.

    Args:
        entries: of the catalogue.
    """
    return {
        entry.name: {
            "description": summary(entry),
            "room": entry.room,
            "source": entry.source,
            "presets": list(entry.presets),
            "preset": entry.preset,
            "inputs": list(entry.inputs),
            "events": list(entry.events),
            "options": {o.name: {"default": o.default, "choices": _choices(o)} for o in _settable(entry)},
        }
        for entry in entries
    }


def _described(entry: CatalogueEntry) -> str:
    """Description, source, presets and options, a line each."""
    lines = [summary(entry), *([f"[{entry.source}]"] if entry.source else [])]
    if entry.presets:
        default = f" (default {entry.preset})" if entry.preset else ""
        lines.append(f"presets: {', '.join(entry.presets)}{default}")
    options = [f"{o.name} = {o.default} ({_choices(o) or 'any'})" for o in _settable(entry)]
    return "\n".join([*lines, *([f"options: {', '.join(options)}"] if options else [])])


def _settable(entry: CatalogueEntry) -> list[Option]:
    return [option for option in entry.options if option.legal or option.default is not None]


def _choices(option: Option) -> str:
    return option.legal.removeprefix(", ").removeprefix("one of ")

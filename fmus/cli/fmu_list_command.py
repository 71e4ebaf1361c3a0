"""Command line: ``fmus list``."""

from __future__ import annotations

import argparse
from typing import Any

from fmus.catalogue import CatalogueEntry, by_room, catalogue
from fmus.text_table import text_table

PARSER: dict[str, Any] = {}
ARGUMENTS = ()


def execute(_options: argparse.Namespace) -> int:
    """Print the lists.

    Args:
        _options: of the command line.
    """
    for room, entries in by_room(catalogue().values()).items():
        print(f"# {room}")
        rows = []
        for entry in entries:
            rows += [[entry.name, _first_line(entry.description)], *(["", f"  {line}"] for line in _choices(entry))]
        print("\n".join(text_table(rows, left=(0, 1))), end="\n\n")
    return 0


def _choices(entry: CatalogueEntry) -> list[str]:
    """Presets and options of a model in words; an option that no word can set is left out."""
    lines = []
    if entry.presets:
        default = f" (default {entry.preset})" if entry.preset else ""
        lines.append(f"presets: {', '.join(entry.presets)}{default}")
    settable = [option for option in entry.options if option.legal or option.default is not None]
    return [*lines, *(f"option {option.name} = {option.default}{option.legal}" for option in settable)]


def _first_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[0] if lines else ""

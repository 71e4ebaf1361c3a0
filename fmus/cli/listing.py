"""Command line: ``fmus list``."""

from __future__ import annotations

import argparse
from typing import Any

from fmus.recipes import RECIPES, by_room, legal_values, recipe_options, recipe_presets
from fmus.text_table import text_table


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    commands.add_parser("list").set_defaults(execute=execute)


def execute(_options: argparse.Namespace) -> int:
    """Print the lists.

    Args:
        _options: of the command line.
    """
    for room, names in by_room(RECIPES).items():
        print(f"# {room}")
        rows = []
        for name in names:
            rows += [
                [name, _first_line(RECIPES[name].description)],
                *(["", f"  {line}"] for line in _choices(name)),
            ]
        print("\n".join(text_table(rows, left=(0, 1))), end="\n\n")
    return 0


def _choices(name: str) -> list[str]:
    """Presets and options of a model in words; an option that no word can set is left out."""
    cls, lines = RECIPES[name], []
    presets, chosen = recipe_presets(name)
    if presets:
        default = f" (default {chosen})" if chosen else ""
        lines.append(f"presets: {', '.join(presets)}{default}")
    for option, value in recipe_options(name).items():
        legal = legal_values(cls.option_choices.get(option))
        if legal or value is not None:
            lines.append(f"option {option} = {value}{legal}")
    return lines


def _first_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[0] if lines else ""

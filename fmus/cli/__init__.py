"""Command line ``fmus``: list, build, check, info.

Exit codes: 0 done, 1 the FMU has problems, 2 a mistake of the user or a build that failed or was interrupted, 141
nobody reads the output any more.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from fmus.check import cli as check_cli
from fmus.cli import build as build_cli
from fmus.cli.failures import EXPECTED, words
from fmus.cli.signals import BROKEN_PIPE, forget_output, interruptible
from fmus.plain import plain
from fmus.text_table import text_table

OK, PROBLEMS, FAILED = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    options = _parser().parse_args(arguments)
    try:
        with interruptible():
            code: int = options.run(options)
            sys.stdout.flush()
    except BrokenPipeError:
        forget_output()
        return BROKEN_PIPE
    except EXPECTED as error:
        print(f"fmus: {plain(words(error, options))}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print("fmus: interrupted.", file=sys.stderr)
        return FAILED
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="fmus", description="Export train models and observers as FMUs, and check FMUs."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    listing = commands.add_parser("list", help="models that can be exported, with their presets and options")
    listing.set_defaults(run=_list)
    build_cli.add_parser(commands)
    check_cli.add_parser(commands)
    info = commands.add_parser("info", help="what an FMU says about itself, and whether it is valid")
    info.add_argument("file", type=Path, metavar="FILE")
    info.set_defaults(run=_info)
    return parser


# -- list
# ---------------------------------------------------------------------------------------------------------------


def _list(_options: argparse.Namespace) -> int:
    recipes = import_module("fmus.recipes")
    for room, names in recipes.by_room(recipes.RECIPES).items():
        print(f"# {room}")
        rows = []
        for name in names:
            rows += [
                [name, _first_line(recipes.RECIPES[name].description)],
                *(["", f"  {line}"] for line in _choices(name)),
            ]
        print("\n".join(text_table(rows, left=(0, 1))), end="\n\n")
    return OK


def _choices(name: str) -> list[str]:
    """Presets and options of a model in words; an option that no word can set is left out."""
    recipes = import_module("fmus.recipes")
    cls, lines = recipes.RECIPES[name], []
    presets, chosen = recipes.recipe_presets(name)
    if presets:
        default = f" (default {chosen})" if chosen else ""
        lines.append(f"presets: {', '.join(presets)}{default}")
    for option, value in recipes.recipe_options(name).items():
        legal = build_cli.legal(cls.option_choices.get(option))
        if legal or value is not None:
            lines.append(f"option {option} = {value}{legal}")
    return lines


def _first_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[0] if lines else ""


# -- info
# ---------------------------------------------------------------------------------------------------------------


def _info(options: argparse.Namespace) -> int:
    report = import_module("fmus.report")
    if not options.file.is_file():
        raise FileNotFoundError(f"{options.file} does not exist; give the path of an FMU.")
    print("\n".join(map(plain, report.describe_file(options.file))))
    problems = report.problems_of(options.file)
    for problem in problems:
        print(f"problem: {plain(problem)}")
    return PROBLEMS if problems else OK

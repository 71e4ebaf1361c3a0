"""``cosim show``: components of a scenario, their connections, order and loops, without running it."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from cosim.cli.scenarios import add_scenario, load_scenario


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    parser = commands.add_parser(
        "show",
        description="Components, connections, order and loops, without a run.",
    )
    add_scenario(parser)
    parser.add_argument("--picture", metavar="FILE", type=Path, help="also draw it, to a .png, .svg or .pdf file")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print, and draw where asked.

    Args:
        options: of the command line.
    """
    structure = load_scenario(options).structure()
    if options.json:
        print(json.dumps(structure.to_dict(), indent=2))
    else:
        print(structure.text(shutil.get_terminal_size().columns if sys.stdout.isatty() else None))
    if options.picture is not None:
        path = structure.draw(options.picture)
        print(f"\npicture: {path}", file=sys.stderr if options.json else sys.stdout)
    return 0

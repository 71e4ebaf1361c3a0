"""``cosim show``: components of a scenario, their connections, order and loops, without running it."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from cosim.cli.arguments import PLAIN_JSON, scenario_arguments
from cosim.cli.output import print_json
from cosim.cli.scenarios import load_scenario
from fmus.cli.commands import argument

PARSER = {"description": "Components, connections, order and loops, without a run."}
ARGUMENTS = (
    *scenario_arguments(),
    argument("--picture", metavar="FILE", type=Path, help="also draw it, to a .png, .svg or .pdf file"),
    PLAIN_JSON,
)


def execute(options: argparse.Namespace) -> int:
    """Print, and draw where asked.

    Args:
        options: of the command line.
    """
    structure = load_scenario(options).structure()
    if options.json:
        print_json(structure.to_dict())
    else:
        print(structure.text(shutil.get_terminal_size().columns if sys.stdout.isatty() else None))
    if options.picture is not None:
        path = structure.draw(options.picture)
        print(f"\npicture: {path}", file=sys.stderr if options.json else sys.stdout)
    return 0

"""``cosim show``: how the components of a scenario hang together, without running it."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from cosim.cli.run import parse_setting
from cosim.scenario import Scenario


def register(commands: Any) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "show", help="show how components hang together", description="Components, connections, order and loops, without a run."
    )
    parser.add_argument("scenario", nargs="?", default="freight_profile_d", help="name or file (default: freight_profile_d)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings",
                        help="override as for 'cosim run'; may be repeated")  # fmt: skip
    parser.add_argument("--picture", metavar="FILE", type=Path, help="also draw it, to a .png, .svg or .pdf file")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print, and draw where asked."""
    scenario = Scenario.load(options.scenario)
    for setting in options.settings:
        name, value = parse_setting(setting)
        scenario.set(name, value)
    structure = scenario.structure()
    if options.json:
        print(json.dumps(structure.to_dict(), indent=2))
    else:
        print(structure.text(shutil.get_terminal_size().columns if sys.stdout.isatty() else None))
    if options.picture is not None:
        path = structure.draw(options.picture)
        print(f"\npicture: {path}", file=sys.stderr if options.json else sys.stdout)
    return 0

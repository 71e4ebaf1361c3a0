"""``cosim export SCENARIO FILE.ssp``: a scenario as a system structure package for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.cli.scenarios import add_scenario, load_scenario


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    parser = commands.add_parser(
        "export",
        description="Write a scenario as a system structure package (SSP) for other tools.",
    )
    add_scenario(parser, default=None)
    parser.add_argument("file", type=Path, help="the package to write, ending in .ssp")
    parser.add_argument("--ssp-version", choices=("1.0", "2.0"), default="2.0", help="version of SSP (default: 2.0)")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Write the package.

    Args:
        options: of the command line.
    """
    print(load_scenario(options).export_ssp(options.file, options.ssp_version))
    return 0

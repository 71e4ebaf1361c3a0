"""``cosim export SCENARIO FILE.ssp``: a scenario as a system structure package for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.cli.run import parse_setting
from cosim.scenario import Scenario


def register(commands: Any) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "export",
        help="write a scenario as SSP",
        description="Write a scenario as a system structure package (SSP) for other tools.",
    )
    parser.add_argument("scenario", help="name of a shipped scenario, or a file (.toml or .ssp)")
    parser.add_argument("file", type=Path, help="the package to write, ending in .ssp")
    parser.add_argument("--ssp-version", choices=("1.0", "2.0"), default="2.0", help="version of SSP (default: 2.0)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings",
                        help="override a value before, as for 'run'; may be repeated")  # fmt: skip
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Write the package."""
    scenario = Scenario.load(options.scenario)
    for setting in options.settings:
        scenario.set(*parse_setting(setting))
    print(scenario.export_ssp(options.file, options.ssp_version))
    return 0

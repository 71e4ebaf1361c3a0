"""``cosim export SCENARIO FILE.ssp``: a scenario as a system structure package for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path

from cosim.cli.arguments import scenario_arguments
from cosim.cli.scenarios import load_scenario
from fmus.cli.commands import argument

PARSER = {"description": "Write a scenario as a system structure package (SSP) for other tools."}
ARGUMENTS = (
    *scenario_arguments(default=None),
    argument("file", type=Path, help="the package to write, ending in .ssp"),
    argument("--ssp-version", choices=("1.0", "2.0"), default="2.0", help="version of SSP (default: 2.0)"),
)


def execute(options: argparse.Namespace) -> int:
    """Write the package.

    Args:
        options: of the command line.
    """
    print(load_scenario(options).export_ssp(options.file, options.ssp_version))
    return 0

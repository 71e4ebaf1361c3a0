"""``cosim show``: components of a scenario, their connections, order and loops, without running it."""

from __future__ import annotations

import argparse
from pathlib import Path

from cosim.cli.arguments import TRUST_CODE, scenario_arguments
from cosim.cli.scenarios import load_scenario
from fmus.cli.commands import argument
from fmus.cli.output import Output

GROUP = "Run"
PLACE = 2
HELP = "show components, connections, order and loops"
LOOKS = True
EXAMPLES = (
    "cosim show vendor.toml",
    "cosim show vendor.toml --picture vendor.svg",
)
PARSER = {"description": "Components, connections, order and loops, without a run."}
ARGUMENTS = (
    *scenario_arguments(trust=TRUST_CODE),
    argument("--picture", metavar="FILE", type=Path, help="also draw it, to a .png, .svg or .pdf file"),
)


def execute(options: argparse.Namespace) -> Output:
    """The structure, drawn where the options ask for it."""
    structure = load_scenario(options).structure(trust=options.trust)
    files = {} if options.picture is None else {"picture": structure.draw(options.picture)}
    return Output(structure.tables(), structure.to_dict(), files)

"""Command line: ``fmus info FILE``."""

from __future__ import annotations

import argparse
from pathlib import Path

from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.fmu_report import describe_file, description_parts, problems_of
from fmus.near_files import missing_file

PROBLEMS = 1

GROUP = "FMUs"
PLACE = 1
HELP = "what an FMU says about itself, and whether it is valid"
LOOKS = True
EXAMPLES = ("fmus info vendor.fmu",)
PARSER = {"epilog": "Exit codes: 0 the description is valid, 1 it has problems, 2 error."}
ARGUMENTS = (argument("file", type=Path, metavar="FILE"),)


def execute(options: argparse.Namespace) -> Output:
    """What the file of the options says, and its problems.

    Raises:
        FileNotFoundError: there is no such file.
    """
    if not options.file.is_file():
        raise FileNotFoundError(missing_file(options.file, ".fmu"))
    data, problems = describe_file(options.file), problems_of(options.file)
    parts = [*description_parts(data), "\n".join(f"problem: {problem}" for problem in problems)]
    if problems:
        verdict = f"NOT valid: {len(problems)} problem{'s' if len(problems) > 1 else ''}."
        return Output(parts, data | {"problems": problems}, code=PROBLEMS, verdict=verdict, role="bad")
    return Output(parts, data | {"problems": problems}, verdict="The description is valid.")

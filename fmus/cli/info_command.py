"""Command line: ``fmus info FILE``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.fmu_report import describe_file, description_parts, problems_of
from fmus.near_files import missing_file

OK, PROBLEMS = 0, 1

GROUP = "FMUs"
PLACE = 1
HELP = "what an FMU says about itself, and whether it is valid"
EXAMPLES = ("fmus info vendor.fmu",)
PARSER: dict[str, Any] = {}
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
    return Output(parts, data | {"problems": problems}, code=PROBLEMS if problems else OK)

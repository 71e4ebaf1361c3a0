"""Command line: ``fmus info FILE``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from fmus.cli.commands import argument
from fmus.fmu_report import describe_file, problems_of
from fmus.plain import plain

OK, PROBLEMS = 0, 1

PARSER: dict[str, Any] = {}
ARGUMENTS = (argument("file", type=Path, metavar="FILE"),)


def execute(options: argparse.Namespace) -> int:
    """Print what the file says, and its problems.

    Args:
        options: of the command line.

    Raises:
        FileNotFoundError: there is no such file.
    """
    if not options.file.is_file():
        raise FileNotFoundError(f"{options.file} does not exist; give the path of an FMU.")
    print("\n".join(map(plain, describe_file(options.file))))
    problems = problems_of(options.file)
    for problem in problems:
        print(f"problem: {plain(problem)}")
    return PROBLEMS if problems else OK

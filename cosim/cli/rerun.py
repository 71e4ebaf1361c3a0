"""``cosim rerun``: results made again from what their folder holds, and compared with those that are there."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from cosim.cli.scenarios import OVERRIDES, parse_setting, simulated_time_bar
from cosim.provenance import rerun
from cosim.results.summary_file import jsonable

EQUAL, DIFFERS, ERROR = 0, 1, 2
DESCRIPTION = (
    "Run again what a results folder holds, and compare with the results in it. The folder may have been moved, and "
    "the "
    "FMUs it was made from may be gone. Exit codes: 0 bit-identical or within the tolerance, 1 differs, 2 it cannot be "
    "run again."
)


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    parser = commands.add_parser("rerun", description=DESCRIPTION)
    parser.add_argument("directory", metavar="DIR", help="a results folder")
    parser.add_argument("--out", metavar="OTHER", help="folder for the new results (default: only the verdict is kept)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings", help=OVERRIDES)
    parser.add_argument(
        "--tolerance",
        type=_share,
        metavar="SHARE",
        help="how far a signal may differ, as a share of its range (default: 1e-4)",
    )
    parser.add_argument("--trust", action="store_true", help="go on where files of the folder were edited since")
    parser.add_argument("--json", action="store_true", help="print the comparison as JSON")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Run, compare, tell.

    Args:
        options: of the command line.
    """
    settings = dict(parse_setting(setting) for setting in options.settings)
    bar = simulated_time_bar(silent=options.quiet or options.json)
    out = None if options.out is None else Path(options.out).absolute()
    try:
        again = rerun(
            options.directory,
            out=out,
            overrides=settings,
            tolerance=options.tolerance,
            trust=options.trust,
            progress=bar,
            warn=_warn,
            building=_ignore if options.quiet else _say,
        )
    finally:
        bar.close()
    if options.json:
        print(json.dumps(jsonable(again.to_dict()), indent=2))
    else:
        print(again.text())
        for kind, path in again.paths.items():
            print(f"{kind:>10}: {path}")
    if again.outcome.failure is not None and again.outcome.failure != again.stored_failure:
        print(f"cosim: the new run ended early: {again.outcome.failure}", file=sys.stderr)
        return ERROR
    return EQUAL if again.equal else DIFFERS


def _share(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number such as 1e-6 (got {text!r})") from None
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be zero or positive (got {text})")
    return value


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _ignore(_: str) -> None: ...


def _warn(text: str) -> None:
    print(f"warning: {text}", file=sys.stderr, flush=True)

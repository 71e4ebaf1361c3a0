"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any, get_args

from cosim.report.page.picture_files import PictureKind
from fmus.cli.commands import Argument, argument
from fmus.cli.parsers import no_number

_DEFAULT_SCENARIO = "freight_profile_d"
OVERRIDES = (
    "override component.parameter, master.KEY, balises.KEY, report.KEY, a top-level key, or case; may be repeated; the "
    "others win over case"
)


def _picture_kind(text: str) -> str:
    if text not in get_args(PictureKind):
        raise argparse.ArgumentTypeError(f"expected png or svg (got {text!r}); without a kind it stands last")
    return text


FIGURE_FILES = argument(
    "--figures",
    nargs="?",
    const="png",
    type=_picture_kind,
    metavar="KIND",
    help="draw figures as files, too, in figures beside the page: png (default) or svg",
)
QUIET = argument("--quiet", action="store_true", help="no progress")
PARAMETERS_FILE = argument("--toml", type=Path, metavar="FILE", help="write the parameters for a scenario")


def positive(text: str) -> int:
    """A whole number of at least 1, for an option of a command.

    Args:
        text: as it was typed.

    Raises:
        argparse.ArgumentTypeError: it is something else.
    """
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(no_number(text, whole=True)) from None
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1 (got {value})")
    return value


def positive_number(text: str) -> float:
    """A finite number above 0, for an option of a command.

    Args:
        text: as it was typed.

    Raises:
        argparse.ArgumentTypeError: it is something else.
    """
    return _finite(text, "above 0", lambda value: value > 0.0)


def number_from_zero(text: str) -> float:
    """A finite number of at least 0, for an option of a command.

    Args:
        text: as it was typed.

    Raises:
        argparse.ArgumentTypeError: it is something else.
    """
    return _finite(text, "of at least 0", lambda value: value >= 0.0)


def _finite(text: str, which: str, holds: Callable[[float], bool]) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(no_number(text)) from None
    if not (isfinite(value) and holds(value)):
        raise argparse.ArgumentTypeError(f"expected a finite number {which} (got {text})")
    return value


MANY_RUNS = (
    argument("--workers", type=positive, default=1, metavar="N", help="processes at a time (default: 1)"),
    argument(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="run on the workers of this scheduler of dask.distributed instead",
    ),
    argument("--resume", action="store_true", help="take over the runs that are done in the folder already"),
    argument("--retry", action="store_true", help="with --resume: run all again that failed"),
)
"""Arguments of every command that runs many; see `cosim.runs`."""


def many_runs(options: argparse.Namespace) -> dict[str, Any]:
    """What `MANY_RUNS` asks for, as keywords of a study.

    Args:
        options: of the command.
    """
    return {key: getattr(options, key) for key in ("workers", "scheduler", "resume", "retry")}


def settings_argument(text: str = OVERRIDES) -> Argument:
    """The argument ``--set``, whose words become ``options.settings``.

    Args:
        text: what the help says of it.
    """
    return argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings", help=text)


TRUST_RESULTS = argument(
    "--trust", action="store_true", help="of a results folder: run code that it names and that was never run here"
)
TRUST_CODE = argument(
    "--trust", action="store_true", help="run the Python files that a scenario names, to look into them too"
)


def scenario_arguments(
    default: str | None = _DEFAULT_SCENARIO, trust: Argument = TRUST_RESULTS
) -> tuple[Argument, Argument, Argument]:
    """The arguments ``SCENARIO``, ``--set`` and ``--trust``.

    Args:
        default: the scenario where none is given; None where one must be. trust: what the last one means.
    """
    what = "name of a shipped scenario, or a file (.toml or .ssp)"
    if default is None:
        return argument("scenario", help=what), settings_argument(), trust
    optional = argument("scenario", nargs="?", default=default, help=f"{what} (default: {default})")
    return optional, settings_argument(), trust

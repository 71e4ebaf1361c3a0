"""``cosim bound OBSERVER``: bounds of the error between samples, largest gap that keeps a limit, growth over missing
samples.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

from cosim.cli.model_info import declared_model, in_own_words
from cosim.cli.scenarios import parse_setting
from cosim.errors import CosimError
from cosim.results.summary_file import jsonable
from fmu_observer.certificates.bounds import ErrorBounds, bound_data, bound_text

KEPT, EXCEEDED = 0, 1
KINDS = ("carried", "exact")
"""What a limit may rest on; what is printed in the thesis is no bound."""


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    text = (
        "Bounds of the error of an observer whose measurement is held between samples: just before the next sample, "
        "over missing samples, and the largest gap and period that keep a limit. Beside them stands what the source "
        "prints, which is no bound."
    )
    epilog = "Exit codes: 0 done, 1 the bound at the period of the observer exceeds the limit, 2 error."
    parser = commands.add_parser("bound", description=text, epilog=epilog)
    parser.add_argument("observer", metavar="OBSERVER", help="an observer that has bounds: a name, or file.py:Class")
    parser.add_argument("--preset", metavar="NAME", help="values to start from (default: the observer's own)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="settings",
        help="a parameter, for instance --set odometer_period=0.1 or --set 'gain=[3.4, -3.4, -1.5]'",
    )
    parser.add_argument("--limit", type=float, metavar="M_S", help="largest speed error allowed [m/s]")
    parser.add_argument(
        "--missing", type=int, default=6, metavar="N", help="most samples missing in a row (default: 6)"
    )
    parser.add_argument("--by", choices=KINDS, default="carried", help="what decides the exit code (default: carried)")
    parser.add_argument("--json", action="store_true", help="print the data as JSON instead of the table")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print the bounds.

    Args:
        options: of the command line.

    Raises:
        CosimError: there is no such observer, it has no bounds, or an argument is not legal.
    """
    with in_own_words(options.observer, "bound"):
        bounds = _bounds(options)
        data = bound_data(bounds, options.limit, options.missing)
        text = (
            json.dumps(jsonable(data), indent=2) if options.json else bound_text(bounds, options.limit, options.missing)
        )
    print(text)
    exceeded = options.limit is not None and data["rows"][0][options.by] > options.limit
    return EXCEEDED if exceeded else KEPT


def _bounds(options: argparse.Namespace) -> ErrorBounds:
    name = options.observer
    made = declared_model(name, "bound", ("observer",))
    if not hasattr(made, "error_bounds"):
        raise CosimError(
            f"Observer {name!r} tells no bound of its error; discrete_measurement_observer and "
            "continuous_discrete_observer do."
        )
    bounds: ErrorBounds = made.error_bounds(dict(map(parse_setting, options.settings)), options.preset)
    return bounds

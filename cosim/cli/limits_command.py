"""``cosim limits OBSERVER``: how long a gap and a delay an observer survives, printed bounds beside exact and practical
limits.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict

from cosim.cli.arguments import JSON_NOT_TABLE
from cosim.cli.model_info import declared_model, in_own_words
from cosim.cli.output import print_json
from cosim.cli.scenarios import parse_setting
from cosim.errors import CosimError
from cosim.limits import limit_rows, limit_text
from fmus.cli.commands import argument
from plant_models.hybrid import HybridSystem

FEWEST = 4

GROUP = "Observers"
HELP = "gaps and delays that an observer survives"
PARSER = {
    "description": (
        "How much an observer survives: every printed bound of its sampling period and delay beside the exact "
        "limit of its error equations and the practical one, found by native runs beside its own model."
    ),
    "epilog": "Exit codes: 0 done, 2 error.",
}
ARGUMENTS = (
    argument("observer", metavar="OBSERVER", help="an observer that has limits: a name, or file.py:Class"),
    argument("--preset", metavar="NAME", help="values to start from (default: the observer's own)"),
    argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="set",
        help="a parameter, for instance --set theta=5",
    ),
    argument(
        "--option",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="an option, for instance --option predictors=2",
    ),
    argument("--no-runs", action="store_true", help="leave the practical limits out"),
    argument("--members", type=int, default=16, metavar="N", help="values that are tried at once (default: 16)"),
    JSON_NOT_TABLE,
)


def execute(options: argparse.Namespace) -> int:
    """Print the limits.

    Args:
        options: of the command line.

    Raises:
        CosimError: there is no such observer, it has no limits, or an argument is not legal.
    """
    name = options.observer
    if options.members < FEWEST:
        raise CosimError(f"limits: --members {options.members}: expected {FEWEST} values or more at once.")
    made = declared_model(name, "limits", ("observer",), dict(map(parse_setting, options.option)))
    if not hasattr(made, "limits"):
        raise CosimError(f"Observer {name!r} tells no limits: {_why_none(made)}")
    with in_own_words(name, "limits"):
        rows = limit_rows(
            made.limits(dict(map(parse_setting, options.set)), options.preset), not options.no_runs, options.members
        )
    if options.json:
        print_json([asdict(row) for row in rows])
    else:
        print(limit_text(made.name, rows))
    return 0


def _why_none(system: HybridSystem) -> str:
    if not system.triggered_events:
        return "no measurement comes to it as an event, so there are no gaps; try delayed_state_observer."
    return (
        "it declares no error equations (a method limits, or certify). Where it follows the odometer between its "
        f"events {', '.join(e.name for e in system.triggered_events)}, run it in a scenario with longer gaps."
    )

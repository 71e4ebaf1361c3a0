"""``cosim bound OBSERVER``: bounds of the error between samples, largest gap that keeps a limit, growth over missing
samples.
"""

from __future__ import annotations

import argparse

from cosim.cli.arguments import JSON_NOT_TABLE, settings_argument
from cosim.cli.model_info import declared_model, in_own_words
from cosim.cli.output import print_json
from cosim.cli.scenarios import parse_setting
from cosim.errors import CosimError
from fmu_observer.certificates.bounds import ErrorBounds, bound_data, bound_text
from fmus.cli.commands import argument

KEPT, _EXCEEDED = 0, 1
KINDS = ("carried", "exact")
"""What a limit may rest on; what is printed in the thesis is no bound."""

GROUP = "Observers"
HELP = "bounds of an observer's error between samples"
PARSER = {
    "description": (
        "Bounds of the error of an observer whose measurement is held between samples: just before the next "
        "sample, over missing samples, and the largest gap and period that keep a limit. Beside them stands what "
        "the source prints, which is no bound."
    ),
    "epilog": "Exit codes: 0 done, 1 the bound at the period of the observer exceeds the limit, 2 error.",
}
ARGUMENTS = (
    argument("observer", metavar="OBSERVER", help="an observer that has bounds: a name, or file.py:Class"),
    argument("--preset", metavar="NAME", help="values to start from (default: the observer's own)"),
    settings_argument("a parameter, for instance --set odometer_period=0.1 or --set 'gain=[3.4, -3.4, -1.5]'"),
    argument("--limit", type=float, metavar="M_S", help="largest speed error allowed [m/s]"),
    argument("--missing", type=int, default=6, metavar="N", help="most samples missing in a row (default: 6)"),
    argument("--by", choices=KINDS, default="carried", help="what decides the exit code (default: carried)"),
    JSON_NOT_TABLE,
)


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
        text = bound_text(bounds, options.limit, options.missing)
    if options.json:
        print_json(data)
    else:
        print(text)
    exceeded = options.limit is not None and data["rows"][0][options.by] > options.limit
    return _EXCEEDED if exceeded else KEPT


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

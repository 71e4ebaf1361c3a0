"""Command line ``fmus``; each ``<name>_command.py`` of this room is a command.

Exit codes: 0 done, 1 the FMU has problems, 2 a mistake of the user or a build that failed or was interrupted, 141
nobody reads the output any more.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from fmu_observer import OBSERVERS
from fmus.cli.commands import CommandProgram
from fmus.cli.failures import EXPECTED, in_words
from fmus.cli.signals import interruptible
from plant_models import PLANTS

PROGRAM = CommandProgram(
    "fmus",
    "Export train models and observers as FMUs, and check FMUs.",
    __name__,
    ("Models", "FMUs"),
    (
        ("Find a model or an observer", "fmus list"),
        ("Export it as an FMU", "fmus build quasi_lpv_uio"),
        ("See what an FMU declares", "fmus info vendor.fmu"),
        ("See how far it can be trusted", "fmus check vendor.fmu"),
    ),
    {".fmu": "check"},
    {"names": lambda: [*PLANTS, *OBSERVERS]},
    EXPECTED,
    interruptible,
    in_words,
    lambda _: False,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit code.

    Args:
        arguments: words after the program's name; those of the process by default.
    """
    return PROGRAM.run(sys.argv[1:] if arguments is None else arguments)

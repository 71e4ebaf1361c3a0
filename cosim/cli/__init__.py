"""The command line ``cosim``; each ``<name>_command.py`` of this room is a command. Exit codes: 0 done, 1 not as asked
for, 2 usage or run error.

A command runs in a process of its own, so that an FMU that crashes, exits or hangs there does not decide how it ends.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from cosim.cli.trust_question import trusted_now
from cosim.errors import CosimError
from cosim.process.interruption import ends_like_ctrl_c
from cosim.process.watch import can_watch, watched
from cosim.scenario.shipped import shipped_scenarios
from fmu_observer import OBSERVERS
from fmus.cli.commands import CommandProgram
from plant_models import PLANTS

__all__ = ["main"]

PROGRAM = CommandProgram(
    "cosim",
    "Co-simulate train observers with train plant FMUs, balise events exact.",
    __name__,
    ("Run", "Study", "Compare", "Observers", "Models and files"),
    (
        ("See a train and observers run", "cosim run freight_profile_d"),
        ("Put your FMU beside an observer", "cosim new vendor.fmu\ncosim run vendor.toml"),
        ("Find the observer that fits", "cosim choose vendor.fmu"),
        (
            "Check a new delivery of an FMU",
            "cosim baseline make vendor.toml vendor.json\ncosim baseline check vendor.json",
        ),
        ("Take an observer away as an FMU", "fmus build quasi_lpv_uio"),
    ),
    {".toml": "run", ".ssp": "run", ".fmu": "new"},
    {
        "scenario": shipped_scenarios,
        "subject": shipped_scenarios,
        "what": lambda: [*shipped_scenarios(), *OBSERVERS, *PLANTS],
        "model": lambda: [*PLANTS, *OBSERVERS],
        "observer": lambda: [*OBSERVERS],
        "observers": lambda: [*OBSERVERS],
    },
    (CosimError,),
    ends_like_ctrl_c,
    lambda error, _: str(error),
    trusted_now,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of ``cosim``; returns the exit code.

    Args:
        arguments: words after the program's name: the command runs in this process. None for those of the process: it
            runs in another one, where that can be.
    """
    if arguments is None and can_watch():
        return watched(lambda: PROGRAM.run(sys.argv[1:]))
    return PROGRAM.run(sys.argv[1:] if arguments is None else arguments)

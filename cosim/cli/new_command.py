"""``cosim new``: a commented starter scenario for an FMU."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from cosim.cli.stated_units import ASSUME
from cosim.starter.starter_file import StarterWishes, write_starter
from fmus.cli.commands import argument
from fmus.cli.output import Output

GROUP = "Models and files"
PLACE = 3
HELP = "write a starter scenario for an FMU"
LOOKS = False
EXAMPLES = (
    "cosim new vendor.fmu",
    "cosim new vendor.fmu --observer quasi_lpv_uio -o trial.toml",
    'cosim new vendor.fmu --assume "vIst=km/h" --assume "u1=effort,-kN"',
)
PARSER = {
    "description": (
        "Look into an FMU and write a commented scenario file: inputs and outputs, and guesses for position, "
        "speed, wheel speed and effort, to be confirmed by editing. An FMU that declares units is not executed; "
        "one that does not is run for some seconds in a process of its own, which shows units, directions and roles."
    ),
    "epilog": "Exit codes: 0 written, 2 error.",
}
ARGUMENTS = (
    argument("fmu", type=Path, help="the FMU"),
    argument("-o", "--out", type=Path, metavar="FILE", help="scenario file to write (default: NAME.toml)"),
    argument(
        "--observer",
        metavar="NAME",
        help="observer to put beside it, a name or file.py:Class (default: quasi_lpv_uio, or odometer_reset)",
    ),
    ASSUME,
    argument("--no-probe", dest="probe", action="store_false", help="run nothing of the FMU"),
    argument("--force", action="store_true", help="replace a file that exists"),
)


def execute(options: argparse.Namespace) -> Output:
    """Write the file that the options name; what was guessed."""
    target = options.out if options.out is not None else Path(f"{options.fmu.stem}.toml")
    wishes = StarterWishes(options.observer, options.assume, options.probe)
    made = write_starter(options.fmu, target, wishes, force=options.force)
    next_step = f"written: {target}. Read the comments, then: cosim run {shlex.quote(str(target))}"
    return Output(["\n".join([*made.remarks, next_step])], {"file": target, "remarks": list(made.remarks)})

"""The command line ``cosim``: run, show, list, info, export. Exit codes: 0 done, 1 not as asked for, 2 usage or run
error.

A command runs in a process of its own, so that an FMU that crashes, exits or hangs there does not decide how it ends.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence

from cosim.errors import CosimError
from cosim.process.interruption import ends_like_ctrl_c
from cosim.process.watch import can_watch, watched
from fmus.cli.commands import Command, make_parser
from fmus.plain import plain

__all__ = ["main"]

ERROR = 2
COMMANDS = (
    Command("run", "cosim.cli.run_command", "run a scenario"),
    Command("rerun", "cosim.cli.rerun_command", "run results again and compare"),
    Command("sweep", "cosim.cli.sweep_command", "run a scenario with varied values"),
    Command("tune", "cosim.cli.tune_command", "search parameters for the smallest cost over several seeds"),
    Command("compare", "cosim.cli.compare_command", "compare a result with a reference"),
    Command("baseline", "cosim.cli.baseline_command", "make, check and update baselines"),
    Command("benchmark-observers", "cosim.cli.benchmark_observers_command", "compare observers on one recorded run"),
    Command("identify", "cosim.cli.identify_command", "identify parameters of a train from a measured run"),
    Command("linearise", "cosim.cli.linearise_command", "linearise an FMU or a model at a point"),
    Command("calibrate", "cosim.cli.calibrate_command", "fit parameters of an FMU or a scenario to a recording"),
    Command("bound", "cosim.cli.bound_command", "bounds of an observer's error between samples"),
    Command("limits", "cosim.cli.limits_command", "gaps and delays that an observer survives"),
    Command("report", "cosim.cli.report_command", "report of results, or of several laid over each other"),
    Command("reference", "cosim.cli.reference_command", "trajectory behind a recording, smoothed"),
    Command("convert", "cosim.cli.convert_command", "write a result in another format"),
    Command("new", "cosim.cli.new_command", "write a starter scenario for an FMU"),
    Command("show", "cosim.cli.show_command", "show components, connections, order and loops"),
    Command("list", "cosim.cli.listing_command", "list scenarios, plants and observers"),
    Command("info", "cosim.cli.info_command", "describe an FMU, an SSP file, a plant or an observer"),
    Command("export", "cosim.cli.export_command", "write a scenario as SSP"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of ``cosim``; returns the exit code.

    Args:
        arguments: words after the program's name: the command runs in this process. None for those of the process: it
            runs in another one, where that can be.
    """
    if arguments is None and can_watch():
        return watched(lambda: _main(sys.argv[1:]))
    return _main(sys.argv[1:] if arguments is None else arguments)


def _main(arguments: Sequence[str]) -> int:
    description = "Co-simulate train observers with train plant FMUs, balise events exact."
    try:  # reading the words loads the command, which may be interrupted too
        parser = make_parser("cosim", description, COMMANDS, arguments)
        options = parser.parse_args(arguments)
        options.command_line = shlex.join(["cosim", *arguments])
        with ends_like_ctrl_c():
            code = int(options.execute(options))
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # whoever read has seen enough, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ERROR
    except CosimError as error:
        print(f"cosim: {plain(str(error))}", file=sys.stderr)
        return ERROR
    except KeyboardInterrupt:
        print("cosim: interrupted.", file=sys.stderr)
        return ERROR

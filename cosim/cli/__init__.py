"""The command line ``cosim``: run, show, list, info, export. Exit codes: 0 done, 1 not as asked for, 2 usage or run error."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Sequence

from cosim.cli import baseline, benchmark_observers, compare, convert, export, info, listing, new, report, rerun, run, show, sweep
from cosim.errors import CosimError

__all__ = ["main"]

ERROR = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of ``cosim``; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="cosim", description="Co-simulate train observers with train plant FMUs, balise events exact."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in (run, rerun, sweep, compare, baseline, benchmark_observers, report, convert, new, show, listing, info, export):
        command.register(commands)
    options = parser.parse_args(arguments)
    options.command_line = shlex.join(["cosim", *(sys.argv[1:] if arguments is None else arguments)])
    try:
        code = int(options.execute(options))
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # whoever read has seen enough, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ERROR
    except CosimError as error:
        print(f"cosim: {error}", file=sys.stderr)
        return ERROR
    except KeyboardInterrupt:
        print("cosim: interrupted.", file=sys.stderr)
        return ERROR

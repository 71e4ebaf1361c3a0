"""The command line ``cosim``; each ``<name>_command.py`` of this room is a command. Exit codes: 0 done, 1 not as asked
for, 2 usage or run error.

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
from fmus.cli.commands import executed, make_parser
from fmus.plain import plain

__all__ = ["main"]

ERROR = 2
GROUPS = ("Run", "Study", "Compare", "Observers", "Models and files")
"""Of commands, in the order of the help."""


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
        parser = make_parser("cosim", description, __name__, GROUPS, arguments)
        options = parser.parse_args(arguments)
        options.command_line = shlex.join(["cosim", *arguments])
        with ends_like_ctrl_c():
            code = executed(options, "cosim")
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

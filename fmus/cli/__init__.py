"""Command line ``fmus``; each ``<name>_command.py`` of this room is a command.

Exit codes: 0 done, 1 the FMU has problems, 2 a mistake of the user or a build that failed or was interrupted, 141
nobody reads the output any more.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from fmus.cli.commands import executed, make_parser
from fmus.cli.failures import EXPECTED, in_words
from fmus.cli.signals import BROKEN_PIPE, forget_output, interruptible
from fmus.plain import plain

_FAILED = 2
GROUPS = ("Models", "FMUs")
"""Of commands, in the order of the help."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    words = sys.argv[1:] if arguments is None else arguments
    description = "Export train models and observers as FMUs, and check FMUs."
    options = make_parser("fmus", description, __name__, GROUPS, words).parse_args(words)
    try:
        with interruptible():
            code = executed(options, "fmus")
            sys.stdout.flush()
    except BrokenPipeError:
        forget_output()
        return BROKEN_PIPE
    except EXPECTED as error:
        print(f"fmus: {plain(in_words(error, options))}", file=sys.stderr)
        return _FAILED
    except KeyboardInterrupt:
        print("fmus: interrupted.", file=sys.stderr)
        return _FAILED
    return code

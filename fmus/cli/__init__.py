"""Command line ``fmus``: list, build, check, info.

Exit codes: 0 done, 1 the FMU has problems, 2 a mistake of the user or a build that failed or was interrupted, 141
nobody reads the output any more.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from fmus.cli.commands import Command, make_parser
from fmus.cli.failures import EXPECTED, in_words
from fmus.cli.signals import BROKEN_PIPE, forget_output, interruptible
from fmus.plain import plain

_FAILED = 2
COMMANDS = (
    Command("list", "fmus.cli.fmu_list_command", "models that can be exported, with their presets and options"),
    Command("build", "fmus.cli.build_command", "export models as native FMUs"),
    Command("check", "fmus.cli.check_command", "how far an FMU can be trusted: validity and behaviour"),
    Command("info", "fmus.cli.fmu_info_command", "what an FMU says about itself, and whether it is valid"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    words = sys.argv[1:] if arguments is None else arguments
    description = "Export train models and observers as FMUs, and check FMUs."
    options = make_parser("fmus", description, COMMANDS, words).parse_args(words)
    try:
        with interruptible():
            code: int = options.execute(options)
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

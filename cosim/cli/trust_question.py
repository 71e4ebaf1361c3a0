"""The question whether code that was never run here may be run: on a terminal only."""

from __future__ import annotations

import sys

from cosim.errors import UntrustedError
from plant_models.code_trust import remember


def trusted_now(error: BaseException) -> bool:
    """Whether the user allows what an error refuses: asked where it refuses code, and somebody can answer.

    Args:
        error: of a command.
    """
    if not isinstance(error, UntrustedError) or not somebody_answers():
        return False
    files = "".join(f"  {file}\n" for file in error.files)
    print(f"This code was never run here:\n{files}It can do all that you can. Run it? [y/N] ", end="", file=sys.stderr)
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        return False
    remember(error.files)
    return True


def somebody_answers() -> bool:
    """Whether a question would be seen and answered."""
    return sys.stdin.isatty() and sys.stderr.isatty()

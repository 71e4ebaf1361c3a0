"""An error of somebody's code in one line. Standard library only."""

from __future__ import annotations

import traceback
from difflib import get_close_matches
from pathlib import Path

from plant_models.missing_package import missing_package


def explained(error: BaseException, path: Path | str | None = None) -> str:
    """An error of a user's code in one line: its kind, its message, and the file and line that it comes from; where a
    name is not defined, the nearest one that is; where a package is not installed, how to install it.

    Args:
        error: what was raised. path: of the user's file, whose last line on the way is named; None for the last of all.
    """
    if missing := missing_package(error):
        return missing
    text = f"{type(error).__name__}: {error}{_nearest(error)}".removesuffix(": ")
    if isinstance(error, SyntaxError) and error.filename:
        return f"SyntaxError: {error.msg} ({error.filename}:{error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if path is not None and frame.filename == str(path)] or frames
    return f"{text} ({own[-1].filename}:{own[-1].lineno})" if own else text


def _nearest(error: BaseException) -> str:
    """The defined name that is nearest to one that is not, as a question; empty where there is none."""
    step = error.__traceback__
    if not isinstance(error, NameError) or step is None:
        return ""
    while step.tb_next is not None:
        step = step.tb_next
    known = [*step.tb_frame.f_locals, *step.tb_frame.f_globals]
    near = get_close_matches(error.name or "", known, n=1)
    return f"; did you mean {near[0]!r}?" if near else ""

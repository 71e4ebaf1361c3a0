"""Failures of the command line in words: one line that says what failed, while what was done, and where."""

from __future__ import annotations

import argparse
import traceback

EXPECTED = (ValueError, LookupError, OSError, RuntimeError, TypeError)
"""What a mistake of the user or of a model's author, a full disk or a compiler ends with."""


def in_words(error: BaseException, options: argparse.Namespace) -> str:
    """What the user reads.

    Args:
        error: one of `EXPECTED`. options: the command line, which says what was being done.
    """
    if type(error) in (KeyError, IndexError):  # nobody wrote these for a reader
        return _unexpected(error, options)
    if isinstance(error, OSError) and error.errno is not None:
        reason = error.strerror or type(error).__name__
        return f"{error.filename}: {reason}" if error.filename else f"{reason}, while {_task(options)}"
    return str(error) or _unexpected(error, options)


def _unexpected(error: BaseException, options: argparse.Namespace) -> str:
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return f"unexpected {what} while {_task(options)}{_place(error)}; please look there, or report it."


def _task(options: argparse.Namespace) -> str:
    names, file, target = (
        getattr(options, "names", None),
        getattr(options, "file", None),
        getattr(options, "output", None),
    )
    if names:
        return f"building {', '.join(names)} into {target}"
    return f"reading {file}" if file else "working"


def _place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""

"""The one place where cvxpy, the extra `lmi`, is loaded: by designs by linear matrix inequalities, when they solve."""

from __future__ import annotations

from typing import Any


def load_cvxpy(purpose: str) -> Any:
    """The module cvxpy.

    Args:
        purpose: what needs it, for the message.

    Raises:
        ImportError: it is not installed; the message says how to.
    """
    try:
        import cvxpy  # noqa: PLC0415 - only who designs pays for it
    except ImportError as error:
        raise ImportError(f"{purpose} needs cvxpy: pip install 'fmu-observer[lmi]'.") from error
    return cvxpy

"""The one place where cvxpy, the extra `lmi`, is loaded and run: by designs by linear matrix inequalities."""

from __future__ import annotations

import warnings
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


def solved(cp: Any, question: Any, **settings: float) -> bool:
    """Whether the cone solver left numbers behind; whoever asks recomputes them.

    Args:
        cp: the module cvxpy. question: a problem of it. settings: of the solver.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "may be inaccurate": every number is checked anyway
        try:
            question.solve(solver="CLARABEL", **settings)
        except cp.error.SolverError:
            return False
    return question.status in ("optimal", "optimal_inaccurate")

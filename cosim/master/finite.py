"""Whether an array holds a number that is none, asked at every communication point. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def make_finite_check(values: np.ndarray, can_be_missing: np.ndarray) -> Callable[[], bool]:
    """A call that says whether all values are finite, or NaN where one can be missing.

    Args:
        values: shape (n,); looked at anew in each call. The flags are compared as bytes, a quarter of what ``all``
            costs.
        can_be_missing: mask of the values of which NaN says that there is none, shape (n,).
    """
    flags, good, isfinite = bytearray(len(values)), b"\1" * len(values), np.isfinite
    finite = np.frombuffer(flags, dtype=bool)
    some = bool(can_be_missing.any())

    def all_finite() -> bool:
        isfinite(values, out=finite)
        return flags == good or (some and bool((finite | (can_be_missing & np.isnan(values))).all()))

    return all_finite

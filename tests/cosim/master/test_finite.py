"""The check for numbers that are none, against NumPy's own."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cosim.master.master import _make_finite_check

CONTENTS = arrays(np.float64, 5, elements=st.floats(allow_nan=True, allow_infinity=True))


@given(st.lists(CONTENTS, min_size=1, max_size=6), arrays(bool, 5))
def test_it_says_what_numpy_says_at_every_call(contents: list[np.ndarray], can_be_missing: np.ndarray) -> None:
    """What can be missing may be NaN and nothing else, the others must be numbers."""
    values = np.zeros(5)
    check = _make_finite_check(values, can_be_missing)
    for content in contents:
        values[:] = content
        assert check() == (np.isfinite(content[~can_be_missing]).all() and not np.isinf(content[can_be_missing]).any())


def test_no_values_are_finite() -> None:
    assert _make_finite_check(np.zeros(0), np.zeros(0, dtype=bool))()


def test_the_largest_numbers_are_finite() -> None:
    assert _make_finite_check(np.full(4, np.finfo(float).max), np.zeros(4, dtype=bool))()

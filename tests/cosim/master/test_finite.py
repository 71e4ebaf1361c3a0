"""The check for numbers that are none, against NumPy's own."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cosim.master.finite import make_finite_check


@given(st.lists(arrays(np.float64, 5, elements=st.floats(allow_nan=True, allow_infinity=True)), min_size=1, max_size=6))
def test_it_says_what_numpy_says_at_every_call(contents: list[np.ndarray]) -> None:
    values = np.zeros(5)
    check = make_finite_check(values)
    for content in contents:
        values[:] = content
        assert check() == np.isfinite(content).all()


def test_no_values_are_finite() -> None:
    assert make_finite_check(np.zeros(0))()


def test_the_largest_numbers_are_finite() -> None:
    assert make_finite_check(np.full(4, np.finfo(float).max))()

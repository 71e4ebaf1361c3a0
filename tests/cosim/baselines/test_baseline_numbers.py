"""Numbers in a baseline: far inside the tolerance, no digit more than needed, instants that stay apart."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cosim.baselines.draft import _decimals_for
from cosim.baselines.table_text import Decimals, number_text, rows_text, time_text

VALUES = st.floats(-1e9, 1e9)
ALLOWED = st.floats(1e-12, 1e6)


@given(VALUES, ALLOWED)
def test_rounding_takes_less_than_a_thousandth_of_the_tolerance(value: float, allowed: float) -> None:
    text = number_text(value, _decimals_for(allowed))
    # two roundings of float64
    assert abs(float(text) - value) <= 0.5e-3 * allowed * (1.0 + 1e-9) + 2.0 * math.ulp(value)


@given(VALUES, ALLOWED)
def test_one_digit_less_would_be_too_coarse(value: float, allowed: float) -> None:
    decimals = _decimals_for(allowed)
    if decimals is not None:
        assert 10.0 ** -(decimals - 1) > 1e-3 * allowed * (1.0 - 1e-9)
        assert len(number_text(value, decimals).partition(".")[2]) <= max(decimals, 0)


@given(VALUES, ALLOWED)
def test_what_was_read_is_written_equally(value: float, allowed: float) -> None:
    decimals = _decimals_for(allowed)
    text = number_text(value, decimals)
    assert number_text(float(text), decimals) == text


@given(st.floats(allow_nan=False))
def test_nothing_allowed_keeps_every_bit(value: float) -> None:
    assert _decimals_for(0.0) is None
    assert float(number_text(value, None)) == value


def test_what_is_no_number_stays_so() -> None:
    assert [number_text(v, 3) for v in (math.nan, math.inf, -math.inf, -0.0001, 1.0, 1e22)] == [
        "nan",
        "inf",
        "-inf",
        "0",
        "1",
        "1e+22",
    ]


@given(st.lists(st.tuples(st.floats(1e-13, 1e-8), st.booleans()), min_size=1, max_size=20), ALLOWED)
def test_instants_stay_apart_and_together(steps: list[tuple[float, bool]], allowed: float) -> None:
    times = [0.0]
    for step, twice in steps:
        times.append(times[-1] + step)
        times += [times[-1]] * twice
    read = [float(text) for text in time_text(times, _decimals_for(allowed))]
    assert [b > a for a, b in pairwise(times)] == [b > a for a, b in pairwise(read)]
    assert all(b >= a for a, b in pairwise(read))


ODD = st.sampled_from([math.nan, math.inf, -math.inf, -0.0, 0.5, 2.5, 1e-5, 123450.0, 1e15, 1e300])
ROUND = st.integers(-(10**7), 10**7).map(lambda n: n / 2**6)  # ties of decimals
NUMBERS = VALUES | ODD | ROUND | st.floats()
DECIMALS = st.none() | st.integers(-20, 20)


@given(
    st.lists(st.tuples(st.floats(0.0, 1.0), NUMBERS, NUMBERS), min_size=1, max_size=30), DECIMALS, DECIMALS, DECIMALS
)
def test_rows_at_once_are_rows_one_by_one(
    rows: list[tuple[float, float, float]], time: Decimals, one: Decimals, two: Decimals
) -> None:
    """With Python's own rounding and words, number by number."""
    steps, *signals = (np.array(column) for column in zip(*rows, strict=True))
    instants = np.cumsum(np.where(steps < 0.2, 0.0, steps))  # some are equal
    texts = [time_text(instants.tolist(), time)]
    texts += [[number_text(v, digits) for v in s.tolist()] for s, digits in zip(signals, (one, two), strict=True)]
    expected = "".join(",".join(cells) + "\n" for cells in zip(*texts, strict=True))
    assert rows_text([instants, *signals], (time, one, two)) == expected

"""The variations of a sweep: grids, lists side by side, points spread over ranges."""

from __future__ import annotations

from math import log
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim.errors import ScenarioError
from cosim.studies.distributions import log_uniform, uniform, whole
from cosim.studies.sampling_plans import variations

LISTS = st.dictionaries(st.sampled_from("abc"), st.lists(st.integers(), min_size=1, max_size=4), min_size=1)


@given(LISTS)
def test_a_grid_is_every_combination_in_the_order_of_nested_loops(lists: dict[str, list[int]]) -> None:
    expected: list[dict[str, int]] = [{}]
    for name, values in lists.items():
        expected = [{**row, name: value} for row in expected for value in values]
    assert variations(lists, "grid", None, 0) == expected


def test_zip_takes_the_first_with_the_first() -> None:
    rows = variations({"a": (1, 2), "b": iter("xy")}, "zip", None, 0)
    assert rows == [{"a": 1, "b": "x"}, {"a": 2, "b": "y"}]


@settings(max_examples=30)
@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_a_latin_hypercube_has_one_point_in_every_stratum_of_every_name(count: int, seed: int) -> None:
    ranges: dict[str, Any] = {"a": uniform(2.0, 5.0), "b": log_uniform(1e-3, 1e3), "c": ["x", "y", "z"]}
    rows = variations(ranges, "latin", count, seed)
    strata = [
        sorted(int(count * (row["a"] - 2.0) / 3.0) for row in rows),
        sorted(int(count * (log(row["b"]) / log(1e6) + 0.5)) for row in rows),
    ]
    for found in strata:
        # a point at a border may round over it
        np.testing.assert_allclose(found, range(count), atol=0 if count == 1 else 1)
    assert {row["c"] for row in rows} <= {"x", "y", "z"}
    assert rows == variations(ranges, "latin", count, seed)


@given(st.integers(-5, 5), st.integers(1, 6))
def test_whole_numbers_reach_both_ends_and_no_further(low: int, width: int) -> None:
    found = {row["a"] for row in variations({"a": whole(low, low + width)}, "latin", 12 * (width + 1), 0)}
    assert found == set(range(low, low + width + 1))


def test_random_points_are_those_of_the_seed() -> None:
    rows = variations({"a": uniform(0.0, 1.0)}, "random", 3, 7)
    assert [row["a"] for row in rows] == list(np.random.default_rng(7).random(3))


@pytest.mark.parametrize(
    ("values", "mode", "count", "message"),
    [
        ({}, "grid", None, "nothing is varied"),
        ({"a": []}, "grid", None, "a: the list of values is empty"),
        ({"a": 3}, "grid", None, r"a: expected a list of values \(got 3\)"),
        ({"a": "text"}, "grid", None, "a: expected a list of values"),
        ({"a": [1, 2], "b": [1]}, "zip", None, r"lists of one length \(got a 2, b 1\)"),
        ({"a": [1]}, "gird", None, "mode 'gird' is none of"),
        ({"a": [1]}, "grid", 3, "'count' belongs to"),
        ({"a": uniform(0, 1)}, "grid", None, "a: a range is sampled"),
        ({"a": uniform(0, 1)}, "latin", None, "needs count"),
        ({"a": uniform(0, 1)}, "random", 0, r"needs count=.*\(got 0\)"),
        ([], "grid", None, "expected names with lists of values, or a list of tables"),
        ([{"a": 1}, 3], "grid", None, "expected names with lists"),
        ("a", "grid", None, "expected names with lists"),
    ],
)
def test_what_cannot_be_varied_is_reported(values: Any, mode: Any, count: int | None, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        variations(values, mode, count, 0)


@pytest.mark.parametrize("make", [lambda: uniform(1, 1), lambda: uniform(0, float("inf")), lambda: log_uniform(0, 1)])
def test_a_range_has_two_ends(make: Any) -> None:
    with pytest.raises(ScenarioError, match="range"):
        make()

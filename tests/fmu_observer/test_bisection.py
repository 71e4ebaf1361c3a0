"""Bisection between where something holds and where it does not, on which certificates and designs rest."""

from __future__ import annotations

from math import pi

import pytest

from fmu_observer.certificates.bisection import bisected
from fmu_observer.design.cone_solver import first_proven, largest_feasible


def test_the_bracket_halves_and_keeps_the_edge() -> None:
    low, high = bisected(lambda value: value <= pi, 3.0, 4.0, 10)
    assert low <= pi < high
    assert high - low == 2.0**-10


def test_it_ends_at_a_relative_width_or_below_a_least_value() -> None:
    low, high = bisected(lambda value: value <= pi, 0.0, 4.0, width=0.1)
    assert 0.05 * high < high - low <= 0.1 * high
    assert bisected(lambda _: False, 0.0, 1.0, width=1e-9, least=0.1) == (0.0, 0.0625)


def test_the_ends_are_not_asked() -> None:
    asked: list[float] = []
    bisected(lambda value: bool(asked.append(value)), 0.0, 1.0, 3)
    assert asked == [0.5, 0.25, 0.125]


@pytest.mark.parametrize(("edge", "expected"), [(9.0, 8.0), (3.3, 3.25), (0.5, None)])
def test_the_largest_feasible_value(edge: float, expected: float | None) -> None:
    assert largest_feasible(lambda value: value <= edge, 8.0, 1.0, 8) == pytest.approx(expected, abs=7.0 / 2**7)


def test_only_what_is_recomputed_is_believed() -> None:
    """Of what a solver returns the first whose every margin is positive counts; a margin of zero proves nothing."""
    margins = {"claimed": {"a": 1.0, "b": -1e-9}, "edge": {"a": 0.0}, "proven": {"a": 1e-9}, "later": {"a": 1.0}}
    assert first_proven(margins, margins.__getitem__) == ("proven", margins["proven"])
    assert first_proven(["claimed", "edge"], margins.__getitem__) is None

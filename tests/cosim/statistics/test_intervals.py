"""Intervals hold what they promise, by sums over all that can happen, and agree with SciPy's own tests."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from cosim.statistics.comparisons import _holm, compared, comparison_table
from cosim.statistics.intervals import coverage, extremes, mean_of, mean_over_samples, proportion, quantile
from cosim.statistics.run_counts import RateGoal, anytime_proportion, runs_needed, runs_to_show_below
from cosim.statistics.sensitivity import explained_share, influences, rank_correlation

ROUNDING = 1e-9
"""Of sums of a few hundred probabilities in double precision."""


@given(n=st.integers(1, 300), share=st.floats(0.02, 0.98), level=st.sampled_from([0.5, 0.9, 0.95, 0.99]))
def test_a_quantile_lies_between_its_ranks_as_often_as_said(n: int, share: float, level: float) -> None:
    """The ranks themselves are the interval of the values 1 ... n, and the number below is binomial."""
    found = quantile(np.arange(1.0, n + 1.0), share, level)
    if isnan(found.low):
        assert n < found.needed
        tails = scipy.stats.binom.pmf([0, n], n, share)
        assert max(tails) > 0.5 * (1.0 - level) - ROUNDING
        return
    held = scipy.stats.binom.cdf(found.high - 1, n, share) - scipy.stats.binom.cdf(found.low - 1, n, share)
    assert held >= level - ROUNDING
    assert found.low <= found.value <= found.high


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60))
def test_a_median_is_that_of_numpy_and_turns_with_the_signs(values: list[float]) -> None:
    found, turned = quantile(values, 0.5), quantile([-value for value in values], 0.5)
    assert found.value == pytest.approx(np.median(values), rel=1e-12)
    assert turned.value == -found.value or len(values) % 2 == 0


def test_runs_that_diverged_count_as_largest_and_missing_ones_not() -> None:
    found = quantile([1.0, nan, 2.0, inf, 3.0, inf, inf, 0.0], 0.5)
    assert (found.value, found.low, found.high, found.count) == (3.0, 0.0, inf, 7)
    assert found.text() == "3.00 (0 to ∞)"
    assert quantile(range(10), 0.99).text() == "9.00 (interval needs at least 368 runs)"
    assert extremes({"a": 1.0, "b": nan, "c": inf, "d": -2.0}) == ("d", "c")
    with pytest.raises(ValueError, match=r"share of 50; expected one between 0 and 1"):
        quantile([1.0], 50)


@given(st.lists(st.tuples(st.floats(0.0, 50.0), st.just(20)), min_size=2, max_size=30))
def test_runs_of_equal_length_give_the_mean_of_their_means(runs: list[tuple[float, int]]) -> None:
    totals, samples = zip(*runs, strict=True)
    by_samples, by_runs = mean_over_samples(totals, samples), mean_of([total / 20 for total in totals])
    assert (by_samples.value, by_samples.low, by_samples.high) == pytest.approx(
        (by_runs.value, by_runs.low, by_runs.high), rel=1e-6, abs=1e-6
    )


def test_a_bound_that_always_held_may_have_been_lucky() -> None:
    always = coverage([30] * 10, [30] * 10)
    assert (always.value, always.high) == (1.0, 1.0)
    assert always.low == pytest.approx(scipy.stats.binomtest(10, 10).proportion_ci().low, rel=1e-9)
    assert coverage([0] * 10, [30] * 10).high == pytest.approx(1.0 - always.low, rel=1e-9)
    assert coverage([30, 29, 30], [30] * 3).high == 1.0  # a share, whatever Student says


@given(limit=st.floats(1e-4, 0.3), failures=st.integers(0, 4))
def test_the_stated_number_of_runs_shows_it_and_no_smaller_one(limit: float, failures: int) -> None:
    runs = runs_to_show_below(limit, failures)
    upper = [scipy.stats.beta.ppf(0.95, failures + 1, n - failures) for n in (runs, runs - 1) if n > failures]
    assert upper[0] <= limit * (1.0 + ROUNDING)
    assert len(upper) < 2 or upper[1] > limit * (1.0 - ROUNDING)


def test_runs_needed_are_said_before() -> None:
    assert runs_to_show_below(1e-4) == 29956  # smallest n with 0.9999^n <= 0.05
    runs = runs_needed(0.01, 1e-3)
    found = proportion(round(0.01 * runs), runs)
    assert found.high - found.low == pytest.approx(2e-3, rel=2.0 / (0.01 * runs))  # one failure more or less
    for wrong in (lambda: runs_needed(2.0, 0.1), lambda: runs_to_show_below(1.0), RateGoal):
        with pytest.raises(ValueError, match="expected"):
            wrong()
    with pytest.raises(ValueError, match="cannot be shown"):
        RateGoal(below=0.25).runs(0.25)


@pytest.mark.parametrize("expected", [0.5, 0.05])
@pytest.mark.parametrize("rate", [0.02, 0.3])
def test_looking_after_every_run_costs_no_confidence(rate: float, expected: float) -> None:
    """The probability that the interval of any of the first 200 runs misses the rate, by the numbers of failures that
    can be reached without having missed.
    """
    alive, missed = {0: 1.0}, 0.0
    for n in range(1, 201):
        after: dict[int, float] = {}
        for k, weight in alive.items():
            after[k] = after.get(k, 0.0) + weight * (1.0 - rate)
            after[k + 1] = after.get(k + 1, 0.0) + weight * rate
        alive = {k: w for k, w in after.items() if w > 1e-15}
        out = [k for k in alive if not _holds(k, n, rate, expected)]
        missed += sum(alive.pop(k) for k in out)
    assert 0.0 < missed <= 0.05


def _holds(k: int, n: int, rate: float, expected: float) -> bool:
    """Whether the interval holds a rate, by the mixture itself."""
    a, b = 0.5, 0.5 / expected - 0.5
    logarithm = scipy.special.betaln(a + k, b + n - k) - scipy.special.betaln(a, b)
    inside = bool(logarithm - k * np.log(rate) - (n - k) * np.log1p(-rate) <= np.log(20.0))
    if n in (7, 60, 200):  # the interval is where the mixture stays below its limit
        found = anytime_proportion(k, n, expected=expected)
        assert (found.low <= rate <= found.high) == inside
    return inside


def test_a_goal_stops_when_it_is_reached() -> None:
    goal = RateGoal(below=1e-2)
    runs = goal.runs()
    assert goal.reached(0, runs).startswith("shown below 0.0100")
    assert goal.reached(0, runs - 1) == ""
    assert goal.reached(40, 200).startswith("shown above 0.0100")
    assert runs_to_show_below(1e-2) < runs < 2 * runs_to_show_below(1e-2)  # the price of looking
    assert RateGoal(half_width=0.05).reached(100, 1000).startswith("known to 0.0500")


def test_pairs_are_compared_and_told() -> None:
    rng, hundred = np.random.default_rng(1), 100
    weather = rng.normal(size=hundred) * 10.0
    measures = {name: weather + shift + rng.normal(size=hundred) for name, shift in (("a", 0), ("b", 2), ("c", 2))}
    found = {(d.first, d.second): d for d in compared(measures)}
    assert [d.verdict() for d in found.values()] == ["a is smaller", "a is smaller", "not shown"]
    assert found["a", "b"].difference.low < -2.0 < found["a", "b"].difference.high
    tests = [scipy.stats.binomtest(int(np.sum(measures[a] < measures[b])), hundred).pvalue for a, b in found]
    assert [d.p for d in found.values()] == pytest.approx(tests, rel=1e-9)
    assert "3 comparisons on the same disturbances" in str(comparison_table(list(found.values()), "error", "m"))
    with pytest.raises(ValueError, match="a: 2, b: 1"):
        compared({"a": [1.0, 2.0], "b": [1.0]})


def test_adjusted_values_are_those_of_holm() -> None:
    """0.01, 0.04, 0.03 become 0.03, 0.06, 0.06: Holm's own steps, by hand."""
    assert _holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert _holm([nan, 0.9, 0.9]) == [1.0, 1.0, 1.0]


@given(st.lists(st.tuples(st.integers(-5, 5), st.integers(-5, 5)), min_size=4, max_size=40))
def test_rank_correlation_is_that_of_scipy(pairs: list[tuple[int, int]]) -> None:
    x, y = zip(*pairs, strict=True)
    found = rank_correlation(x, y)
    if len(set(x)) < 2 or len(set(y)) < 2:
        assert isnan(found.value)
        return
    assert found.value == pytest.approx(scipy.stats.spearmanr(x, y).statistic, abs=1e-9)
    assert isnan(found.low) or -1.0 <= found.low <= found.value <= found.high <= 1.0


def test_what_matters_stands_first() -> None:
    rng = np.random.default_rng(2)
    x = rng.random((2000, 3))
    rail = rng.choice(["wet", "dry"], 2000)
    y = 3.0 * x[:, 0] + (x[:, 1] - 0.5) ** 2 + (rail == "wet")
    y[0] = nan
    found = influences({"seed": x[:, 2], "gap": x[:, 0], "rail": rail, "gap squared": x[:, 1]}, y)
    assert [entry.name for entry in found[:2]] == ["gap", "rail"]
    assert isnan(found[1].correlation.value)
    # y is a sum of independent parts, variances 9/12 and 1/4: a gap's share of y itself is 0.75, of its ranks near that
    assert found[0].share.value == pytest.approx(0.75, abs=0.05)
    assert found[-1].share.low == 0.0
    assert explained_share([1.0] * 200, rng.random(200)).text() == "–"

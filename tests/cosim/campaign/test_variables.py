"""What varies in a campaign: ranges, distributions, correlations and conditions of the settings that are drawn."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from cosim.campaign.conditions import Condition
from cosim.campaign.variables import VariedSettings
from cosim.errors import ScenarioError
from cosim.studies.distributions import Entries, Normal, Range

SHARES = st.lists(st.floats(0.0, 1.0, exclude_max=True), min_size=3, max_size=3)
DRAWN = {"a": Range(2.0, 5.0), "b": Normal(10.0, 2.0, 5.0, 15.0), "c": Entries(["wet", "dry"])}


@given(SHARES, st.floats(-0.9, 0.9))
def test_every_point_is_within_the_ranges(point: list[float], correlation: float) -> None:
    found = VariedSettings(DRAWN, [("a", "b", correlation)]).settings(point)
    assert 2.0 <= found["a"] <= 5.0
    assert 5.0 <= found["b"] <= 15.0
    assert found["c"] in ("wet", "dry")


@given(SHARES)
def test_without_correlation_each_setting_follows_from_its_own_coordinate(point: list[float]) -> None:
    plain = VariedSettings(DRAWN).settings(point)
    assert plain == {name: one.at(u) for (name, one), u in zip(DRAWN.items(), point, strict=True)}


@pytest.mark.parametrize("method", ["random", "latin", "sobol"])
def test_correlated_settings_keep_their_distributions(method: str) -> None:
    drawn = VariedSettings(DRAWN, [("a", "b", 0.7)]).draw(method, 2000, seed=5)  # type: ignore[arg-type]
    a, b = (np.array([one[name] for one in drawn]) for name in "ab")
    # of fixed seeds; by chance a fit falls below 1e-6 once in a million seeds
    assert scipy.stats.kstest(a, scipy.stats.uniform(2.0, 3.0).cdf).pvalue > 1e-6
    assert scipy.stats.kstest(b, scipy.stats.truncnorm(-2.5, 2.5, 10.0, 2.0).cdf).pvalue > 1e-6
    # rank correlation of a Gaussian copula, Nelsen (2006) 5.1.2: 6/pi arcsin(r/2); its deviation is 1/sqrt(2000)
    assert abs(scipy.stats.spearmanr(a, b).statistic - 6.0 / np.pi * np.arcsin(0.35)) < 5.0 / np.sqrt(2000.0)


@pytest.mark.parametrize("method", ["random", "latin", "sobol"])
def test_conditions_are_met_by_all(method: str) -> None:
    where = ["a + b < 13", "c == 'wet' or a > 3"]
    drawn = VariedSettings(DRAWN, where=where).draw(method, 300, seed=2)  # type: ignore[arg-type]
    assert len(drawn) == 300
    assert all(one["a"] + one["b"] < 13.0 and (one["c"] == "wet" or one["a"] > 3.0) for one in drawn)


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_fewer_runs_are_the_first_of_more(method: str) -> None:
    one = VariedSettings(DRAWN, where=["a + b < 13"])
    assert one.draw(method, 40, seed=9) == one.draw(method, 150, seed=9)[:40]  # type: ignore[arg-type]


def test_conditions_that_hardly_anything_meets_are_refused_with_the_worst() -> None:
    with pytest.raises(ScenarioError, match=r"fewer than one in 1000; most fail 'b > 14.9999'"):
        VariedSettings(DRAWN, where=["a > 2.5", "b > 14.9999"]).draw("random", 10, seed=1)


def test_correlations_that_nothing_has_are_refused() -> None:
    drawn = {name: Range(0.0, 1.0) for name in "xyz"}
    with pytest.raises(ScenarioError, match=r"x and y 0.9, y and z 0.9, x and z -0.9.*must be positive definite"):
        VariedSettings(drawn, [("x", "y", 0.9), ("y", "z", 0.9), ("x", "z", -0.9)])


NAMES = ["a", "b", "train.mass", "ekf.q[1]", "case", "a b"]


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_condition_is_what_python_makes_of_it(a: float, b: float) -> None:
    for text in ("a + 2 * b < 3", "not a < b", "-a <= b - 1 or a * b > 2", "0 < a < b", "a == b and a != 1"):
        assert Condition(text, NAMES).holds({"a": a, "b": b}) == eval(text, {"a": a, "b": b})


def test_names_stand_with_dots_brackets_or_in_quotes() -> None:
    settings = {"train.mass": 80e3, "ekf.q[1]": 2.0, "case": "wet", "a b": 1.0}
    for text in ("train.mass > 70e3", "ekf.q[1] == 2", "'train.mass' / 'a b' > 1", "case == 'wet'"):
        assert Condition(text, NAMES).holds(settings)


def test_a_division_by_zero_meets_nothing() -> None:
    assert not Condition("a / b < 1", NAMES).holds({"a": 1.0, "b": 0.0})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a +", "cannot be read"),
        ("a + b", "compares nothing"),
        ("mas > 3", "'mas' is not varied"),
        ("__import__('os').system('x') > 0", "may not stand in it"),
        ("a ** 9 > 1", "may not stand in it"),
        ("[a] < 3", "may not stand in it"),
        ("(lambda: 1)() < 2", "may not stand in it"),
        ("a in b", "may not stand in it"),
    ],
)
def test_what_is_no_condition_is_refused(text: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=r"campaign\.where: ") as refused:
        Condition(text, NAMES)
    assert said in str(refused.value)


def test_texts_and_numbers_are_not_compared() -> None:
    with pytest.raises(ScenarioError, match="cannot be judged"):
        Condition("case < 3", NAMES).holds({"case": "wet"})

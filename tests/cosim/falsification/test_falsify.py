"""Falsification: searches over functions whose smallest place is known, changes taken back, and a whole search whose
scenario fails; the same on any number of workers, and when it is resumed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim import Scenario
from cosim.campaign.plan import campaign_variables
from cosim.cli import main
from cosim.errors import CosimError
from cosim.falsification.falsify import falsify
from cosim.falsification.search import RestartedSearch
from cosim.falsification.smallest import fewest, nearest
from cosim.runs.journal import JOURNAL
from cosim.scenario.campaign_table import CampaignTable
from cosim.studies.distributions import uniform

WEAK = 0.004
"""Share of the cube that breaks the hollow below: at random half of all searches need 173 runs."""


def runs_until_broken(seed: int, most: int = 2000) -> int:
    """How many points a search asks for until one lies in the hollow, a cube around a point of the seed."""
    centre = np.random.default_rng(seed).uniform(0.1, 0.9, 4)
    radius = 0.5 * WEAK**0.25
    search, count = RestartedSearch(4, seed), 0
    while count < most:
        points = search.ask()
        assert ((points >= 0.0) & (points < 1.0)).all()
        margins = np.abs(points - centre).max(axis=1) - radius
        if (margins < 0.0).any():
            return count + int(np.argmax(margins < 0.0)) + 1
        search.tell(points, margins)
        count += len(points)
    return most


def test_a_slope_is_followed_in_a_third_of_the_runs_that_chance_needs() -> None:
    at_random = np.log(0.5) / np.log1p(-WEAK)  # median of the geometric distribution
    assert np.median([runs_until_broken(seed) for seed in range(20)]) <= at_random / 3.0


def test_without_a_slope_it_starts_again_and_still_finds() -> None:
    """A plateau with a hole of a fiftieth: what CMA-ES alone would leave after one collapse."""
    search, starts, found = RestartedSearch(2, 3), 0, False
    for _ in range(60):
        points = search.ask()
        costs = np.where((points < 0.14).all(axis=1), -1.0, 1.0)
        starts += len(points) == 4 * search.population
        if found := bool((costs < 0.0).any()):
            break
        search.tell(points, costs)
    assert found


def test_the_same_seed_searches_alike_and_infinite_costs_are_survived() -> None:
    asked = []
    for _ in range(2):
        search, points = RestartedSearch(3, 7), []
        for _ in range(30):
            points.append(search.ask())
            search.tell(points[-1], np.where(points[-1][:, 0] < 0.5, np.inf, points[-1].sum(axis=1)))
        asked.append(np.concatenate(points))
    np.testing.assert_array_equal(*asked)


@given(st.sets(st.sampled_from("abcdef"), min_size=1, max_size=3), st.integers(0, 63))
def test_what_is_left_breaks_it_and_cannot_do_without_any(needed: set[str], more: int) -> None:
    """Broken is what has all that is needed: then nothing else is left."""
    found = {name: 1.0 for n, name in enumerate("abcdef") if name in needed or more >> n & 1}
    assert set(fewest(found, lambda tried: [needed <= set(each) for each in tried])) == needed


@given(st.floats(-10.0, 10.0), st.floats(0.1, 5.0), st.booleans())
def test_numbers_come_towards_what_the_scenario_has(start: float, distance: float, whole: bool) -> None:
    """Broken beyond a distance: what is left lies beyond, by a 64th of the way at most, or by one where it is whole."""
    nominal, found = (round(start), round(start) + 20) if whole else (start, start + 20.0)

    def broken(tried: Sequence[Mapping[str, Any]]) -> list[bool]:
        return [each["a"] - nominal > distance for each in tried]

    left = nearest({"a": found, "name": "wet"}, {"a": nominal}, broken)
    assert distance < left["a"] - nominal <= distance + (1.0 if whole else 20.0 / 64.0) + 1e-9
    assert isinstance(left["a"], int) == whole
    assert left["name"] == "wet"


def braked() -> Scenario:
    """A locomotive that is asked to stay fast; a large brake force makes it slow, resistance alone does not."""
    scenario = Scenario(stop=0.5, step=0.05)
    speeds = {"train_speed": 10.0, "wheel_rate": 10.0 / 0.575, "effort": 5e4}
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters=speeds)
    scenario.expect("signal", name="it is on time", signal="train.position", max=9.0)
    scenario.expect("signal", name="it is fast", signal="train.speed", start=0.05, min=9.8)
    return scenario


RANGES = {"train.effort": uniform(-4e5, 9e4), "train.davis_a": uniform(0.0, 2000.0), "train.mass": uniform(8e4, 1e5)}


def test_what_it_finds_fails_and_is_small(tmp_path: Path) -> None:
    found = falsify(braked(), RANGES, runs=60, directory=tmp_path, progress=False)
    assert found.broken
    assert list(found.smallest) == ["train.effort"]
    assert found.nominal["train.mass"] == 90e3  # the model's own
    paths = found.write(tmp_path)
    outcome = Scenario.load(paths["weakness"]).run(progress=False)
    assert [each.name for each in outcome.unmet] == ["it is fast, min"] or outcome.unmet[0].number == 2
    nearer = braked().set("train.effort", 5e4 + 0.9 * (found.smallest["train.effort"] - 5e4)).run(progress=False)
    assert not nearer.unmet  # a tenth nearer to what the scenario has is met: it is small
    assert "Broken: expectation 2" in paths["weakness"].read_text().splitlines()[0]
    assert json.loads(paths["data"].read_text())["smallest"] == found.smallest


def test_workers_and_resume_change_nothing(tmp_path: Path) -> None:
    """What was done is taken from the journal: no line is added."""
    options: dict[str, Any] = {"runs": 30, "worst": True, "seed": 4, "progress": False}
    first = falsify(braked(), RANGES, directory=tmp_path, **options)
    journal = (tmp_path / JOURNAL).read_text()
    again = falsify(braked(), RANGES, directory=tmp_path, resume=True, **options)
    assert (tmp_path / JOURNAL).read_text() == journal
    two = falsify(braked(), RANGES, workers=2, **options)
    assert first.to_data() == again.to_data() == two.to_data()
    assert first.searched == 30


def test_a_campaign_says_what_varies_and_its_conditions_hold_in_what_is_found() -> None:
    """Without the condition the strongest brake alone is what is left; with it a light train must be taken along."""
    table = CampaignTable(
        runs=1,
        vary={"train.effort": {"uniform": (-4e5, 9e4)}, "train.mass": {"uniform": (80.0, 100.0), "unit": "t"}},
        where=["train.effort > -1000 * (95000 - train.mass)"],
    )
    scenario = braked()
    varied = campaign_variables(scenario, table)
    found = falsify(scenario, varied, runs=60, seed=1, progress=False)
    assert varied.unmet({"train.mass": 90e3, **found.found}) is None
    assert varied.unmet({"train.mass": 90e3, "train.effort": 5e4, **found.smallest}) is None
    never = replace(varied, where=["train.mass < 0"])
    none = falsify(scenario, never, runs=12, progress=False)
    assert (none.searched, none.broken) == (12, False)


def test_nothing_found_is_no_proof() -> None:
    found = falsify(braked(), {"train.mass": uniform(8e4, 1e5)}, runs=5, progress=False)
    assert not found.broken
    assert (found.searched, found.smallest) == (5, {})
    assert "not how rare" in found.verdict


@pytest.mark.parametrize(
    ("change", "values", "options", "said"),
    [
        ({}, {}, {}, "Nothing is varied"),
        ({"expect": []}, RANGES, {}, "expects nothing"),
        ({}, RANGES, {"expectation": 3}, "has 2, the first is 1"),
        ({"train.effort": -4e5}, RANGES, {}, "breaks expectation 2 as it is"),
        ({}, {"train.mas": uniform(1.0, 2.0)}, {}, "mas"),
        ({}, RANGES, {"resume": True}, "give directory"),
    ],
)
def test_what_cannot_be_is_refused(
    change: dict[str, Any], values: dict[str, Any], options: dict[str, Any], said: str
) -> None:
    with pytest.raises(CosimError, match=said):
        falsify(braked().with_settings(change), values, runs=1, progress=False, **options)


def test_the_command_says_where_the_failing_scenario_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = str(braked().save(tmp_path / "braked.toml")), tmp_path / "out"
    words = ["falsify", file, "--vary", "train.effort=-4e5..9e4", "--runs", "40", "--out", str(out)]
    assert main(words) == 1
    assert f"weakness: {out / 'weakness.toml'}" in capsys.readouterr().out
    assert main(["run", str(out / "weakness.toml"), "--no-report", "--quiet", "--out", str(tmp_path / "run")]) == 1
    capsys.readouterr()
    assert main(["falsify", file, "--vary", "train.mass=8e4..1e5", "--runs", "2", "--quiet", "--out", str(out)]) == 0
    assert not (out / "weakness.toml").exists()  # of another search
    assert main(["falsify", file, "--faults", "--out", str(out)]) == 2
    assert main(["falsify", file, "--out", str(out)]) == 2
    assert "Nothing is varied" in capsys.readouterr().err

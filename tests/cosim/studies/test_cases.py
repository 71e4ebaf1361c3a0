"""Cases of a scenario, sweeps over them, their groups with intervals, and sweeps that go on where one ended."""

from __future__ import annotations

import csv
import json
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError, ScenarioError
from cosim.runs.journal import JOURNAL
from cosim.statistics.intervals import mean_of
from cosim.studies.groups import grouped, groups_table
from cosim.studies.sweep_result import SweepResult
from cosim.studies.sweep_runs import SweepRun

CASES: dict[str, dict[str, Any]] = {
    "light": {"train.mass": 70e3},
    "heavy, long": {"train": {"mass": 110e3, "davis_a": 800.0}, "stop": 0.3},
}
EFFORTS = [1e4, 5e4]


def family(**more: Any) -> Scenario:
    """A plant with two cases; a run takes a few milliseconds."""
    scenario = Scenario(stop=0.2, step=0.01, cases=CASES, **more)
    return scenario.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0})


MEASURED: list[float] = []


def travelled(outcome: Any) -> float:
    MEASURED.append(float(outcome["train.position"][-1]))
    return MEASURED[-1]


def test_a_case_is_all_that_it_sets() -> None:
    assert family().cases == {
        "light": {"train.mass": 70e3},
        "heavy, long": {"train.mass": 110e3, "train.davis_a": 800.0, "stop": 0.3},
    }
    by_hand = family().set("train.mass", 110e3).set("train.davis_a", 800.0).set("stop", 0.3)
    chosen = family().run(overrides={"case": "heavy, long"})
    np.testing.assert_array_equal(chosen.result.table, by_hand.run().result.table)


def test_a_case_is_chosen_in_a_file_that_was_saved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(family().save(tmp_path / "family.toml"))
    assert Scenario.load(path).cases == family().cases
    words = ["run", path, "--no-report", "--quiet", "--out", str(tmp_path / "r")]
    assert main([*words, "--set", "case=heavy, long"]) == 0
    assert main([*words, "--set", "case=havy, long"]) == 2
    assert "did you mean 'heavy, long'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("cases", "chosen", "message"),
    [
        ({}, "light", "the scenario has no cases"),
        (CASES, "lite", "did you mean 'light'"),
        ({"a": {"trian.mass": 1.0}}, "a", "no component 'trian'"),
        ({"a": {"train.mas": 1.0}}, "a", "mas"),
    ],
)
def test_cases_that_cannot_be_are_refused_before_a_run(cases: dict[str, Any], chosen: str, message: str) -> None:
    scenario = family()
    scenario.set("cases", cases)
    with pytest.raises(CosimError, match=message):
        scenario.vary({"case": [chosen], "stop": [0.1]})


def test_what_is_varied_beside_a_case_comes_last() -> None:
    sweep = family().vary({"case": list(CASES), "train.mass": [80e3]})
    assert {sweep.varied(n).table().components["train"].parameters["mass"] for n in range(2)} == {80e3}


@pytest.fixture
def swept(tmp_path: Path) -> SweepResult:
    sweep = family().vary({"case": list(CASES), "train.effort": EFFORTS})
    return sweep.run(measure={"way": travelled}, units={"way": "m"}, directory=tmp_path / "s", folders=False)


def test_groups_are_means_with_the_interval_of_student(swept: SweepResult) -> None:
    found = grouped(swept, "case")
    ways = [run.measures["way"] for run in swept.runs[2:]]
    low, high = stats.t.interval(0.95, 1, loc=np.mean(ways), scale=stats.sem(ways))
    spread = found["heavy, long"]["way"]
    assert (spread.value, spread.low, spread.high, spread.count) == pytest.approx((np.mean(ways), low, high, 2))
    assert "heavy, long     2" in groups_table(swept, "case").text()
    assert mean_of([nan, 3.0]).text() == "3.00"
    assert mean_of([nan]).text() == "–"


def counted(case: str, **counts: float) -> SweepRun:
    return SweepRun(0, {"case": case}, measures={f"o.{name}": value for name, value in counts.items()})


def test_shares_and_rates_are_of_all_that_was_counted() -> None:
    """A mean of shares would be 0.5: one of ten and nine of ten are not one of two."""
    names = ("missed_faults", "faults", "missed_share", "false_alarms", "evaluated_time", "false_alarms_per_hour")
    runs = [
        counted("a", **dict(zip(names, (0.0, 1.0, 0.0, 1.0, 900.0, 4.0), strict=True))),
        counted("a", **dict(zip(names, (9.0, 9.0, 1.0, 0.0, 2700.0, 0.0), strict=True))),
        counted("a", **dict.fromkeys(names, nan)),
    ]
    found = grouped(SweepResult(family(), ["case"], runs), "case")["a"]
    exact = stats.binomtest(9, 10).proportion_ci(0.95, "exact")
    share = found["o.missed_share"]
    assert (share.value, share.low, share.high) == pytest.approx((0.9, exact.low, exact.high))
    rate = found["o.false_alarms_per_hour"]
    assert (rate.value, rate.low, rate.high) == pytest.approx(
        (1.0, stats.chi2.ppf(0.025, 2) / 2, stats.chi2.ppf(0.975, 4) / 2)
    )


def test_columns_have_labels_units_and_factors(swept: SweepResult) -> None:
    column = {"measure": "way", "label": "w", "factor": 1000.0, "unit": "mm"}
    result = SweepResult(swept.scenario.copy().report(measures=[column]), swept.names, swept.runs)
    assert "w [mm]" in result.text().splitlines()[1]
    assert result.text().splitlines()[3].endswith(f"{1000 * swept[0].measures['way']:.0f}")
    wrong = SweepResult(swept.scenario.copy().report(measures=["wey"]), swept.names, swept.runs)
    with pytest.raises(ScenarioError, match="did you mean 'way'"):
        wrong.text()


def test_a_sweep_goes_on_where_one_ended(swept: SweepResult, tmp_path: Path) -> None:
    """Runs of the same scenario are taken over; those that failed, were cut off or changed are not."""
    folder = tmp_path / "s"
    lines = (folder / JOURNAL).read_text().splitlines()
    assert len(lines) == 4
    failed = json.dumps(json.loads(lines[2]) | {"failure": "stopped", "outside": True})
    (folder / JOURNAL).write_text("\n".join([lines[0], lines[1], failed, lines[3][:50]]))
    MEASURED.clear()
    sweep = family().vary({"case": list(CASES), "train.effort": EFFORTS})
    ticks: list[tuple[int, int]] = []
    resumed = sweep.run(
        measure={"way": travelled}, directory=folder, folders=False, resume=True, progress=lambda *t: ticks.append(t)
    )
    assert [run.measures for run in resumed.runs] == [run.measures for run in swept.runs]
    assert len(MEASURED) == 2
    assert ticks == [(3, 4), (4, 4)]
    changed = family().set("train.davis_b", 40.0).vary({"case": list(CASES), "train.effort": EFFORTS})
    changed.run(measure={"way": travelled}, directory=folder, folders=False, resume=True)
    assert len(MEASURED) == 6
    with pytest.raises(ScenarioError, match="resumed from its folder"):
        sweep.run(resume=True)


def test_what_a_command_sets_wins_over_a_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Wherever it stands, for one run and for all cases."""
    path, out = str(family().save(tmp_path / "family.toml")), tmp_path / "out"
    assert main(["run", path, "--set", "stop=0.1", "--set", "case=heavy, long", "--out", str(out), "--quiet"]) == 0
    assert "0.1 s simulated" in capsys.readouterr().out
    words = ["sweep", path, "--cases", "--set", "stop=0.1", "--set", "train.effort=1e4", "--quiet", "--out", str(out)]
    for more in ([], ["--zip"]):
        assert main([*words, *more, "--table-only"]) == 0
        with (out / "index.csv").open() as file:
            assert [row["stop"] for row in csv.DictReader(file)] == ["0.1", "0.1"]
    capsys.readouterr()


def test_the_command_runs_all_cases_and_groups_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(family().save(tmp_path / "family.toml"))
    out = tmp_path / "out"
    words = ["sweep", path, "--cases", "--vary", "train.effort=1e4,5e4", "--by", "case", "--quiet", "--out", str(out)]
    assert main([*words, "--table-only"]) == 0
    assert "4 of 4 runs done" in capsys.readouterr().out
    assert sorted(p.name for p in out.iterdir()) == [
        "groups.csv",
        "index.csv",
        "index.html",
        "index.json",
        "runs.jsonl",
    ]
    assert (out / "groups.csv").read_text().startswith("case,measure,unit,mean,low,high,count\n")
    assert main([*words, "--resume"]) == 0
    assert main(["sweep", path, "--cases", "--by", "train.effort"]) == 2
    assert "this is not varied" in capsys.readouterr().err
    assert main(["sweep", path]) == 2
    assert "--cases for a scenario with cases" in capsys.readouterr().err
    bare = str(Scenario(stop=0.2, step=0.01).add("o", model="odometer").save(tmp_path / "bare.toml"))
    assert main(["sweep", bare, "--cases"]) == 2
    assert "has no cases" in capsys.readouterr().err

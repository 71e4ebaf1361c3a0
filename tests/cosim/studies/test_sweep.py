"""Sweeps: every variation is run as it would be alone, whatever happens to the others, and nothing computed is lost."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.errors import ComparisonError, CosimError, OutputError, RunError, ScenarioError
from cosim.master.master import Master
from cosim.report.live.live_page import PageVerdict
from cosim.results.results_folder import read_results
from cosim.run.outcome import Outcome
from cosim.runs.journal import JOURNAL, read_lines
from cosim.studies.distributions import uniform
from cosim.studies.live_sweep import sweep_page
from cosim.studies.measures import UNMET
from cosim.studies.seed_runs import seed_study
from cosim.studies.sweep_files import write_index
from cosim.studies.sweep_result import SweepResult
from cosim.studies.sweep_runs import SweepRun, SweepRuns

MASSES = [70e3, 110e3]


def plant() -> Scenario:
    """The small scenario without driver and observer, so that a run takes a few milliseconds."""
    scenario = Scenario(stop=0.2, step=0.01)
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0, "effort": 5e4})
    return scenario


def travelled(outcome: Outcome) -> float:
    return float(outcome["train.position"][-1])


@pytest.fixture(scope="module")
def swept() -> SweepResult:
    """Two masses and two latencies of the small scenario."""
    sweep = small(title="Swept").vary({"locomotive.mass": MASSES, "balises.latency": [0.0, 0.02]})
    return sweep.run(
        measure={"last speed": lambda outcome: outcome["locomotive.speed"][-1]}, units={"last speed": "m/s"}
    )


def test_each_run_is_the_one_with_these_overrides(swept: SweepResult) -> None:
    assert [dict(run.settings) for run in swept.runs] == [
        {"locomotive.mass": mass, "balises.latency": latency} for mass in MASSES for latency in (0.0, 0.02)
    ]
    alone = small().run(overrides={"locomotive.mass": 110e3, "balises.latency": 0.02})
    outcome = swept[3].outcome
    assert outcome is not None
    np.testing.assert_array_equal(outcome.result.table, alone.result.table)


def test_measures_are_the_errors_of_the_table_and_the_users_own(swept: SweepResult) -> None:
    row, outcome = swept.table()[1], swept[1].outcome
    assert outcome is not None
    error = outcome["observer.speed"] - outcome["locomotive.speed"]
    assert row["observer.speed_error_max"] == np.max(np.abs(error))
    # Uniform steps but for three events: the plain mean of squares is the integral to a few per cent.
    assert row["observer.speed_error_rms"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.05)
    assert row["last speed"] == outcome["locomotive.speed"][-1]
    assert (row["run"], row["failure"], row["balises.latency"]) == (1, None, 0.02)
    frame = swept.to_pandas()
    assert list(frame["last speed"]) == [r["last speed"] for r in swept.table()]
    assert frame.index.name == "run"


def test_a_run_that_misses_an_expectation_is_not_simply_done() -> None:
    scenario = plant().expect("signal", signal="train.position", max=2.0)
    result = scenario.vary({"train.effort": [0.0, 5e4, 9e4]}).run()
    largest = [run.result.table["train.position"].max() for run in result.runs if run.result is not None]
    assert [run.ending for run in result.runs] == ["1 not met" if x > 2.0 else "done" for x in largest]
    assert {run.ending for run in result.runs} == {"1 not met", "done"}
    page = sweep_page(result, Path())
    assert page.verdict.mood == "doubt"
    assert result.unmet in page.verdict.text
    assert result.unmet in repr(result).splitlines()[0]


def test_results_do_not_depend_on_the_number_of_workers() -> None:
    sweep = plant().vary([{"train.mass": 70e3}, {"stop": 0.1}, {"train.effort": -5e4}])
    done: list[tuple[int, int]] = []
    here, there = sweep.run(), sweep.run(workers=2, progress=lambda *reported: done.append(reported))
    for a, b in zip(here.runs, there.runs, strict=True):
        assert a.outcome is not None
        assert b.outcome is not None
        np.testing.assert_array_equal(a.outcome.result.table, b.outcome.result.table)
        assert (a.number, a.settings, a.measures, a.failure) == (b.number, b.settings, b.measures, b.failure)
    assert done == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("keep", [False, True])
def test_folders_do_not_depend_on_who_wrote_them(tmp_path: Path, *, keep: bool) -> None:
    """One process or two, with outcomes kept or not: the same files with the same bytes, but for times of the clock."""
    sweep = plant().vary({"train.mass": MASSES})
    here = sweep.run(keep=keep, directory=tmp_path / "here")
    there = sweep.run(2, keep=keep, directory=tmp_path / "there")
    assert [run.measures for run in here.runs] == [run.measures for run in there.runs]
    assert [run.folder for run in there.runs] == [tmp_path / "there" / f"run_00{k}" for k in range(2)]
    files = [sorted(p.relative_to(root) for root in [tmp_path / f] for p in root.rglob("*")) for f in ("here", "there")]
    assert files[0] == files[1]
    for table in (tmp_path / "here").rglob("table.csv"):
        assert table.read_bytes() == (tmp_path / "there" / table.relative_to(tmp_path / "here")).read_bytes()
    for outcome in here.runs + there.runs:
        assert (outcome.outcome is not None) == keep


@pytest.mark.parametrize("workers", [1, 2])
def test_results_that_cannot_be_written_end_the_sweep(tmp_path: Path, workers: int) -> None:
    """A file stands where the folder of a run should be."""
    (tmp_path / "run_000").write_text("")
    with pytest.raises(OutputError, match="run_000"):
        plant().vary({"train.mass": MASSES}).run(workers, keep=False, directory=tmp_path)


def test_runs_that_fail_do_not_stop_the_others(tmp_path: Path) -> None:
    """The first and the last cannot begin; a measure of the user's fails in one of the others."""

    def touchy(outcome: Outcome) -> float:
        return 1.0 / (travelled(outcome) < 2.5)

    sweep = (
        plant()
        .balises(position="train.position", speed="train.speed", layout="csv", file="balises.csv")
        .vary(
            {"balises.file": ["none.csv", str(tmp_path / "some.csv"), "missing.csv"], "train.train_speed": [10.0, 20.0]}
        )
    )
    (tmp_path / "some.csv").write_text("position\n1.0\n")
    result = sweep.run(measure={"touchy": touchy, "travelled": travelled})
    assert [run.number for run in result.failed] == [0, 1, 4, 5]
    assert "none.csv does not exist" in str(result[0].failure)
    table = result.table()
    assert table[2]["touchy"] == 1.0
    assert np.isnan(table[3]["touchy"])
    assert table[3]["travelled"] > 3.9
    text = result.text()
    assert "run 3: measure 'touchy': ZeroDivisionError: float division by zero" in text
    assert "run 5 failed" in text
    with pytest.raises(ComparisonError, match="Run 0 has no results to compare with; these have: 2, 3"):
        result.compare()
    assert result.plot("travelled", "train.train_speed").get_title(loc="left") == "4 of 6 runs failed"


def test_a_sweep_in_a_folder_can_be_read_without_it(swept: SweepResult, tmp_path: Path) -> None:
    paths = swept.write(tmp_path)
    np.testing.assert_array_equal(read_results(tmp_path / "run_002").table, swept[2].outcome.result.table)  # type: ignore[union-attr]
    with paths["csv"].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["last speed"]) for row in rows] == [row["last speed"] for row in swept.table()]
    assert [row["folder"] for row in rows] == [f"run_{n:03d}" for n in range(4)]
    data = json.loads(paths["json"].read_text())
    assert data["varied"] == ["locomotive.mass", "balises.latency"]
    assert data["runs"][3]["settings"] == {"locomotive.mass": 110e3, "balises.latency": 0.02}
    page = paths["page"].read_text("utf-8")
    links = [f"run_{n:03d}/report.html" for n in range(4)]
    assert re.findall(r'<a href="([^"]*)"', page) == links
    assert all((tmp_path / link).is_file() for link in links)


def test_what_is_computed_stays_when_the_sweep_is_interrupted(tmp_path: Path) -> None:
    def interrupt(done: int, _count: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plant().vary({"train.mass": [70e3, 80e3, 90e3, 100e3]}).run(progress=interrupt, directory=tmp_path)
    assert sorted(p.name for p in tmp_path.glob("run_*")) == ["run_000", "run_001", "run_002"]
    journal = [json.loads(line)["settings"] for line in (tmp_path / JOURNAL).read_text().splitlines()]
    assert journal == [{"train.mass": 70e3}, {"train.mass": 80e3}, {"train.mass": 90e3}]
    index = json.loads((tmp_path / "index.json").read_text())["runs"]
    assert [run["settings"] for run in index] == journal


def test_outcomes_that_are_not_kept_are_read_from_their_folders(tmp_path: Path) -> None:
    sweep = plant().vary({"train.mass": [70e3, 70e3, 90e3]})
    thin = sweep.run(keep=False, directory=tmp_path)
    assert [run.outcome for run in thin.runs] == [None] * 3
    compared = thin.compare(reference=1)
    assert [(number, found.equal) for number, found in compared.items()] == [(0, True), (2, False)]
    assert {s.name for s in compared[2].failed} >= {"train.speed", "train.position"}


def test_the_picture_has_units_and_a_line_for_each_other_value(swept: SweepResult) -> None:
    ax = swept.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("locomotive.mass [kg]", "observer.speed_error_max [m/s]")
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    assert set(lines) == {"balises.latency = 0", "balises.latency = 0.02"}
    np.testing.assert_array_equal(np.asarray(lines["balises.latency = 0"].get_xdata()), MASSES)
    expected = [swept.table()[n]["observer.speed_error_max"] for n in (0, 2)]
    np.testing.assert_array_equal(np.asarray(lines["balises.latency = 0"].get_ydata()), expected)
    assert swept.plot("last speed", "balises.latency").get_xlabel() == "balises.latency [s]"
    assert swept.plot("last speed").get_ylabel() == "last speed [m/s]"
    with pytest.raises(OutputError, match="no measure 'last sped'; did you mean 'last speed'"):
        swept.plot("last sped")


def test_points_of_a_hypercube_are_no_line_and_words_are_categories() -> None:
    ranges = {"train.mass": uniform(7e4, 9e4), "train.effort": uniform(0.0, 1e4)}
    result = plant().vary(ranges, "latin", count=3).run(measure={"x": travelled})
    (line,) = result.plot().get_lines()
    assert line.get_linestyle() == "None"
    assert list(np.asarray(line.get_xdata())) == sorted(row["train.mass"] for row in result.table())
    ax = plant().vary({"train.as": ["block3", "block2"]}).run(measure={"x": travelled}).plot()
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["block3", "block2"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"trian.mass": [1.0]}, r"run 0 \(trian\.mass = 1\.0\): .*no component 'trian'; did you mean 'train'"),
        ({"train.mas": [1.0]}, r"run 0 .*no variable 'mas'; did you mean 'mass'"),
        ({"train.mass": [-1.0]}, r"run 0 .*train\.mass: -1 lies outside"),
        ({"stop": [0.2, 0.205]}, r"run 1 \(stop = 0\.205\): .*does not divide"),
        ({"master.steper": ["python"]}, r"master\.steper: unknown key"),
    ],
)
def test_a_variation_that_cannot_be_is_refused_before_anything_runs(values: dict[str, Any], message: str) -> None:
    with pytest.raises(CosimError, match=message):
        plant().vary(values)


def test_a_sweep_needs_a_worker() -> None:
    with pytest.raises(ScenarioError, match="at least one worker"):
        plant().vary({"stop": [0.1]}).run(workers=0)


def test_the_scenario_is_left_as_it_was() -> None:
    scenario = plant()
    sweep = scenario.vary({"train.mass": [70e3]})
    scenario.set("train.mass", 50e3)
    outcome = sweep.run()[0].outcome
    assert outcome is not None
    assert outcome.result.summary["components"][0]["parameters"]["mass"] == 70e3
    assert scenario.table().components["train"].parameters["mass"] == 50e3


def test_a_study_over_seeds_is_the_sweep_over_them() -> None:
    scenario = small().set("balises.layout", "aperiodic").set("balises.max_gap", 0.2)
    study = seed_study(scenario, [3, 5])
    table = scenario.vary({"seed": [3, 5]}).run().table()
    assert study.errors["observer", "whole run"] == [row["observer.speed_error_max"] for row in table]


def test_one_failed_seed_is_named_and_the_rest_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = small().set("balises.layout", "aperiodic").set("balises.max_gap", 0.2)
    whole, run, key = seed_study(scenario, [3, 5, 7]), Scenario.run, ("observer", "whole run")

    def failing(self: Scenario, **arguments: Any) -> Outcome:
        if arguments["overrides"] == {"seed": 5}:
            raise RunError("the train is lost", "train", 0.1)
        return run(self, **arguments)

    monkeypatch.setattr(Scenario, "run", failing)
    lines: list[list[dict[str, Any]]] = []
    study = seed_study(scenario, [3, 5, 7], lambda *_: lines.append(read_lines(tmp_path / JOURNAL)), directory=tmp_path)
    assert study.seeds == [3, 7]
    assert study.failures == {5: "the train is lost"}
    assert [row for row in study.each if row.seed != 5] == [row for row in whole.each if row.seed != 5]
    assert study.errors["observer", "whole run"] == [whole.errors["observer", "whole run"][i] for i in (0, 2)]
    assert "over 2 seeds" in study.text()
    assert "seed 5 failed: the train is lost" in study.text()
    assert [entry["failure"] for entry in study.to_data()["each"]] == [None, "the train is lost", None]
    assert [len(there) for there in lines] == [1, 2, 3]  # as they come
    assert [(line["seed"], line["failure"]) for line in lines[2]] == [(3, None), (5, "the train is lost"), (7, None)]
    assert lines[2][2]["row"]["measures"]["observer.whole run.speed_error_max"] == study.each[2].errors[key]
    again = seed_study(scenario, [7, 5, 3], directory=tmp_path, resume=True)
    assert again.each == study.each[::-1]
    with pytest.raises(RunError, match=r"No seed could be run to its end\. Seed 5: the train is lost"):
        seed_study(scenario, [5])


def test_the_order_of_seeds_changes_nothing() -> None:
    scenario = small().set("balises.layout", "aperiodic").set("balises.max_gap", 0.2)
    assert seed_study(scenario, [3, 5, 7]).each == seed_study(scenario, [7, 5, 3]).each[::-1]


def test_who_interrupts_a_run_stops_the_sweep_and_keeps_what_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step, begun = Master.run, []

    def interrupted(master: Master) -> None:
        begun.append(master)
        if len(begun) == 2:
            raise KeyboardInterrupt
        step(master)

    monkeypatch.setattr(Master, "run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        plant().vary({"train.mass": [70e3, 80e3, 90e3]}).run(directory=tmp_path)
    assert len(begun) == 2
    assert len(json.loads((tmp_path / "index.json").read_text())["runs"]) == 2
    assert read_results(tmp_path / "run_000").failure is None


def test_the_verdict_names_every_component_that_has_the_measure_the_best_first(tmp_path: Path) -> None:
    measures = [{"a.error": 1.0 * n, "b.error": -0.5 * n, "b.way": 9.0} for n in (1, 2)]
    runs = [SweepRun(n, {"seed": n}, measures=own) for n, own in enumerate(measures)]
    units = {"a.error": "m", "b.error": "m"}
    page = sweep_page(SweepRuns(plant(), ["seed"], runs, units), tmp_path)
    ending = "2 of 2 runs came to their end"
    assert page.verdict == PageVerdict(f"{ending}. error: b -1.000 to -0.5000 m, a 1.000 to 2.000 m.", "")
    met = [replace(run, measures={**run.measures, UNMET: 0.0}) for run in runs]
    page = sweep_page(SweepRuns(plant(), ["seed"], met, units), tmp_path)
    assert (page.verdict.mood, page.verdict.text.partition(". ")[0]) == ("good", f"{ending} and met all expectations")


def test_of_no_run_nothing_good_is_said(tmp_path: Path) -> None:
    assert sweep_page(SweepRuns(plant(), ["train.mass"], []), tmp_path).verdict == PageVerdict(
        "No run was made.", "bad"
    )


def test_names_that_are_no_unicode_are_written(tmp_path: Path) -> None:
    """As those of files may be."""
    runs = [SweepRun(0, {"train.file": "a\ud800"}, measures={"b\ud800": 1.0})]
    paths = write_index(SweepRuns(plant(), ["train.file"], runs), tmp_path)
    assert "a\\ud800" in paths["csv"].read_text(encoding="utf-8")


def test_the_page_names_what_failed_the_worst_run_and_what_it_goes_with(tmp_path: Path) -> None:
    runs = [SweepRun(n, {"train.mass": 1e3 * n}, measures={"error": float(n**2)}) for n in range(6)]
    infinite = SweepRun(7, {"train.mass": 7e3}, measures={"error": np.inf})
    runs += [SweepRun(6, {"train.mass": 6e3}, failure="it broke"), infinite]
    page = sweep_page(SweepRuns(plant(), ["train.mass"], runs, {"error": "m"}), tmp_path)
    assert page.verdict.mood == "doubt"
    assert page.verdict.text.startswith("7 of 8 runs came to their end. error: 6.500 m in the median, 0 to 25.00 m.")
    assert page.verdict.text.endswith("In 1 error is no finite number.")
    assert page.finding.startswith("error is largest in run 5, 25.00 m: train.mass = 5000")
    assert page.finding.endswith("It rises with train.mass (rank correlation 1.0).")
    (recording,) = page.recordings
    assert (recording.x_name, recording.x_unit) == ("train.mass", "kg")
    np.testing.assert_array_equal(recording.curves[0].values, [0.0, 1.0, 4.0, 9.0, 16.0, 25.0, np.nan, np.inf])
    assert [section.title for section in page.sections] == ["Runs", "What failed"]

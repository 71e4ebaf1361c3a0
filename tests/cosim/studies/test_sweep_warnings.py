"""Warnings of the runs of a sweep: each is shown once, wherever the runs were done; and measures that do not differ."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main
from cosim.report.live.live_page import LivePage, Rows
from cosim.runs.journal import JOURNAL
from cosim.studies.live_sweep import sweep_page
from cosim.studies.seed_runs import seed_study
from cosim.studies.sweep_files import write_index
from cosim.studies.sweep_runs import SweepRun, SweepRuns
from cosim.studies.warnings_of_runs import shared_warnings, warning_lines

LIGHT = "3 of 4 runs (run 0): train.mass = 80 kg is no mass of a train"
"""Of masses that somebody took for tonnes."""


def plant() -> Scenario:
    """A locomotive whose mass is stated in kilograms."""
    scenario = Scenario(stop=0.2, step=0.01)
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0, "effort": 5e4})
    return scenario


PLANT = plant()


@pytest.mark.parametrize("kept", [[], ["--table-only"]])
def test_a_sweep_shows_each_warning_of_its_runs_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kept: Sequence[str]
) -> None:
    out, file = tmp_path / "out", plant().save(tmp_path / "plain.toml")
    command = ["sweep", str(file), "--vary", "train.mass=80,90,100,80e3", "--out", str(out), *kept]
    for again in ([], ["--resume"]):
        assert main([*command, *again]) == 0
        printed = capsys.readouterr()
        assert printed.err.count("no mass of a train") == 1
        assert f"warning: {LIGHT}" in printed.err
        assert "4 of 4 runs done, 1 warning: " in printed.out
        data = json.loads((out / "index.json").read_text())
        assert [warning["runs"] for warning in data["warnings"]] == [[0, 1, 2]]
        assert [len(run["warnings"]) for run in data["runs"]] == [1, 1, 1, 0]
        page = (out / "index.html").read_text()
        assert "4 of 4 runs came to their end. 1 warning." in page
        assert "Warnings (1)" in page


def test_warnings_do_not_depend_on_where_the_runs_are_done(tmp_path: Path) -> None:
    sweep = plant().vary({"train.mass": [80.0, 90.0, 100.0, 80e3]})
    here = sweep.run()
    apart = sweep.run(2, keep=False, folders=False, directory=tmp_path)
    assert here.warnings == apart.warnings
    assert [warning.line().startswith(LIGHT) for warning in here.warnings] == [True]
    assert [run.warnings for run in sweep.each()] == [run.warnings for run in here.runs]
    assert f"warning: {LIGHT}" in repr(here)


def test_runs_of_a_journal_without_warnings_have_none(tmp_path: Path) -> None:
    sweep = plant().vary({"train.mass": [80.0]})
    sweep.run(directory=tmp_path, keep=False)
    journal = tmp_path / JOURNAL
    entry = json.loads(journal.read_text())
    del entry["row"]["warnings"]
    journal.write_text(json.dumps(entry) + "\n")
    assert sweep.run(directory=tmp_path, keep=False, resume=True).warnings == []


def test_seeds_show_their_warnings() -> None:
    study = seed_study(small().set("locomotive.mass", 80.0), [3, 5])
    text = "2 of 2 seeds (seed 3): locomotive.mass = 80 kg is no mass of a train"
    assert any(line.startswith(text) for line in warning_lines(study.warnings, "the page", "seed"))
    assert f"warning: {text}" in study.text()
    assert study.to_data()["warnings"][0]["runs"] == [3, 5]


@given(st.lists(st.lists(st.tuples(st.sampled_from("abcdefgh"), st.floats(0.0, 1e9))), max_size=9))
def test_every_warning_is_counted_once_for_each_run(drawn: list[list[tuple[str, float]]]) -> None:
    """Whatever numbers stand in it; digits in a name part two warnings."""
    each = {run: [f"{name}1.speed is {value:g} m/s." for name, value in texts] for run, texts in enumerate(drawn)}
    found = {warning.text[0]: warning for warning in shared_warnings(each)}
    assert {name: list(warning.runs) for name, warning in found.items()} == {
        name: [run for run, texts in enumerate(drawn) if name in dict(texts)]
        for name in {name for texts in drawn for name, _ in texts}
    }
    lines = warning_lines(list(found.values()), "the page")
    assert len(lines) == min(len(found), 6)
    assert len(found) <= 5 or lines[-1].endswith(": see the page")
    assert len(shared_warnings({0: ["train1 is 5 t", "train2 is 5 t"]})) == 2


def test_the_page_speaks_of_a_measure_that_differs(tmp_path: Path) -> None:
    runs = [SweepRun(n, {"train.mass": 1e3 * n}, measures={"same": 0.1 + 1e-17 * n, "way": 5.0 * n}) for n in (1, 2, 3)]
    result = SweepRuns(plant(), ["train.mass"], runs)
    page = sweep_page(result, tmp_path)
    assert page.finding.startswith("way is largest in run 3, 15.00: train.mass = 3000.")
    assert [(panel.title, panel.is_shown) for panel in page.panels] == [("way", True), ("same", True)]
    assert repr(result).splitlines()[0] == "3 runs; varied: train.mass. way: from 5.00 in run 1 to 15.0 in run 3."


def test_where_no_measure_differs_none_is_called_the_largest(tmp_path: Path) -> None:
    runs = [SweepRun(n, {"train.mass": 1e3 * n}, measures={"same": 0.1}) for n in range(3)]
    page = sweep_page(SweepRuns(plant(), ["train.mass"], runs), tmp_path)
    assert page.finding == "No measure differs between the runs: what is varied changes none of them."


def rows_of(page: LivePage) -> tuple[list[int], list[str]]:
    """Numbers of the runs in the table of a sweep's page, and what is said above it."""
    parts = next(section for section in page.sections if section.title == "Runs").parts
    table = next(part.table for part in parts if isinstance(part, Rows))
    return [row[0] for row in table.rows], [part for part in parts if isinstance(part, str)]


@given(st.lists(st.one_of(st.none(), st.floats(-1e9, 1e9)), max_size=12), st.integers(1, 6))
def test_a_page_keeps_the_worst_of_many_runs(values: list[float | None], most: int) -> None:
    """In their order: what failed comes first, then the largest; what is left out is said, and nothing else."""
    runs = [
        SweepRun(n, {"train.mass": 1e3 * n}, failure="no", measures={})
        if value is None
        else SweepRun(n, {"train.mass": 1e3 * n}, measures={"way": value})
        for n, value in enumerate(values)
    ]
    result = SweepRuns(PLANT, ["train.mass"], runs)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cosim.studies.live_sweep._MOST_ROWS", most)
        shown, said = rows_of(sweep_page(result, Path()))
    assert shown == sorted(shown)
    assert len(shown) == min(most, len(runs))
    rank = [float("inf") if value is None else abs(value) for value in values]
    assert sorted((rank[n] for n in shown), reverse=True) == sorted(rank, reverse=True)[: len(shown)]
    assert [text.partition(" runs")[0] for text in said] == [f"{most} of {len(runs)}"] * (len(runs) > most)


def test_thousands_of_runs_make_no_large_page(tmp_path: Path) -> None:
    """All of them stand in the table; of many failures the first are named."""
    names = [f"observer_{k}.speed_error_rms" for k in range(20)]
    runs = [
        SweepRun(
            n, {"train.mass": 1e3 + n}, failure=None if n % 4 else "it failed", measures=dict.fromkeys(names, 0.1 + n)
        )
        for n in range(3000)
    ]
    paths = write_index(SweepRuns(PLANT, ["train.mass"], runs), tmp_path)
    assert paths["page"].stat().st_size < 1e6
    assert "500 of 3000 runs" in paths["page"].read_text()
    assert "and 650 more, see the column failure of index.csv" in paths["page"].read_text()
    assert len(paths["csv"].read_text().splitlines()) == 3001

"""What a results folder says of how it was made: complete, true to the bit, and exchanged with the results as one."""

from __future__ import annotations

import hashlib
import json
import shutil
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kept_runs import coast, coasting, everything, quietly
from small_scenarios import small

from cosim import Scenario
from cosim.errors import OutputError, ProvenanceError
from cosim.results.results_folder import read_results
from cosim.run.made_from import renewed
from cosim.run.outcome import Outcome
from cosim.run.results_manifest import read_manifest
from cosim.scenario.origin import Origin
from cosim.scenario.schema import parse_scenario


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_folder_holds_scenario_files_and_hashes(tmp_path: Path) -> None:
    fmu, out = coast(tmp_path), tmp_path / "out"
    outcome = quietly(coasting(tmp_path), overrides={"stop": 0.5, "train.x0[1]": 1.5})
    paths = outcome.write(out, report=False)
    scenario = tomllib.loads((out / "made_from" / "scenario.toml").read_text())
    assert scenario["stop"] == 0.5
    assert scenario["components"]["train"] == {"fmu": "files/train/coast.fmu", "parameters": {"x0[1]": 1.5}}
    assert (out / "made_from" / "files" / "train" / "coast.fmu").read_bytes() == fmu.read_bytes()
    manifest = json.loads(paths["made_from"].read_text())
    part = {
        "path": str(fmu),
        "copy": "files/train/coast.fmu",
        "sha256": digest(fmu),
        "size": fmu.stat().st_size,
        "why": None,
    }
    assert manifest["files"] == [{"key": "components.train.fmu", "path": str(fmu), "parts": [part]}]
    assert {name: entry["sha256"] for name, entry in manifest["results"].items()} == {
        name: digest(out / name) for name in ("table.csv", "events.csv")
    }
    assert manifest["components"][0]["guid"] == outcome.result.summary["components"][0]["guid"]
    assert manifest["versions"]["numpy"] == np.__version__
    assert (manifest["asked_by"], manifest["scenario"]["name"], manifest["scenario"]["from"]) == (
        "script",
        "script",
        "script",
    )


def test_all_kinds_of_foreign_files_are_kept_and_the_scenario_runs_from_them(tmp_path: Path) -> None:
    """An FMU used twice, a balise table, a recorded folder and a table within one; then everything else is removed."""
    home = tmp_path / "home"
    home.mkdir()
    coast(home)
    (home / "line.csv").write_text("identity,position,location_accuracy\nB1,1.0,0.0\nB2,3.0,5.0\n")
    quietly(coasting(home)).write(home / "before", report=False)
    scenario = small(certificates="ignore").set("balises.seed", 3)
    scenario.folder = home
    scenario._data["balises"] = {**scenario._data["balises"], "layout": "csv", "file": "line.csv"}
    del scenario._data["balises"]["positions"]
    scenario.add("first", fmu="coast.fmu").add("second", fmu="coast.fmu", parameters={"x0[1]": 2.0})
    scenario.add("folder", recording="before", component="train").add(
        "table", recording="before/table.csv", component="train"
    )
    outcome = quietly(scenario)
    outcome.write(tmp_path / "out", report=False)
    shutil.rmtree(home)
    moved = (tmp_path / "out").rename(tmp_path / "moved")
    kept = sorted(p for p in everything(moved / "made_from") if p.startswith("files"))
    results = ["events.csv", "messages.csv", "summary.json"]
    assert kept == sorted(
        [
            "files/balises/line.csv",
            "files/first/coast.fmu",
            *(f"files/folder/before/{n}" for n in (*results, "table.csv")),
            *(f"files/table/{n}" for n in (*results, "table.csv")),
        ]
    )
    again = quietly(Scenario.load(moved))
    np.testing.assert_array_equal(again.result.table, outcome.result.table)
    assert [e.identity for e in again.result.events] == ["B1", "B2"]
    assert read_manifest(moved).data["seeds"] == {"seed": 0, "balises.seed": 3}


def test_a_scenario_from_a_package_is_kept_with_its_fmus(tmp_path: Path) -> None:
    coast(tmp_path)
    coasting(tmp_path).export_ssp(tmp_path / "system.ssp")
    outcome = quietly(Scenario.load(tmp_path / "system.ssp"))
    outcome.write(tmp_path / "out", report=False)
    (tmp_path / "system.ssp").unlink()
    (tmp_path / "coast.fmu").unlink()
    again = Scenario.load(tmp_path / "out")
    assert again.name == "system"
    np.testing.assert_array_equal(quietly(again).result.table, outcome.result.table)


def test_includes_and_overrides_are_resolved(tmp_path: Path) -> None:
    coast(tmp_path)
    (tmp_path / "base.toml").write_text('stop = 1.0\nstep = 0.1\n[components.train]\nfmu = "coast.fmu"\n')
    (tmp_path / "mine.toml").write_text('include = ["base.toml"]\n[overrides]\nstop = 0.4\n"train.x0[1]" = 7.0\n')
    scenario = Scenario.load(tmp_path / "mine.toml")
    quietly(scenario).write(tmp_path / "out", report=False)
    stored = Scenario.load(tmp_path / "out")
    assert stored.name == "mine"
    table = stored.table()
    assert (table.stop, table.components["train"].parameters) == (0.4, {"x0[1]": 7.0})
    assert read_manifest(tmp_path / "out").data["scenario"]["from"] == str(tmp_path / "mine.toml")


NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
STARTS = st.one_of(NUMBERS, st.booleans(), st.integers(-(2**70), 2**70), st.text(), st.lists(NUMBERS, max_size=4))


@given(st.dictionaries(st.text(min_size=1), STARTS, max_size=5), st.text(), st.lists(NUMBERS, min_size=1, max_size=4))
def test_what_is_written_reads_back_to_an_equal_scenario(
    parameters: dict[str, Any], title: str, places: list[float]
) -> None:
    balises = {"position": "a.s", "speed": "a.v", "layout": "positions", "positions": places}
    data = {
        "title": title,
        "stop": 1.0,
        "step": 0.1,
        "connections": ["a.v -> b.v", {"from": "a.s", "to": "b.s", "values": [(1.0, 2.0)]}],
        "components": {"a": {"model": "locomotive", "as": "block3", "parameters": parameters}},
        "balises": balises,
    }
    table = parse_scenario(data, "law")
    with TemporaryDirectory() as folder:
        with renewed(folder, Origin.of(table, "law", Path(), "law")) as seal:
            seal({}, {})
        assert Scenario.load(folder).table() == table


# -- large, lost and changed files ------------------------------------------------------------------------------------


def test_of_a_large_file_path_and_hash_are_noted(tmp_path: Path) -> None:
    fmu = coast(tmp_path)
    size = fmu.stat().st_size
    outcome = quietly(coasting(tmp_path))
    for limit, kept in ((size, True), (size - 1, False)):
        outcome.write(tmp_path / "out", report=False, files_up_to=limit)
        part = read_manifest(tmp_path / "out").data["files"][0]["parts"][0]
        assert (part["copy"] is not None, part["sha256"]) == (kept, digest(fmu))
        assert (tmp_path / "out" / "made_from" / "files").exists() == kept
    scenario = tomllib.loads((tmp_path / "out" / "made_from" / "scenario.toml").read_text())
    assert scenario["components"]["train"]["fmu"] == str(fmu)


def test_results_are_written_even_when_a_file_they_come_from_is_gone_or_changed(tmp_path: Path) -> None:
    fmu = coast(tmp_path)
    outcome = quietly(coasting(tmp_path))
    fmu.write_bytes(fmu.read_bytes() + b" ")
    outcome.write(tmp_path / "out", report=False)
    part = read_manifest(tmp_path / "out").data["files"][0]["parts"][0]
    assert part["note"] == "it was changed after the run had begun"
    fmu.unlink()
    outcome.write(tmp_path / "out", report=False)
    assert read_manifest(tmp_path / "out").data["files"][0]["parts"][0]["why"] == "No such file or directory"
    np.testing.assert_array_equal(read_results(tmp_path / "out").table, outcome.result.table)


# -- exchange ---------------------------------------------------------------------------------------------------------


def test_a_second_run_into_a_folder_replaces_all_of_it(tmp_path: Path) -> None:
    coast(tmp_path)
    quietly(coasting(tmp_path)).write(tmp_path / "out", report=False)
    quietly(small(certificates="ignore")).write(tmp_path / "out", report=False)
    manifest = read_manifest(tmp_path / "out")
    assert manifest.edited() == manifest.missing() == []
    assert manifest.data["files"] == []
    assert sorted(p.name for p in (tmp_path / "out" / "made_from").iterdir()) == ["manifest.json", "scenario.toml"]
    assert not list((tmp_path / "out").glob(".made_from*"))


def test_results_that_cannot_be_written_leave_the_former_ones_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    coast(tmp_path)
    quietly(coasting(tmp_path)).write(tmp_path / "out", report=False)
    before = everything(tmp_path / "out")
    other = quietly(coasting(tmp_path), overrides={"stop": 0.5})

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cosim.results.results_folder.write_summary", refuse)
    with pytest.raises(OutputError, match="No space left"):
        other.write(tmp_path / "out", report=False)
    assert everything(tmp_path / "out") == before
    assert read_manifest(tmp_path / "out").edited() == []


def test_an_outcome_of_no_scenario_leaves_no_claim_behind(tmp_path: Path) -> None:
    coast(tmp_path)
    outcome = quietly(coasting(tmp_path))
    outcome.write(tmp_path / "out", report=False)
    Outcome(outcome.result, outcome.spec).write(tmp_path / "out", report=False)
    with pytest.raises(ProvenanceError, match="does not say how it was made"):
        read_manifest(tmp_path / "out")


def test_a_folder_of_that_name_that_is_somebody_elses_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "out" / "made_from").mkdir(parents=True)
    (tmp_path / "out" / "made_from" / "diary.txt").write_text("mine")
    coast(tmp_path)
    with pytest.raises(OutputError, match="its made_from is not that of a run"):
        quietly(coasting(tmp_path)).write(tmp_path / "out", report=False)
    assert everything(tmp_path / "out") == {"made_from/diary.txt": b"mine"}


# -- bad folders ------------------------------------------------------------------------------------------------------


def test_folders_that_say_nothing_or_nonsense(tmp_path: Path) -> None:
    with pytest.raises(ProvenanceError, match="does not exist; expected a results folder"):
        read_manifest(tmp_path / "none")
    with pytest.raises(ProvenanceError, match="is no results folder: it has neither"):
        read_manifest(tmp_path)
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(ProvenanceError, match="does not say how it was made"):
        Scenario.load(tmp_path)
    (tmp_path / "made_from").mkdir()
    for content, complaint in (
        ("{", "cannot be read: it is cut off or was edited"),
        ("[]", "cannot be read: it is not a table"),
        ('{"format": 1}', "'scenario' is missing"),
        ('{"format": 2}', "has format 2, this version reads format 1"),
    ):
        (tmp_path / "made_from" / "manifest.json").write_text(content)
        with pytest.raises(ProvenanceError, match=complaint):
            read_manifest(tmp_path)


def test_a_folder_named_like_a_shipped_scenario_does_not_hide_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("freight_profile_d").mkdir()
    assert Scenario.load("freight_profile_d").where.endswith("freight_profile_d.toml")
    with pytest.raises(ProvenanceError, match="is no results folder"):
        Scenario.load("./freight_profile_d")

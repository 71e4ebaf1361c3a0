"""Rerun: the same results from what the folder holds alone, and a plain word where they are not the same."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kept_runs import coast, coasting, everything, quietly

from cosim import Scenario
from cosim.errors import CosimError, OutputError, ProvenanceError
from cosim.provenance import rerun
from cosim.provenance.rerun import _equal_result
from cosim.results.result import BaliseRecord, Result
from cosim.results.results_folder import read_results


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Results of a run whose FMU is gone, in a folder that was moved."""
    fmu = coast(tmp_path)
    quietly(coasting(tmp_path)).write(tmp_path / "made", report=False)
    fmu.unlink()
    return (tmp_path / "made").rename(tmp_path / "kept")


def test_a_run_done_again(kept: Path, tmp_path: Path) -> None:
    before = everything(kept)
    again = rerun(kept, out=tmp_path / "again")
    assert (again.verdict, again.equal, again.changes) == ("bit-identical", True, ())
    assert again.text() == f"Nothing changed since.\n\n{kept}: bit-identical (11 rows, 1 signals, 0 telegrams)."
    np.testing.assert_array_equal(again.outcome.result.table, read_results(kept).table)
    np.testing.assert_array_equal(read_results(tmp_path / "again").table, read_results(kept).table)
    assert everything(kept) == before
    assert rerun(tmp_path / "again").verdict == "bit-identical"  # and so on


def test_another_parameter_differs_and_is_named(kept: Path) -> None:
    """v = x0 exp(-t): 36 against 40 differ most at the start, by 4."""
    again = rerun(kept, overrides={"train.x0[1]": 40.0})
    assert (again.verdict, again.equal) == ("differs", False)
    assert again.changes == ("set: train.x0[1] = 40.0",)
    assert "train.y1: " in again.text()
    assert again.comparison["train.y1"].max_error == pytest.approx(4.0, abs=4e-5)  # 1e-6 s of time at 40 m/s2


def test_a_small_difference_is_within_a_tolerance_that_allows_it(kept: Path) -> None:
    """A share of 1e-5 of 36 is 1.6e-5 of the range 36 (1 - exp(-1)); 1e-6 s of time explain a tenth of it."""
    changed = {"train.x0[1]": 36.0 * (1.0 + 1e-5)}
    assert rerun(kept, overrides=changed).verdict == "within tolerance"  # 1e-4
    assert rerun(kept, overrides=changed, tolerance=1e-7).verdict == "differs"
    assert rerun(kept, overrides=changed, tolerance={"relative": 0.0, "absolute": 1e-3}).verdict == "within tolerance"


def test_what_changed_since_is_reported(kept: Path, tmp_path: Path) -> None:
    manifest = kept / "made_from" / "manifest.json"
    data = json.loads(manifest.read_text())
    data["versions"] |= {"numpy": "1.0"}
    data["components"][0]["guid"] = "{old}"
    data["files"][0]["parts"][0]["note"] = "it was changed after the run had begun"
    manifest.write_text(json.dumps(data))
    fmu = coast(tmp_path, rate=2.0)  # another delivery where the first one was
    again = rerun(kept)
    assert again.verdict == "bit-identical"
    guid = again.outcome.result.summary["components"][0]["guid"]
    assert again.changes == (
        f"numpy: 1.0 then, {np.__version__} now",
        f"train: model {{old}} then, {guid} now",
        f"{fmu}: it was changed after the run had begun",
        f"{fmu} is another file now; its copy in this folder was used.",
    )


@pytest.mark.parametrize(
    "name", ["table.csv", "events.csv", "made_from/scenario.toml", "made_from/files/train/coast.fmu"]
)
def test_an_edited_file_is_named(kept: Path, name: str) -> None:
    content = (kept / name).read_bytes()
    (kept / name).write_bytes(content + b"\n")
    with pytest.raises(
        ProvenanceError, match=rf"{name} was changed since: its SHA-256 is not [0-9a-f]{{12}}.*\n.*--trust"
    ):
        rerun(kept)
    (kept / name).unlink()
    with pytest.raises(ProvenanceError, match=f"{name} is missing"):
        rerun(kept)
    (kept / name).write_bytes(content)
    assert rerun(kept).verdict == "bit-identical"


def test_edited_results_can_be_trusted(kept: Path) -> None:
    table = kept / "table.csv"
    table.write_text(table.read_text().replace("36.0", "37.0"))
    again = rerun(kept, trust=True)
    assert again.verdict == "differs"
    assert again.changes[0].startswith(f"{table} was changed since")


def test_a_large_file_is_sought_where_it_was(tmp_path: Path) -> None:
    fmu, out = coast(tmp_path), tmp_path / "out"
    quietly(coasting(tmp_path)).write(out, report=False, files_up_to=1e3)
    assert rerun(out).verdict == "bit-identical"
    moved = fmu.rename(tmp_path / "elsewhere.fmu")
    with pytest.raises(
        ProvenanceError, match=rf"{fmu} is missing .* not copied \(.* MB are more than 0.001 MB\)"
    ) as gone:
        rerun(out)
    assert str(gone.value).endswith("--set train.fmu=FILE.")
    assert rerun(out, overrides={"train.fmu": moved}).verdict == "bit-identical"
    coast(tmp_path, rate=2.0)
    with pytest.raises(ProvenanceError, match=f"{fmu} was changed since"):
        rerun(out)


def test_a_run_that_failed_fails_again(tmp_path: Path) -> None:
    """v' = 800 v overflows within the run."""
    coast(tmp_path, rate=-800.0)
    quietly(coasting(tmp_path)).write(tmp_path / "out", report=False)
    again = rerun(tmp_path / "out")
    assert again.outcome.failure is not None
    assert again.outcome.failure == again.stored_failure
    assert again.verdict == "bit-identical"


def test_results_are_not_overwritten_by_those_they_are_compared_with(kept: Path) -> None:
    with pytest.raises(OutputError, match="choose another folder"):
        rerun(kept, out=kept / ".." / kept.name)


def test_an_override_without_target_is_refused(kept: Path) -> None:
    with pytest.raises(CosimError, match="no variable 'mas'"):
        rerun(kept, overrides={"train.mas": 1.0})


def test_warnings_that_are_known_are_not_reported_again(tmp_path: Path) -> None:
    coast(tmp_path)
    reported: list[str] = []
    scenario = coasting(tmp_path).master(threads=2)
    scenario.run(warn=reported.append).write(tmp_path / "out", report=False)
    assert len(reported) == 2  # threads without jacobi; an unconnected input
    rerun(tmp_path / "out", overrides={"master.tolerance": 1e-3}, warn=reported.append)
    assert len(reported) == 3
    assert "master.tolerance has no effect" in reported[2]


def test_the_call_log_is_not_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    coast(tmp_path)
    quietly(coasting(tmp_path), call_log=tmp_path / "calls.log").write(tmp_path / "out", report=False)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert rerun(tmp_path / "out").verdict == "bit-identical"
    assert everything(tmp_path / "here") == {}


# -- the same to the last bit -----------------------------------------------------------------------------------------


def result_of(**columns: list[float]) -> Result:
    table = np.zeros(3, [(name, float) for name in columns])
    for name, values in columns.items():
        table[name] = values
    return Result(table, [])


def test_every_bit_counts_but_for_the_kind_of_a_nan() -> None:
    one = result_of(time=[0.0, 1.0, 2.0], x=[0.0, np.nan, 1.0])
    other = result_of(time=[0.0, 1.0, 2.0], x=[0.0, -np.nan, 1.0])
    assert _equal_result(one, one)
    assert _equal_result(one, other)
    assert not _equal_result(one, result_of(time=[0.0, 1.0, 2.0], x=[-0.0, np.nan, 1.0]))
    assert not _equal_result(one, result_of(time=[0.0, 1.0, 2.0], x=[0.0, np.nan, np.nextafter(1.0, 2.0)]))
    assert not _equal_result(one, result_of(time=[0.0, 1.0, 2.0], y=[0.0, np.nan, 1.0]))
    assert not _equal_result(one, replace(one, table=one.table[:2]))


def test_telegrams_count_as_well() -> None:
    record = BaliseRecord(1.0, 1.0, "B1", 5.0, 5.0, outcomes={"a": "accepted"})
    one = replace(result_of(time=[0.0, 1.0, 2.0]), events=[record])
    assert _equal_result(one, replace(one, events=[replace(record)]))  # an odometer reading that is NaN in both
    later, otherwise = replace(record, stamp=np.nextafter(1.0, 2.0)), replace(record, outcomes={"a": "late"})
    for other in ([], [record, record], [later], [otherwise]):
        assert not _equal_result(one, replace(one, events=other))


def test_a_results_folder_is_a_scenario(kept: Path) -> None:
    outcome = quietly(Scenario.load(kept), overrides={"stop": 0.5})
    assert outcome.result.time[-1] == 0.5

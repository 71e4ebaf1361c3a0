"""``cosim export``: from any format to any other, and what is said when that cannot be."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from odd_results import assert_equal, odd_result

from cosim import load_result
from cosim.cli import main
from cosim.results.result import Result, SignalInfo
from cosim.results.results_folder import write_results


def some_result() -> Result:
    result = odd_result(9, ("train.speed", "a[1,2]", "train.force"))
    units = ("m/s", "1", "N")
    return replace(result, signals=[SignalInfo(s.name, u) for s, u in zip(result.signals, units, strict=True)])


def test_chain_through_all_formats_keeps_everything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_results(some_result(), tmp_path / "run", ("npy",))
    chain = ["run", "a.parquet", "b.csv", "c.h5", "d.mat", "e.modelica.mat", "f.hdf5", "g.pq"]
    for source, target in pairwise(chain):
        assert main(["export", str(tmp_path / source), str(tmp_path / target)]) == 0
        assert str(tmp_path / target) in capsys.readouterr().out
    assert_equal(some_result(), load_result(tmp_path / "g.pq"))


def test_chosen_signals_without_units(tmp_path: Path) -> None:
    some_result().save(tmp_path / "a.h5")
    target = tmp_path / "a.csv"
    assert main(["export", str(tmp_path / "a.h5"), str(target), "--signals", "train.*", "--no-units"]) == 0
    assert target.read_text().splitlines()[0] == '"time","train.speed","train.force"'


def test_numpy_says_that_it_drops_the_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    some_result().save(tmp_path / "a.h5")
    assert main(["export", str(tmp_path / "a.h5"), str(tmp_path / "a.npy")]) == 0
    assert "keeps no units" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("source", "target", "more", "message"),
    [
        ("a.h5", "a.xlsx", [], "the format follows from the ending"),
        ("a.h5", "a.h5", [], "is the source itself"),
        ("b.h5", "a.csv", [], "in that folder there is: a.h5"),
        ("a.h5", "none/a.csv", [], "cannot be written: No such file or directory"),
        ("a.h5", "a.csv", ["--signals", "trian.*"], "No signal 'trian.*' in the result"),
    ],
)
def test_mistakes_are_reported_in_a_line(
    source: str, target: str, more: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    some_result().save(tmp_path / "a.h5")
    before = (tmp_path / "a.h5").read_bytes()
    assert main(["export", str(tmp_path / source), str(tmp_path / target), *more]) == 2
    reported = capsys.readouterr().err
    assert reported.startswith("cosim: ")
    assert message in reported
    assert len(reported.splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]
    assert (tmp_path / "a.h5").read_bytes() == before

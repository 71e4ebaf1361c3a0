"""``cosim rerun`` and ``cosim run --stream``: what they print and how they exit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from kept_runs import coast, coasting, quietly

from cosim.cli import main
from cosim.results.results_folder import read_results


@pytest.fixture
def made(tmp_path: Path) -> Path:
    coast(tmp_path)
    coasting(tmp_path).save(tmp_path / "mine.toml")
    return tmp_path


def test_equal_differs_and_error(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = made / "out"
    assert main(["run", str(made / "mine.toml"), "--out", str(out), "--no-report", "--quiet", "--set", "stop=0.5"]) == 0
    manifest = json.loads((out / "made_from" / "manifest.json").read_text())
    assert manifest["asked_by"] == f"cosim run {made / 'mine.toml'} --out {out} --no-report --quiet --set stop=0.5"
    assert (manifest["scenario"]["name"], manifest["scenario"]["from"]) == ("mine", str(made / "mine.toml"))
    capsys.readouterr()
    assert main(["rerun", str(out)]) == 0
    verdict = f"{out}: bit-identical (6 rows, 1 signals, 0 telegrams).\n"
    assert capsys.readouterr().out == f"Nothing changed since.\n\n{verdict}"
    assert main(["rerun", str(out), "--set", "train.x0[1]=36.001"]) == 0  # 2.8e-5 of 36, 7e-5 of the range
    assert "within tolerance" in capsys.readouterr().out
    assert main(["rerun", str(out), "--set", "train.x0[1]=36.001", "--tolerance", "1e-6"]) == 1
    assert "differs" in capsys.readouterr().out
    assert main(["rerun", str(made)]) == 2
    assert "is no results folder" in capsys.readouterr().err
    (out / "table.csv").write_text("")
    assert main(["rerun", str(out)]) == 2
    assert capsys.readouterr().err.startswith(f"cosim: {out / 'table.csv'} was changed since")


def test_json_and_new_results(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    quietly(coasting(made)).write(made / "out", report=False)
    assert main(["rerun", str(made / "out"), "--json", "--out", str(made / "new")]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["verdict"], data["equal"], data["changes"]) == ("bit-identical", True, [])
    assert data["files"]["csv"] == str(made / "new" / "table.csv")
    np.testing.assert_array_equal(read_results(made / "new").table, read_results(made / "out").table)


def test_a_new_run_that_fails_is_an_error(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    quietly(coasting(made)).write(made / "out", report=False)
    (made / "other").mkdir()
    bad = coast(made / "other", rate=-8000.0)  # overflows in the first step
    assert main(["rerun", str(made / "out"), "--set", f"train.fmu={bad}"]) == 2
    said = capsys.readouterr()
    assert "differs" in said.out
    assert "the new run ended early" in said.err


@pytest.mark.parametrize("share", ["-1", "much", "inf", "nan"])
def test_a_tolerance_that_cannot_be(made: Path, share: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["rerun", str(made), "--tolerance", share])
    assert stopped.value.code == 2


def test_a_streamed_run_from_the_command_line(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = made / "out"
    assert main(["run", str(made / "mine.toml"), "--out", str(out), "--no-report", "--quiet", "--stream"]) == 0
    assert sorted(p.name for p in out.iterdir()) == [
        "events.csv",
        "made_from",
        "messages.csv",
        "summary.json",
        "table.npy",
    ]
    np.testing.assert_allclose(
        np.load(out / "table.npy")["train.y1"], 36.0 * np.exp(-np.linspace(0.0, 1.0, 11)), rtol=1e-13
    )
    assert main(["rerun", str(out)]) == 0
    assert "bit-identical" in capsys.readouterr().out

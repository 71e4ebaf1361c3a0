"""``cosim new``: what it writes, what it says, how it exits."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_fmus.build import linear_fmu

from cosim.cli import main
from cosim.results.results_folder import read_results


@pytest.mark.compiler
def test_what_is_written_runs_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    A, B, C, D = [[0, 1], [0, 0]], [[0], [1 / 90e3]], [[1, 0], [0, 1]], [[0], [0]]
    linear_fmu(tmp_path, "point", A, B, C, D, inputs=["force"], outputs=["position", "speed"], units={"force": "N"})
    monkeypatch.chdir(tmp_path)
    assert main(["new", "point.fmu"]) == 0
    said = capsys.readouterr().out
    assert "position: position, m (d(position)/dt = 1 speed)" in said
    assert "wheel speed: not found" in said
    assert "written: point.toml" in said
    assert main(["show", "point.toml"]) == 0
    assert main(["run", "point.toml", "--set", "stop=20.0", "--out", "out", "--no-report", "--quiet"]) == 0
    assert len(read_results("out").events) >= 1
    assert main(["new", "point.fmu"]) == 2
    assert (
        "point.toml exists already; choose another name with -o, or replace it with --force" in capsys.readouterr().err
    )
    assert main(["new", "point.fmu", "--force", "--no-probe", "--observer", "discrete_uio"]) == 0
    assert 'observer = "discrete_uio"' in Path("point.toml").read_text()
    assert main(["new", "point.fmu", "-o", "Zug & Öl.toml"]) == 0
    assert "then: cosim run 'Zug & Öl.toml'" in capsys.readouterr().out
    assert "#   cosim show 'Zug & Öl.toml' " in Path("Zug & Öl.toml").read_text()


def test_a_mistake_ends_in_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.fmu").write_text("no archive")
    assert main(["new", str(tmp_path / "a.fmu"), "-o", str(tmp_path / "a.toml")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"cosim: {tmp_path / 'a.fmu'} is not a readable FMU")
    assert "Traceback" not in said
    assert not (tmp_path / "a.toml").exists()

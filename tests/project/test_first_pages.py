"""What a reader meets first comes out: the table that the first run prints, and the script for an FMU of one's own."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from pages import ROOT, blocks, generator

import fmus.cli
from cosim.studies.measures import error_measures

FIRST_RUN = ROOT / "docs" / "guide" / "first_run.md"
OWN_TRAIN = ROOT / "docs" / "guide" / "own_train.md"


def test_the_printed_table_is_what_the_run_prints() -> None:
    generate = generator()
    stated = generate.part(FIRST_RUN.read_text(encoding="utf-8"), "printed table").splitlines()
    actual = generate.printed_table().splitlines()
    assert len(stated) == len(actual)
    for ours, theirs in zip(stated, actual, strict=True):
        ours_cells, theirs_cells = re.split(r"  +", ours.strip()), re.split(r"  +", theirs.strip())
        assert len(ours_cells) == len(theirs_cells)
        for a, b in zip(ours_cells, theirs_cells, strict=True):
            # 10 %: sliding modes chatter, and another processor or library may round differently
            assert float(a) == pytest.approx(float(b), rel=0.1) if _is_number(b) else a.strip("-") == b.strip("-")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@pytest.mark.compiler
def test_the_script_makes_sense_from_the_first_balise_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the FMU that one command builds: no warning, errors that slip explains, roles without a report table."""
    monkeypatch.chdir(tmp_path)
    assert fmus.cli.main(["build", "locomotive", "--fmi", "2", "-o", "vendor.fmu"]) == 0
    code = next(b.code for b in blocks(OWN_TRAIN) if b.language == "python" and "vendor.fmu" in b.code)
    exec(compile(code.partition("print(")[0], str(OWN_TRAIN), "exec"), names := {})
    outcome = names["outcome"]
    assert outcome.warnings == []
    measures = error_measures(outcome)
    slip = np.abs(outcome["train.wheel_speed"] - outcome["train.speed"]).max()
    assert 0.0 < measures["observer.speed_error_max"] < 1.2 * slip < 0.5
    assert measures["observer.position_error_max"] < 5.0
    assert len(outcome.result.events) >= 5
    assert outcome.spec.odometer == "odometer.reading"

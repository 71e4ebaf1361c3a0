"""Updating: what is within tolerance stays as it stands, what is not is replaced, and a baseline always passes its own
run.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_baseline_files import component, hand_made

from cosim.baselines import check, read_baseline
from cosim.baselines.baseline_files import write_texts
from cosim.baselines.update import plan_update
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.results.result import Result


def shifted(offset: float, **summary: object) -> Result:
    result = hand_made(**summary)
    result.table["train.speed"] += offset
    return result


def updated(result: Result, path: Path, tolerances: Tolerances | None = None) -> str:
    update = plan_update(result, path, tolerances)
    assert update.after.equal
    if update.texts:
        write_texts(dict(update.texts), path)
    return update.change


def test_last_digits_of_another_machine_change_no_file(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    assert updated(hand_made(), path) == "new"
    assert updated(shifted(5e-5), path) == "unchanged"  # allowed: 1e-4 of the range, which is 0.84 m/s
    assert updated(shifted(5e-3), path) == "changed"
    assert check(shifted(5e-3), read_baseline(path)).equal


def test_within_tolerance_the_baseline_does_not_creep(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    updated(hand_made(), path)
    # each is within tolerance of the one before
    changes = [updated(shifted(2e-5 * step), path) for step in range(1, 7)]
    assert changes[:4] == ["unchanged"] * 4  # up to 8e-5 m/s
    assert "changed" in changes[4:]  # 1e-4 and 1.2e-4 m/s are not


def test_a_new_delivery_with_equal_outputs_changes_the_header_only(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    updated(hand_made(components=[component()]), path)
    rows = path.with_suffix(".csv").read_bytes()
    assert updated(shifted(1e-5, components=[component(guid="{2}")]), path) == "changed"
    assert path.with_suffix(".csv").read_bytes() == rows
    assert json.loads(path.read_text(encoding="utf-8"))["components"][0]["guid"] == "{2}"
    assert not read_baseline(path).notes


def test_tolerances_stay_unless_new_ones_are_stated(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    wide = Tolerances(Tolerance(), {"train.speed": Tolerance(absolute=0.1)})
    updated(hand_made(), path, wide)
    assert updated(shifted(0.05), path) == "unchanged"
    assert read_baseline(path).tolerances == wide
    assert updated(shifted(0.05), path, Tolerances()) == "changed"
    assert read_baseline(path).tolerances == Tolerances()


@pytest.mark.parametrize("damage", ["", "{", "<<<<<<< HEAD\n"])
def test_an_unreadable_baseline_is_replaced_and_it_is_said(damage: str, tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    updated(hand_made(), path)
    path.write_text(damage, encoding="utf-8")
    update = plan_update(hand_made(), path)
    assert update.change == "changed"
    assert "could not be read" in update.notes[0]


def test_other_versions_alone_change_no_file(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    updated(hand_made(versions={"fmu-observer": "0.1.0"}), path)
    before = path.read_bytes()
    assert updated(hand_made(versions={"fmu-observer": "0.2.0"}), path) == "unchanged"
    assert path.read_bytes() == before


@pytest.mark.parametrize("every", [None, 0.7, 100.0])
@pytest.mark.parametrize("shape", ["spike", "steps", "noise"])
def test_a_run_passes_against_its_own_baseline_however_thin(shape: str, every: float | None, tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    run = hand_made(10_001)
    time = run.time
    noise = np.random.default_rng(1).normal(size=len(time))
    run.table["train.speed"] = {
        "spike": np.abs(time - 500.0) < 0.25,
        "steps": np.sign(np.sin(0.7 * time)),
        "noise": noise,
    }[shape]
    update = plan_update(run, path, every=every)
    write_texts(dict(update.texts), path)
    assert check(run, read_baseline(path)).equal
    assert len(read_baseline(path).result.table) < 2100

"""The line Amsterdam - Utrecht: its balise groups, and the scenario over them."""

from __future__ import annotations

import csv
import importlib.util
import re
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from cosim import Outcome
from cosim.balises.layout import TrackLayout, from_csv
from cosim.evaluation.balise_gaps import PLAIN_ODOMETER, GapErrors
from cosim.scenario.shipped import SHIPPED

FILE = "amsterdam_utrecht_balise_groups.csv"
ROOT = Path(__file__).parents[3]
REPORTED, UNTOLD = (
    ("quasi_lpv_uio", "discrete_measurement_observer"),
    ("odometer_reset", "continuous_discrete_observer"),
)


def layout() -> TrackLayout:
    return from_csv(str(SHIPPED / FILE))


def rows() -> list[dict[str, str]]:
    lines = (SHIPPED / FILE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_groups_lie_as_the_train_received_them() -> None:
    """Numbers counted from the source by somebody else."""
    linked = [float(row["position_linked"]) for row in rows() if row["position_linked"]]
    assert len(layout().balises) == 98
    assert len(linked) == 96
    assert layout().positions[2:].tolist() == linked
    gaps = np.diff(linked)
    assert (gaps.min(), gaps.max()) == (50.0, 874.0)
    assert np.percentile(gaps, [25, 50, 75]).tolist() == [66.0, 229.0, 493.0]
    assert round(float(np.percentile(gaps, 95))) == 788
    assert round(float(gaps.mean())) == 313
    assert linked[-1] - linked[0] == pytest.approx(29.7e3, abs=50.0)
    # half of the way lies in gaps of 501 m or more
    longest_first = np.sort(gaps)[::-1]
    assert longest_first[np.searchsorted(np.cumsum(longest_first), gaps.sum() / 2)] == 501.0


def test_positions_follow_from_the_columns_of_the_source() -> None:
    """Linked where linked; before that the plan, moved to agree at the first linked group of its section."""
    first = next(row for row in rows() if row["position_linked"])
    moved = float(first["position_linked"]) - float(first["position_plan"])
    for row, balise in zip(rows(), layout().balises, strict=True):
        plan = float(row["position_plan"]) + (moved if row["section"] == first["section"] else 0.0)
        assert balise.position == (float(row["position_linked"]) if row["position_linked"] else plan)
        assert balise.identity == f"{row['nid_c']}-{row['nid_bg']}"


def test_source_and_licence_are_in_the_file() -> None:
    head = (SHIPPED / FILE).read_text(encoding="utf-8")[:1200]
    assert "openETCS/modeling" in head
    assert "EUPL" in head


# -- the scenario


@cache
def study() -> ModuleType:
    path = ROOT / "docs" / "studies" / "amsterdam_utrecht.py"
    spec = importlib.util.spec_from_file_location("amsterdam_utrecht_study", path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def shipped(*, faults: bool = True, turned: bool = False) -> tuple[Outcome, GapErrors]:
    chosen = study().scenario(everybody=False, faults=faults)
    outcome, found = study().run(study().turned(chosen) if turned else chosen)
    return outcome, found


@pytest.mark.compiler
@pytest.mark.slow
def test_the_train_passes_every_linked_group_and_stops() -> None:
    outcome, found = shipped()
    assert [event.true_position for event in outcome.result.events] == layout().positions[2:].tolist()
    assert len(found.gaps) == 95
    assert 3.6 * outcome["train.speed"].max() == pytest.approx(140.0, abs=1.0)
    assert outcome["train.speed"][-1] == 0.0
    longest = found.gaps[found.longest(1)[0]]
    assert (round(longest.length), round(longest.seconds, 1)) == (874, 22.5)
    outcome.check()
    assert outcome.result.summary["master"]["stepper"]["steps_compiled"] > 17_000


@pytest.mark.compiler
@pytest.mark.slow
def test_who_is_certified_for_the_longest_gap() -> None:
    certificates = shipped()[0].result.summary["certificates"]
    assert [name for name, entry in certificates.items() if not entry["holds"]] == ["adaptive_gain_cdo"]
    assert any("adaptive_gain_cdo" in text and "NOT CERTIFIED" in text for text in shipped()[0].warnings)


@pytest.mark.compiler
@pytest.mark.slow
def test_jams_cost_their_length_those_who_are_not_notified() -> None:
    """Within the gap of 811 m three jams: 0.8 s, 1.2 s and 0.6 of 0.4 s, at speeds that fall by 0.5 m/s2."""
    outcome, found = shipped()
    quiet = shipped(faults=False)[1]
    i = next(i for i, gap in enumerate(found.gaps) if gap.origin == "426-418")
    time, wheel = outcome["time"], outcome["train.wheel_speed"]
    lost = sum(
        depth * (np.interp(onset + length, time, _way(time, wheel)) - np.interp(onset, time, _way(time, wheel)))
        for onset, length, depth in ((540.0, 0.8, 1.0), (546.0, 1.2, 1.0), (553.0, 0.4, 0.6))
    )
    # the driver acts every 50 ms, in which a speed changes by 0.025 m/s; readings are whole pulses of 0.03 m
    for name in (PLAIN_ODOMETER, "odometer_reset"):
        assert quiet.errors[name][i] - found.errors[name][i] == pytest.approx(lost, abs=0.2)
    for name in REPORTED:
        assert abs(found.errors[name][i] - quiet.errors[name][i]) < 0.05 * lost


@pytest.mark.compiler
@pytest.mark.slow
def test_faults_of_the_other_sign_are_those_faults() -> None:
    """What the wheel loses in a jam it wins in a skid of that depth: the plain odometer, by hand as above."""
    outcome, found = shipped(turned=True)
    stated, quiet = shipped()[1], shipped(faults=False)[1]
    lost, won = (np.array(e.errors[PLAIN_ODOMETER]) - quiet.errors[PLAIN_ODOMETER] for e in (stated, found))
    np.testing.assert_allclose(won, -lost, atol=0.4)  # twice the pulse of 0.03 m, and a reading of 0.2 s
    assert np.abs(lost).max() > 70.0
    reported = {entry["observer"]: entry for entry in outcome.result.summary["fault_detection"]}
    assert reported["quasi_lpv_uio"]["detected"] >= 15
    for name, limit in zip(REPORTED, (27.0, 24.3), strict=True):  # jams of a driven wheel are followed after 1.2 s
        assert np.abs(found.errors[name]).max() < limit
    assert (
        outcome["discrete_measurement_observer.error_bound"]
        - np.abs(outcome["discrete_measurement_observer.speed"] - outcome["train.speed"])
    ).min() > 0.0


@pytest.mark.compiler
@pytest.mark.slow
def test_the_tables_of_the_page_are_those_of_the_study() -> None:
    page = (ROOT / "docs" / "theses" / "amsterdam_utrecht.md").read_text(encoding="utf-8")
    outcome, found = shipped()
    for line in study().longest_gaps(found).splitlines()[2:]:
        label = line.split("|")[1].strip()
        printed = next(row for row in page.splitlines() if row.startswith(f"| {label} |"))
        now, then = (np.array([float(n) for n in re.findall(r"-?\d+\.?\d*", text)[-20:]]) for text in (line, printed))
        np.testing.assert_allclose(now, then, rtol=0.05, atol=0.02)  # two digits; other compilers round elsewhere
    for line in study().all_gaps(found, shipped(faults=False)[1], shipped(turned=True)[1]).splitlines()[2:]:
        label, *cells = (cell.strip() for cell in line.split("|")[1:-1])
        assert re.search(rf"^\| {re.escape(label)} \| {re.escape(cells[0])} \|", page, re.MULTILINE), line
    assert study().certified(outcome)["adaptive_gain_cdo"] == "no"


@pytest.mark.compiler
@pytest.mark.slow
def test_the_train_does_not_know_of_the_communication_step() -> None:
    """With driver and wheel at 50 ms; who reads the odometer at instants of its own hears the same."""
    kept = {"driver__every": 5, "wheel__every": 5, "tachometer__every": 5}
    _, fine = study().run(study().scenario(everybody=False, step=0.01, **kept))
    _, usual = shipped()
    for name in (*REPORTED, "adaptive_gain_cdo", "multirate_cdo", "discrete_uio"):
        np.testing.assert_allclose(fine.errors[name], usual.errors[name], atol=1e-9)  # of 33 km, in doubles


def _way(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    return np.concatenate(([0.0], np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2.0)))

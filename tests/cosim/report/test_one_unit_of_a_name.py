"""One name, one unit: wherever people read a signal it is named in the same unit, and wherever a number stands beside a
unit it is the same quantity.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cosim.evaluation.spec import ReportSpec
from cosim.expectations import evaluate
from cosim.report.figures.panel import Panel
from cosim.report.figures.run_figures import AdhesionPanel, SlipPanel, SpeedPanel
from cosim.report.page.run_curves import run_recording
from cosim.report.page.run_sections import signals_table
from cosim.results.formats.headings import split_unit
from cosim.results.load_result import load_result
from cosim.results.result import Result, SignalInfo
from cosim.results.shown_unit import ShownUnit
from cosim.results.table_layout import table_of
from cosim.run.outcome import Outcome
from cosim.scenario.schema import parse_scenario
from plant_models.hybrid.units import parse_unit

NAMES = {"speed": ("m/s", 30.0), "slip": ("1", 0.125), "adhesion_force": ("N", 40e3)}
WANTED = [
    {"speed": "km/h", "slip": "%", "adhesion_force": "kN"},
    {"speed": "mph", "slip": None, "adhesion_force": None},
]
Read = tuple[str, float | None]
"""A unit, and the last value in it where the door shows one."""


def a_run(wanted: dict[str, str | None]) -> Result:
    """A train that holds its speed, slip and force from the first row on; a vendor's FMU counts in what it shows."""
    time = np.linspace(0.0, 1.0, 5)
    signals = [SignalInfo(f"train.{n}", unit, wanted[n], declared_unit=wanted[n]) for n, (unit, _) in NAMES.items()]
    return Result(
        table_of(["time", *(s.name for s in signals)], [time, *(0 * time + v for _, v in NAMES.values())]), signals
    )


def on_the_page(result: Result, name: str) -> Read:
    row = next(row for row in signals_table(result).rows if row[0] == name)
    return row[1], float(row[5])


def in_the_terminal(result: Result, name: str) -> Read:
    row = next(row for row in result.signals_table().rows if row[0] == name)
    return row[1], float(row[3])


def on_the_live_page(result: Result, name: str) -> Read:
    curve = next(c for c in run_recording(result, ReportSpec()).curves if c.name == name)
    unit = curve.shown or ShownUnit(curve.unit, kept=curve.unit)
    return unit.name, unit.value(float(curve.values[-1]))


def in_a_picture(result: Result, name: str) -> Read:
    role = name.partition(".")[2]
    panels: dict[str, type[Panel]] = {"speed": SpeedPanel, "slip": SlipPanel, "adhesion_force": AdhesionPanel}
    ax = panels[role].draw(result, ReportSpec(**{f"true_{role}": name}), None)
    true = next(line for line in ax.get_lines() if line.get_label() == "true")
    return re.sub(r".*\[(.*)\]", r"\1", ax.get_ylabel()), float(np.asarray(true.get_ydata())[-1])


def in_an_expectation(result: Result, name: str) -> Read:
    item = {"check": "signal", "signal": name, "max": 0.0}
    table = parse_scenario(
        {"stop": 1.0, "step": 0.25, "components": {"train": {"model": "locomotive"}}, "expect": [item]}, "test"
    )
    (found,) = evaluate(table, Outcome(result, ReportSpec()))
    value, _, unit = found.text.partition(" (at")[0].partition(" ")
    return unit or "1", float(value)


@pytest.mark.parametrize("wanted", WANTED, ids=["as wanted", "one of them"])
@pytest.mark.parametrize("name", [f"train.{name}" for name in NAMES])
@pytest.mark.parametrize("door", [on_the_page, in_the_terminal, on_the_live_page, in_a_picture, in_an_expectation])
def test_people_read_one_unit(door: Callable[[Result, str], Read], name: str, wanted: dict[str, str | None]) -> None:
    result, (kept, value) = a_run(wanted), NAMES[name.partition(".")[2]]
    unit, shown = door(result, name)
    assert unit == wanted[name.partition(".")[2]] or unit == kept == result.info(name).shown.name
    meant = parse_unit(unit)
    assert shown is None or meant.factor * shown + meant.offset == pytest.approx(value, rel=1e-3)  # 4 digits of a text


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".h5", ".mat", ".npy"])
@pytest.mark.parametrize("name", [f"train.{name}" for name in NAMES])
def test_a_file_holds_the_quantity_and_gives_it_back(ending: str, name: str, tmp_path: Path) -> None:
    result, path = a_run(WANTED[0]), tmp_path / f"run{ending}"
    if ending in (".parquet", ".h5"):
        pytest.importorskip({".parquet": "pyarrow", ".h5": "h5py"}[ending])
    result.save(path)
    assert load_result(path)[name].tobytes() == result[name].tobytes()
    if ending == ".csv":
        with path.open(encoding="utf-8") as file:
            headings, *rows = csv.reader(file)
        read = dict(zip(map(split_unit, headings), rows[-1], strict=True))
        ((_, unit), text) = next(item for item in read.items() if item[0][0] == name)
        meant = parse_unit(unit or "1")
        assert unit == WANTED[0][name.partition(".")[2]]
        assert meant.factor * float(text) + meant.offset == result[name][-1]

"""Numbers are kept in SI and shown in the units that FMUs want: on pages, in tables, pictures and files of arrays."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.model_description import BaseUnit, DisplayUnit, ModelDescription, ScalarVariable, SimpleType
from fmpy.model_description import Unit as DeclaredUnit
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.build import linear_fmu

import cosim
from cosim.comparison.compare import compare
from cosim.report.live.live_page import PageCurve, PagePanel, PageRecording
from cosim.report.live.still_panels import still_panels
from cosim.report.page.run_sections import signals_table
from cosim.results.load_result import load_result
from cosim.results.result import Result, SignalInfo
from cosim.results.shown_unit import ShownUnit, own_scale, shared_unit
from cosim.results.table_layout import table_of
from fmus.fmi.units import Units
from plant_models.hybrid.units import conversion, parse_unit

PAIRS = (("m/s", "km/h"), ("m", "km"), ("N", "kN"), ("K", "degC"), ("Pa", "bar"), ("rad", "deg"), ("1", "%"))


@given(pair=st.sampled_from(PAIRS), values=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=9))
def test_what_is_shown_is_the_same_quantity(pair: tuple[str, str], values: list[float]) -> None:
    kept, name = pair
    unit = SignalInfo("a", kept, name).shown
    factor, offset = conversion(parse_unit(kept), parse_unit(name))  # the other way round, by the exponents
    expected = factor * np.array(values) + offset
    assert unit.name == name
    np.testing.assert_allclose(unit.values(np.array(values)), expected, rtol=1e-14, atol=1e-9)  # of 273.15 at most
    assert unit.difference(values[0]) == pytest.approx(factor * values[0], rel=1e-14)


def test_a_unit_that_cannot_be_meant_is_not_shown() -> None:
    for display in ("kN", "furlong", "", None):
        assert SignalInfo("a", "m/s", display).shown == ShownUnit("m/s", kept="m/s")
    assert SignalInfo("a", "m/s", "kN", declared_unit="km/h").shown.name == "km/h"
    for factor in (0.0, -1.0, float("nan")):
        assert ShownUnit.first_of("m", ["x"], (factor, 0.0)).name == "m"


def test_an_axis_has_the_unit_of_all_or_that_in_which_they_are_kept() -> None:
    fast, slow = SignalInfo("a", "m/s", "km/h").shown, SignalInfo("b", "m/s", "mph").shown
    assert shared_unit([fast, fast]) == fast
    assert shared_unit([fast, slow]).name == shared_unit([fast, SignalInfo("c", "m/s").shown]).name == "m/s"


def _variable(unit: str, display: str | None, *, by_type: bool = False, relative: bool = False) -> ScalarVariable:
    declared = SimpleType(name="T", type="Real", unit=unit, displayUnit=display, relativeQuantity=relative)
    if by_type:
        return ScalarVariable(name="v", valueReference=1, declaredType=declared)
    return ScalarVariable(name="v", valueReference=1, unit=unit, displayUnit=display, relativeQuantity=relative)


def _units(name: str, factor: float, *displays: DisplayUnit) -> Units:
    base = BaseUnit(m=1, s=-1, factor=factor) if "m" in name else BaseUnit(K=1, factor=factor)
    declared = DeclaredUnit(name=name, baseUnit=base, displayUnits=list(displays))
    return Units(ModelDescription(unitDefinitions=[declared]))


@pytest.mark.parametrize("by_type", [False, True])
@given(own=st.floats(1e-3, 1e3), factor=st.floats(1e-3, 1e3), offset=st.floats(-1e3, 1e3), value=st.floats(-1e3, 1e3))
def test_a_display_unit_means_what_its_fmu_defines(
    by_type: bool, own: float, factor: float, offset: float, value: float
) -> None:
    units = _units("mine/s", own, DisplayUnit(name="theirs", factor=factor, offset=offset))
    found = units.displayed(_variable("mine/s", "theirs", by_type=by_type))
    assert found is not None
    assert found.unit is not None
    shown = ShownUnit("theirs", found.unit.factor, found.unit.offset, "m/s")
    expected = factor * value + offset  # FMI 2.0, 2.2.2: of the value in the unit
    assert shown.value(own * value) == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1e3 + abs(offset)))
    assert own_scale(found.name, found.unit) == (found.unit.factor, found.unit.offset)


def test_what_everybody_understands_is_meant_so_and_a_difference_has_no_offset() -> None:
    units = _units("m/s", 1.0, DisplayUnit(name="km/h"))  # its factor was forgotten
    found = units.displayed(_variable("m/s", "km/h"))
    assert found is not None
    assert found.unit == parse_unit("km/h")
    warm = _units("K", 1.0)
    for relative, offset in ((False, 273.15), (True, 0.0)):
        found = warm.displayed(_variable("K", "degC", relative=relative))
        assert found is not None
        assert found.unit is not None
        assert found.unit.offset == offset
    assert units.displayed(_variable("m/s", "kN")) is None
    assert units.displayed(_variable("m/s", "furlong/s")) is None
    assert units.displayed(ScalarVariable(name="v", valueReference=1, displayUnit="km/h")) is None


def _rewritten(fmu: Path, *changes: tuple[str, str]) -> Path:
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    text = files["modelDescription.xml"].decode()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with zipfile.ZipFile(fmu, "w") as archive:
        for name, content in (files | {"modelDescription.xml": text.encode()}).items():
            archive.writestr(name, content)
    return fmu


_RITZ = '<DisplayUnit name="Ritz" factor="2.0"/></Unit>'


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("changes", "name", "last"),
    [
        ([], "km/h", 36.0),  # the unit in which it counts
        ([('unit="km/h"', 'unit="km/h" displayUnit="mph"')], "mph", 10.0 / 0.44704),
        ([('name="km/h"', 'name="Tacho"'), ('unit="km/h"', 'unit="Tacho"')], "Tacho", 36.0),
        ([("</Unit>", _RITZ), ('unit="km/h"', 'unit="km/h" displayUnit="Ritz"')], "Ritz", 72.0),
    ],
)
def test_a_run_shows_what_its_fmu_wants(changes: list[tuple[str, str]], name: str, last: float, tmp_path: Path) -> None:
    fmu = linear_fmu(
        tmp_path, "train", [[0]], [[1]], [[3.6]], [[0]], version=2, inputs=["a"], outputs=["v"], units={"v": "km/h"}
    )
    scenario = cosim.Scenario(stop=10.0, step=1.0).add("fmu", fmu=_rewritten(fmu, *changes), parameters={"a": 1.0})
    outcome = scenario.run()
    assert outcome["fmu.v"][-1] == pytest.approx(10.0, rel=1e-12)
    row = next(row for row in signals_table(outcome.result).rows if row[0] == "fmu.v")
    assert (row[1], row[5]) == (name, pytest.approx(last, rel=1e-12))
    assert f"{last:.3g}" in str(outcome.result)
    outcome.write(tmp_path / "out", report=False)
    assert load_result(tmp_path / "out").info("fmu.v").shown == outcome.result.info("fmu.v").shown


@pytest.mark.compiler
def test_a_reciprocal_is_no_unit_to_show(tmp_path: Path) -> None:
    """FMI 3.0: ``inverse`` shows ``factor / value``, as litres per 100 km are shown of km per litre."""
    fmu = linear_fmu(tmp_path, "train", [[0]], [[1]], [[1]], [[0]], inputs=["a"], outputs=["v"], units={"v": "m/s"})
    definition = '<DisplayUnit name="Ritz" factor="2.0" inverse="true"/><DisplayUnit name="Tacho" factor="3.0"/></Unit>'
    for display, shown in (("Ritz", "m/s"), ("Tacho", "Tacho")):
        copy = _rewritten(
            Path(shutil.copy(fmu, tmp_path / f"{display}.fmu")),
            ("</Unit>", definition),
            ('unit="m/s"', f'unit="m/s" displayUnit="{display}"'),
        )
        outcome = cosim.Scenario(stop=1.0, step=0.5).add("fmu", fmu=copy, parameters={"a": 1.0}).run()
        assert outcome.result.info("fmu.v").shown.name == shown


def _result() -> Result:
    """Two speeds, of which one counts in km/h; a temperature that is only shown in another unit; what only an FMU
    knows.
    """
    time, rng = np.arange(40.0), np.random.default_rng(3)
    factor = parse_unit("km/h").factor
    signals = [
        SignalInfo("plant.vIst", "m/s", "km/h", declared_unit="km/h", description="speed"),
        SignalInfo("observer.speed", "m/s", can_be_missing=True),
        SignalInfo("plant.T", "K", "degC", "discrete"),
        SignalInfo("plant.odd", "m/s", "Tacho", display_scale=(0.1, 2.0 / 3.0)),
    ]
    speed = factor * rng.uniform(0.0, 80.0, 40) + 0.0
    columns = [time, speed, speed + 1e-3, 293.15 + time, speed]
    return Result(table_of(["time", *(s.name for s in signals)], columns), signals)


@pytest.mark.parametrize("ending", [".parquet", ".h5", ".mat"])
def test_files_of_arrays_hold_declared_units_and_are_read_to_the_last_bit(ending: str, tmp_path: Path) -> None:
    before, path = _result(), tmp_path / f"run{ending}"
    before.save(path)
    held, unit = _as_others_read(path)
    np.testing.assert_allclose(held, 3.6 * before["plant.vIst"], rtol=1e-15)
    assert unit == "km/h"
    back = load_result(path)
    assert back.table.tobytes() == before.table.tobytes()
    assert list(back.signals) == list(before.signals)


def _as_others_read(path: Path) -> tuple[np.ndarray, str]:
    """The first signal and its unit, as the package that others have reads the file."""
    if path.suffix == ".parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
        table = parquet.read_table(path)
        return table["plant.vIst"].to_numpy(), table.schema.field("plant.vIst").metadata[b"unit"].decode()
    if path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path) as file:
            return file["plant.vIst"][:], str(file["plant.vIst"].attrs["units"])
    content: dict[str, Any] = pytest.importorskip("scipy.io").loadmat(path, simplify_cells=True)
    return content["plant_vIst"], content["units"]["plant_vIst"]


def test_a_comparison_is_made_in_si_and_shown_in_the_units_of_its_signals() -> None:
    reference = _result()
    table = reference.table.copy()
    table["plant.vIst"] += 1.0
    table["plant.T"] += 5.0
    found = compare(reference, Result(table, reference.signals))
    speed, warm = found["plant.vIst"], found["plant.T"]
    assert (speed.unit, speed.max_error) == ("m/s", pytest.approx(1.0))
    shown = speed.as_shown()
    assert shown.as_shown() is shown
    assert (shown.unit, shown.max_error) == ("km/h", pytest.approx(3.6))
    assert shown.rms_error == pytest.approx(3.6 * speed.rms_error)
    assert shown.share_of_range == pytest.approx(speed.share_of_range)
    assert shown.curves is not None
    np.testing.assert_allclose(shown.curves.reference, 3.6 * reference["plant.vIst"], rtol=1e-14)
    np.testing.assert_allclose(warm.as_shown().worst[0][1:], [20.0, 25.0, 5.0])
    text = str(found)
    assert "3.6 km/h too high" in text
    assert "5 degC too high" in text
    assert "m/s" not in text


def test_a_picture_of_two_units_is_in_si_and_one_of_a_single_unit_in_that() -> None:
    result = _result()
    curves = [PageCurve(s.name, result[s.name], s.unit, shown=s.shown) for s in result.signals]
    recording = PageRecording("run", result.time, curves)
    assert "Speed [km/h]" in still_panels([recording], [PagePanel("Speed", ["plant.vIst"])])
    assert "Speed [m/s]" in still_panels([recording], [PagePanel("Speed", ["plant.vIst", "observer.speed"])])

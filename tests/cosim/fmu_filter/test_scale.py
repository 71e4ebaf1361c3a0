"""The unit in which an FMU has a variable changes nothing that a filter over it finds."""

from __future__ import annotations

from pathlib import Path

import lying_fmus
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.scale import Scale
from cosim.fmu_filter.settings import FilterTable
from plant_models.hybrid.units import parse_unit

UNITS: dict[str, tuple[str, str, float, float]] = {
    "K": ('K="1"', "K", 1.0, 0.0),
    "degC": ('K="1" offset="273.15"', "degC", 1.0, 0.0),
    "furlong/fortnight": ('m="1" s="-1" factor="1.663e-4"', "m/s", 1.663e-4, 0.0),
    "backwards": ('m="1" s="-1" factor="-0.5" offset="3"', "m/s", -0.5, 3.0),
    "t": ('K="1" factor="2"', "K", 2.0, 0.0),
}
"""By name: its definition in the FMU; unit in which the filter shows it, and factor and offset of what is shown."""


@pytest.mark.parametrize("unit", UNITS)
def test_a_filter_over_an_fmu_in_any_unit_is_the_same_filter(unit: str, tmp_path: Path) -> None:
    base, shown_in, factor, offset = UNITS[unit]
    xml = lying_fmus.description().replace(
        "<DefaultExperiment",
        f'<UnitDefinitions><Unit name="{unit}"><BaseUnit {base}/></Unit></UnitDefinitions><DefaultExperiment',
    )
    path = lying_fmus.build(tmp_path, xml=xml.replace('<Real start="1"/>', f'<Real start="1" unit="{unit}"/>'))
    table = {"kind": "ekf", "measurements": {"speed": 0.5}, "start_deviation": {"speed": 1.0}}
    filter_ = FmuFilterModel(path, FilterTable.model_validate(table), {"speed": 1.5})
    signals = {signal.name: signal.unit for signal in (*filter_.inputs, *filter_.outputs)}
    deviation = "K" if shown_in == "degC" else shown_in
    assert [signals[n] for n in ("measured_speed", "speed", "speed_std")] == [shown_in, shown_in, deviation]
    inputs = {signal.name: 0.0 for signal in filter_.inputs}
    first = [filter_.speed, filter_.speed_std]
    found = filter_.step(0.0, inputs | {"measured_speed": factor * 1.0 + offset}, 0.01)
    mean, spread = 1.5 * np.exp(-0.005), np.exp(-0.005)  # dv = -v / 2, then a measurement of 1.0 with 0.5
    gain = spread**2 / (spread**2 + 0.25)
    expected = [1.5, 1.0, mean + gain * (1.0 - mean), spread * np.sqrt(1.0 - gain)]
    shown = [factor * x + offset if k % 2 == 0 else abs(factor) * x for k, x in enumerate(expected)]
    np.testing.assert_allclose([*first, found["speed"], found["speed_std"]], shown, rtol=1e-6)
    assert found["nis"] == pytest.approx((1.0 - mean) ** 2 / (spread**2 + 0.25), rel=1e-6)


@given(
    factor=st.floats(1e-6, 1e6) | st.floats(-1e6, -1e-6),
    offset=st.floats(-1e3, 1e3),
    value=st.floats(-1e3, 1e3),
    unit=st.sampled_from(["K", "degC", "m/s"]),
)
def test_what_is_shown_leads_back_and_deviations_have_no_offset(
    factor: float, offset: float, value: float, unit: str
) -> None:
    scale = Scale(unit, factor, offset)
    rounding = 1e-12 * (abs(factor * value) + abs(offset)) / abs(factor) + 1e-300
    assert scale.own(scale.shown(value)) == pytest.approx(value, rel=1e-12, abs=rounding)
    deviations = scale.of_deviations
    assert deviations.shown(0.0) == 0.0
    assert deviations.shown(1.0) == abs(factor)
    assert parse_unit(deviations.unit).offset == 0.0
    assert parse_unit(deviations.unit).exponents == parse_unit(unit).exponents

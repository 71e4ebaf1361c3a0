"""Units that a scenario states of an FMU are as if the FMU had declared them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.build import linear_fmu
from test_fmus.description import Version

from cosim import Scenario
from cosim.components.loading import describe_fmu
from cosim.components.stated_units import StatedUnit
from cosim.errors import CosimError, CouplingError
from cosim.run.outcome import Outcome
from plant_models.hybrid.units import conversion, parse_unit

DECLARED = {"Fsoll": "kN", "vIst": "km/h", "sIst": "km"}
SPEEDS = ("m/s", "km/h", "mph", "m.s-1")


def train(folder: Path, name: str, units: Mapping[str, str] | None = None, version: Version = 2) -> Path:
    """A mass of 80 t without resistance, whose numbers are in kN, km/h and km."""
    return linear_fmu(
        folder,
        name,
        [[0.0, 1.0], [0.0, 0.0]],
        [[0.0], [1.0 / 80.0]],
        [[0.0, 3.6], [1e-3, 0.0]],
        [[0.0], [0.0]],
        version=version,
        inputs=["Fsoll"],
        outputs=["vIst", "sIst"],
        units=units,
    )


def outcome(fmu: Path, units: Mapping[str, Any]) -> Outcome:
    scenario = Scenario(stop=10.0, step=0.1)
    scenario.add("driver", model="driver").add("odometer", model="odometer")
    scenario.add("plant", fmu=fmu, units=units)
    scenario.connect("driver.effort -> plant.Fsoll", "plant.vIst -> odometer.wheel_speed")
    scenario.connect("odometer.reading -> driver.odometer")
    scenario.balises(position="plant.sIst", speed="plant.vIst", layout="positions", positions=[5.0, 20.0])
    return scenario.run()


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
def test_stated_units_are_declared_ones(tmp_path: Path, version: Version) -> None:
    declared = outcome(train(tmp_path, "declared", DECLARED, version), {})
    stated = outcome(train(tmp_path, "sealed", None, version), DECLARED)
    assert stated.failure is None
    assert stated.result.table.tobytes() == declared.result.table.tobytes()
    assert stated.result.signals == declared.result.signals
    assert [event.position for event in stated.result.events] == [5.0, 20.0]
    rows = np.unique(stated.result.time, return_index=True)[1]
    rate = np.gradient(stated["plant.sIst"][rows], stated.result.time[rows])
    assert stated["plant.vIst"].max() > 3.0
    assert abs(rate - stated["plant.vIst"][rows]).max() < 0.1  # both in SI


@pytest.mark.compiler
def test_a_sign_and_an_offset_are_those_of_the_usual_sense(tmp_path: Path) -> None:
    plain = outcome(train(tmp_path, "plain", DECLARED), {})
    turned = linear_fmu(
        tmp_path,
        "turned",
        [[0.0, 1.0], [0.0, 0.0]],
        [[0.0], [-1.0 / 80.0]],
        [[0.0, -3.6], [-1e-3, 0.0]],
        [[0.0], [0.0]],
        version=2,
        inputs=["Fsoll"],
        outputs=["vIst", "sIst"],
        x0=[4000.0, 0.0],
    )
    facts = {
        "Fsoll": {"unit": "kN", "sign": -1},
        "vIst": {"unit": "km/h", "sign": -1, "meaning": "speed of the train"},
        "sIst": {"unit": "km", "sign": -1, "offset": -4.0},
    }
    stated = outcome(turned, facts)
    for name in ("plant.vIst", "plant.sIst"):
        np.testing.assert_allclose(stated[name], plain[name], atol=1e-10)
    info = stated.result.info("plant.vIst")
    assert (info.unit, info.display_unit, info.description) == ("m/s", "km/h", "speed of the train")


@given(
    unit=st.sampled_from(SPEEDS),
    sign=st.sampled_from([1, -1]),
    offset=st.floats(-1e3, 1e3),
    value=st.floats(-1e3, 1e3),
)
def test_a_number_of_the_fmu_means_what_is_stated(
    sealed: Path, unit: str, sign: int, offset: float, value: float
) -> None:
    component = describe_fmu(sealed, "plant", {"vIst": StatedUnit(unit=unit, sign=sign, offset=offset)})
    found = component.unit("vIst")
    assert found is not None
    factor, shift = conversion(found, parse_unit("m/s"))
    expected = parse_unit(unit).factor * (sign * value + offset)
    assert factor * value + shift == pytest.approx(expected, abs=1e-9)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("sealed"), "sealed")


@pytest.fixture(scope="module")
def declaring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("declaring"), "declaring", {"vIst": "m/s"})


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ({"vist": "km/h"}, ["components.plant.units: vist", "'vIst'"]),
        ({"vIst": "kmh"}, ["units: vIst", "'kmh'", "km"]),
        ({"vIst": "km/h"}, ["km/h is stated, and the FMU declares m/s", 'instead_of = "m/s"']),
        ({"vIst": "kN"}, ["kN is stated, and the FMU declares m/s, which is of another kind"]),
        ({"sIst": {"sign": -1}}, ["a sign and an offset need a unit"]),
    ],
)
def test_what_cannot_be_is_refused(declaring: Path, units: Mapping[str, Any], words: list[str]) -> None:
    scenario = Scenario(stop=1.0, step=0.1)
    with pytest.raises(CouplingError) as error:
        scenario.add("plant", fmu=declaring, units=units)
    for word in words:
        assert word in str(error.value)


def test_the_same_unit_by_another_name_is_no_contradiction(declaring: Path) -> None:
    component = describe_fmu(declaring, "plant", {"vIst": StatedUnit(unit="m.s-1")})
    assert component.unit("vIst") == parse_unit("m/s")


def test_a_wrong_declaration_is_replaced_where_that_is_said(declaring: Path) -> None:
    component = describe_fmu(declaring, "plant", {"vIst": StatedUnit(unit="km/h", instead_of="m/s")})
    assert component.unit("vIst") == parse_unit("km/h")


def test_units_belong_to_an_fmu() -> None:
    with pytest.raises(CosimError, match="'units' belong to an FMU"):
        Scenario(stop=1.0, step=0.1).add("plant", model="locomotive", units={"speed": "km/h"})

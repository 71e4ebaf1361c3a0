"""Masses of trains: one in the wrong unit is named before the run, and none that is right."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim import Scenario
from cosim.components.component import Component
from cosim.run.described_components import describe_component
from cosim.run.plausible_masses import mass_warnings
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.shipped import shipped_scenarios

OWN_FMU = "own_fmu"
"""Its FMU is the user's."""


@cache
def described(name: str, key: str, model: str) -> Component:
    return describe_component(name, ComponentTable.model_validate({key: model}), Path(), "test")


def warnings(**parts: dict[str, Any]) -> list[str]:
    """Of components by their models and parameters, which are described once: that takes much longer."""
    tables = {name: ComponentTable.model_validate(part) for name, part in parts.items()}
    models = {name: next(iter(part.items())) for name, part in parts.items()}
    return mass_warnings(tables, {name: described(name, *model) for name, model in models.items()})


@pytest.mark.parametrize("model", ["locomotive", "longitudinal_train", "train"])
@given(tonnes=st.floats(10.0, 999.0))
def test_tonnes_in_place_of_kilograms_are_named_and_kilograms_are_not(model: str, tonnes: float) -> None:
    wrong = warnings(train={"model": model, "parameters": {"mass": tonnes}})
    assert [f"for {tonnes:g} t write {1e3 * tonnes:g}" in text for text in wrong] == [True]
    assert warnings(train={"model": model, "parameters": {"mass": 1e3 * tonnes}}) == []


@cache
def vendors(unit: str, start: float) -> Component:
    """A locomotive whose mass a vendor states in another unit."""
    component = describe_component("train", ComponentTable.model_validate({"model": "locomotive"}), Path(), "test")
    component.variables["mass"].unit, component.variables["mass"].start = unit, str(start)
    return component


@given(tonnes=st.floats(10.0, 999.0))
def test_kilograms_in_place_of_tonnes_are_named_and_tonnes_are_not(tonnes: float) -> None:
    """Of an FMU that declares 90 t; what is named is what was typed."""

    def of(value: float) -> list[str]:
        table = ComponentTable.model_validate({"model": "locomotive", "parameters": {"mass": value}})
        return mass_warnings({"train": table}, {"train": vendors("t", 90.0)})

    assert of(tonnes) == []
    heavy = of(1e3 * tonnes)
    assert bool(heavy) == (tonnes >= 45.0)
    assert all(f"train.mass = {1e3 * tonnes:g} t is no mass of a train" in text for text in heavy)
    assert all("stated in tonnes, not in kilograms" in text for text in heavy)
    (light,) = of(1e-3 * tonnes)
    assert f"train.mass = {1e-3 * tonnes:g} t is no mass" in light
    assert f"write {tonnes:g}." in light


def test_a_default_that_is_no_mass_of_a_train_is_named() -> None:
    """A vendor who declares 90 kg and means tonnes."""
    table = ComponentTable.model_validate({"model": "locomotive"})
    (text,) = mass_warnings({"train": table}, {"train": vendors("kg", 90.0)})
    assert text.startswith("train.mass is 90 kg, its default, which is no mass of a train; ")
    assert "for 90 t write 90000" in text
    assert mass_warnings({"train": table}, {"train": vendors("t", 90.0)}) == []


@given(mass=st.floats(500.0, 999.0))
def test_a_small_vehicle_that_is_declared_as_one_is_right(mass: float) -> None:
    table = ComponentTable.model_validate({"model": "locomotive", "parameters": {"mass": mass}})
    assert mass_warnings({"train": table}, {"train": vendors("kg", 1200.0)}) == []


def test_the_mass_beside_another_is_stated_in_its_own_unit() -> None:
    table = ComponentTable.model_validate({"model": "locomotive"})
    tables = {"train": table, "observer": ComponentTable.model_validate({"observer": "quasi_lpv_uio"})}
    components = {"train": vendors("t", 90.0), "observer": described("observer", "observer", "quasi_lpv_uio")}
    (text,) = mass_warnings(tables, components)
    assert text.startswith("observer.mass is 1 kg, its default, beside train.mass = 90 t; ")
    assert "write mass = 90000 in [components.observer" in text


def test_an_observer_that_takes_the_train_for_one_kilogram_is_named() -> None:
    train = {"model": "longitudinal_train", "parameters": {"mass": 80e3}}
    (text,) = warnings(train=train, observer={"observer": "quasi_lpv_uio"})
    assert text.startswith("observer.mass is 1 kg, its default, beside train.mass = 80000 kg; ")
    assert "mass = 80000 in [components.observer.parameters]" in text
    assert (
        warnings(train={"model": "longitudinal_train"}, observer={"observer": "quasi_lpv_uio"}) == []
    )  # per unit mass


def test_grams_are_named() -> None:
    (text,) = warnings(train={"model": "locomotive", "parameters": {"mass": 9e8}})
    assert "not in grams" in text


def test_small_masses_of_what_is_no_train_are_right() -> None:
    assert warnings(cart={"model": "cart_pendulum", "parameters": {"cart_mass": 90.0}}) == []


@pytest.mark.parametrize("name", [name for name in shipped_scenarios() if name != OWN_FMU])
def test_no_shipped_scenario_is_doubted(name: str) -> None:
    structure = Scenario.load(name)
    table = structure.table()
    components = {
        n: describe_component(n, t, structure.folder, name) for n, t in table.components.items() if t.recording is None
    }
    assert mass_warnings({n: table.components[n] for n in components}, components) == []

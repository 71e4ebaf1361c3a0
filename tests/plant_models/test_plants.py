"""What every plant declares: names, units, descriptions, sources, sensible starts and presets that run."""

from __future__ import annotations

import numpy as np
import pytest
from railway_runs import started

from plant_models import PLANTS
from plant_models.hybrid import TracedSystem

NAMES = sorted(PLANTS)


def test_the_registry_holds_the_plants_under_their_names() -> None:
    assert {"balise_reader", "driver", "locomotive", "odometer"} <= set(NAMES)
    assert all(PLANTS[name].name == name for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_plant_says_what_it_is_and_where_it_comes_from(name: str) -> None:
    plant = PLANTS[name]()
    assert plant.description
    assert plant.source, "source = ... is missing: thesis and equation number, paper, or 'ours'"
    signals = (*plant.states, *plant.input_signals, *plant.outputs, *plant.parameter_signals)
    assert [s.name for s in signals if not s.description] == [], "without description"
    assert [s.name for s in signals if not s.unit] == [], "without unit"
    speeds = [s for s in (*plant.inputs, *plant.outputs, *plant.parameters) if s.unit == "m/s"]
    assert [s.name for s in speeds if s.display_unit != "km/h"] == [], 'without display_unit="km/h"'


@pytest.mark.parametrize("name", NAMES)
def test_starts_lie_within_their_bounds_under_every_preset(name: str) -> None:
    plant = PLANTS[name]()
    for preset in (None, *plant.presets):
        p = plant.start_parameters(preset)
        position = 0
        for signal in plant.parameter_signals:
            values = p[position : position + signal.width]
            position += signal.width
            assert signal.min is None or (values >= signal.min).all(), (preset, signal.name)
            assert signal.max is None or (values <= signal.max).all(), (preset, signal.name)


@pytest.mark.parametrize("name", NAMES)
def test_every_option_traces_and_runs(name: str) -> None:
    plant = PLANTS[name]
    for option, choices in plant.option_choices.items():
        for choice in (choices[0], choices[-1]) if choices else ():  # of some any is legal
            system = plant(**{option: choice})
            assert system.options[option] == choice
            assert TracedSystem(system).step.n_in() == 5
    for preset in (None, *plant().presets):
        runtime = started(plant(), preset)
        runtime.advance(0.05)
        assert np.isfinite(runtime.update_outputs()).all()


def test_the_names_shared_with_the_observers_are_there() -> None:
    locomotive, odometer, driver = (PLANTS[n]() for n in ("locomotive", "odometer", "driver"))
    assert [s.name for s in locomotive.inputs] == ["effort"]
    assert [s.name for s in locomotive.outputs] == [
        "position",
        "speed",
        "acceleration",
        "wheel_speed",
        "slip",
        "adhesion_force",
        "resistance_force",
        "gradient_force",
        "adhesion_degraded",
    ]
    shared = {
        "mass",
        "wheel_inertia",
        "n_axles",
        "wheel_radius",
        "gravity",
        "davis_a",
        "davis_b",
        "davis_c",
        "slip_floor",
    }
    assert shared <= {s.name for s in locomotive.parameters}
    assert ([s.name for s in odometer.inputs], odometer.outputs[0].name) == (["wheel_speed"], "reading")
    assert ([s.name for s in driver.inputs], [s.name for s in driver.outputs]) == (
        ["odometer"],
        ["effort", "speed_reference"],
    )

"""Presets of the train observers: each takes the parameters of any train, or says before the run which it is for."""

from __future__ import annotations

import pytest
from shipped import shipped

from fmu_observer import OBSERVERS
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.hybrid import HybridSystem, Runtime

# mass [kg], Davis coefficients [N], [N.s/m], [N.s2/m2]: a railcar, the train of this package, a locomotive that is a
# ton heavier and one whose coefficients are rounded, an ICE, a freight train; and per unit mass
TRAINS = {
    "railcar": (40e3, 600.0, 12.0, 4.0),
    "shipped": (90e3, 900.0, 32.4, 1.65287),
    "heavier": (91e3, 900.0, 32.4, 1.65287),
    "rounded": (90e3, 900.0, 32.0, 1.65),
    "high speed": (460e3, 6000.0, 60.0, 6.5),
    "freight": (2000e3, 25e3, 600.0, 12.0),
    "unit mass": (1.0, 0.02, 0.005, 1e-4),
}
NAMES = ("mass", "davis_a", "davis_b", "davis_c")


def train_observers() -> dict[str, HybridSystem]:
    """All registered observers of a train that are told of its mass, or of its odometer."""
    made = {name: shipped(name) for name in OBSERVERS}
    return {name: system for name, system in made.items() if ".observers.train." in type(system).__module__}


CASES = [(name, preset) for name, system in train_observers().items() for preset in (*system.presets, None)]


@pytest.mark.parametrize(("name", "preset"), CASES)
def test_a_preset_takes_any_train(name: str, preset: str | None) -> None:
    """It starts with the parameters of any train."""
    system = OBSERVERS[name]()
    known = {s.name for s in system.parameter_signals}
    for train, values in TRAINS.items():
        reported = {key: value for key, value in zip(NAMES, values, strict=True) if key in known}
        chosen = parameter_values(system, reported, preset, "of " + train)
        runtime = Runtime(system)
        runtime.p[: len(chosen)] = chosen
        runtime.start(0.0)

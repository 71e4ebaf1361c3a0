"""Law over all train observers and presets: a telegram that changes nothing is told before the run."""

from __future__ import annotations

from functools import cache

import pytest
from shipped import shipped

import cosim
from fmu_observer import OBSERVERS
from fmu_observer.observers.gated_observer import GatedObserver
from plant_models.hybrid import Runtime, scalar_names

WORDS = "balises do not act on it"


def _has_position(system: GatedObserver) -> bool:
    return "position" in scalar_names(system.outputs)


@cache
def cases() -> list[tuple[str, str | None]]:
    systems = {name: shipped(name) for name in OBSERVERS}
    reported = {n: s for n, s in systems.items() if isinstance(s, GatedObserver) and s.gated and _has_position(s)}
    return [(name, preset) for name, system in reported.items() for preset in system.presets or (None,)]


@cache
def moved(name: str, preset: str | None) -> bool:
    """Whether a telegram that is 5 m off moves the position within half a second: asked of the observer itself."""
    places = []
    for telegram in (False, True):
        system = OBSERVERS[name]()
        runtime = Runtime(system)
        if preset is not None:
            runtime.p[:] = system.start_parameters(preset)
            runtime.x[:] = system.start_state(preset)
        runtime.start(0.0)
        runtime.advance(0.1)
        if telegram:
            position = list(runtime.update_outputs())[scalar_names(system.outputs).index("position")]
            runtime.u[scalar_names(system.input_signals).index("balise_position")] = float(position) + 5.0
            runtime.trigger("balise")
        runtime.advance(0.6)
        places.append(float(runtime.update_outputs()[scalar_names(system.outputs).index("position")]))
    return abs(places[1] - places[0]) > 1e-6


def warned(name: str, preset: str | None) -> list[str]:
    scenario = cosim.Scenario(stop=0.2, step=0.1)
    scenario.add("train", model="longitudinal_train", parameters={"train_speed": 20.0})
    alone = dict.fromkeys({"odometer", "measured_odometer"} & {s.name for s in OBSERVERS[name]().inputs}, 0.0)
    scenario.add("observer", observer=name, parameters=alone, **({} if preset is None else {"preset": preset}))
    scenario.balises(layout="positions", positions=[2.0], position="train.position", speed="train.speed")
    texts: list[str] = []
    scenario.run(warn=texts.append)
    return [text for text in texts if WORDS in text]


def test_some_presets_are_deaf_and_most_are_not() -> None:
    deaf = [case for case in cases() if not moved(*case)]
    assert {preset for _, preset in deaf} == {"gps"}
    assert len(cases()) > 10 * len(deaf)


FIRST = {name: (name, preset) for name, preset in reversed(cases())}  # of each observer one, and all called gps


@pytest.mark.parametrize(("name", "preset"), sorted({*FIRST.values(), *(c for c in cases() if c[1] == "gps")}, key=str))
def test_a_deaf_observer_is_reported_before_the_run(name: str, preset: str | None) -> None:
    reported = warned(name, preset)
    assert bool(reported) == (not moved(name, preset)), reported
    if reported:
        assert "nothing is connected to its event 'gps'" in reported[0]


@pytest.mark.parametrize(("mass", "reported"), [(873e3, 0), (120e3, 1), (2000e3, 1)])
def test_a_preset_of_another_train_is_reported_before_the_run(mass: float, reported: int) -> None:
    scenario = cosim.Scenario(stop=0.2, step=0.1)
    scenario.add("observer", observer="balise_odometer_ekf", preset="tuned", parameters={"mass": mass, "odometer": 0.0})
    texts: list[str] = []
    scenario.run(warn=texts.append)
    found = [text for text in texts if "is made for" in text]
    assert len(found) == reported
    assert all(f"and here mass = {mass:g}" in text for text in found)

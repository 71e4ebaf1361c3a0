"""What the jam rules are told of an odometer's noise, beside what it has: told before a run where it matters."""

from __future__ import annotations

from pathlib import Path

import pytest
from shipped import shipped

import cosim
from cosim import Scenario
from cosim.run.checked_observers import _working_points
from cosim.run.connections import parse_connections
from fmu_observer import OBSERVERS
from plant_models import PLANTS
from plant_models.hybrid import scalar_names

NOISE, SIZE = "move readings of odometer.reading by up to", "smaller ones are noise to them"
SHIPPED = sorted(path.stem for path in Path(cosim.__file__).parent.joinpath("scenarios").glob("*.toml"))
EVALUATES = sorted(name for name in OBSERVERS if getattr(OBSERVERS[name](), "stated_bounds", {}))


def warned(name: str, sensor: str, stated: dict[str, float], **parameters: float) -> list[str]:
    scenario = Scenario(stop=0.2, step=0.1, certificates="warn")
    scenario.add("train", model="longitudinal_train", parameters={"train_speed": 20.0})
    scenario.add("odometer", model=sensor, parameters=stated)
    alone = {"residual": 0.0, "estimated_speed": 0.0} if name == "jam_detector" else {}
    scenario.add("observer", observer=name, preset="as_published_5_3_1", parameters=alone | parameters)
    scenario.connect("train.wheel_speed -> odometer.wheel_speed", "odometer.reading -> observer.odometer")
    texts: list[str] = []
    scenario.run(warn=texts.append)
    return [text for text in texts if NOISE in text or SIZE in text]


def test_those_that_evaluate_an_odometer_know_its_noise() -> None:
    assert EVALUATES == ["jam_detector", "quasi_lpv_uio"]
    holders = [n for n in OBSERVERS if "odometer_noise" in scalar_names(shipped(n).parameter_signals)]
    assert sorted(holders) == EVALUATES


@pytest.mark.parametrize("name", EVALUATES)
@pytest.mark.parametrize(
    ("sensor", "stated", "bound"),
    [
        ("odometer", {"sample_period": 0.2, "noise_std": 0.02}, 0.08),
        ("odometer", {"sample_period": 0.2, "teeth": 100.0, "wheel_radius": 0.46}, 0.14451),
        ("pulse_odometer", {"teeth": 1000.0, "noise_std": 0.02}, 0.08338),
    ],
)
def test_less_than_arrives_is_reported_and_enough_is_not(
    name: str, sensor: str, stated: dict[str, float], bound: float
) -> None:
    """Bounds by hand: four deviations; 2 pi 0.46 / (100 . 0.2); four of sqrt(0.02^2 + 0.01445^2 / 6)."""
    (reported,) = warned(name, sensor, stated, odometer_noise=0.9 * bound, threshold=9.0)
    assert NOISE in reported
    assert f"{bound:.3g} m/s, and odometer_noise is" in reported
    assert warned(name, sensor, stated, odometer_noise=1.001 * bound, threshold=9.0) == []


@pytest.mark.parametrize("name", EVALUATES)
def test_faults_that_are_noise_are_detected_by_their_size(name: str) -> None:
    """eps / M is 0.4 / 3.36; noise of 0.05 m/s makes sqrt(2) 0.2 = 0.283 m/s, 0.483 m/s with that of the reading."""
    quiet = {"sample_period": 0.2, "noise_std": 0.02}
    noisy = quiet | {"noise_std": 0.05}
    assert warned(name, "odometer", quiet, odometer_noise=0.08, threshold=0.4) == []
    (reported,) = warned(name, "odometer", noisy, odometer_noise=0.2, threshold=0.4)
    assert "by 0.283 m/s in one of two cases, by 0.483 m/s always" in reported


def test_gains_that_make_more_of_noise_are_reported() -> None:
    loud = {"gain_low": [9.0, -1.34, -0.22], "gain_high": [9.0, -1.33, -0.22]}
    reported = _working_points(Scenario.load("jam_odometry").table().components, [], "here")
    assert reported == []
    scenario = Scenario.load("jam_odometry")
    for key, value in loud.items():
        scenario.set(f"quasi_lpv_uio.{key}", value)
    (doubt,) = _working_points(scenario.table().components, [], "here")
    assert "times as noisy as a reading" in doubt


@pytest.mark.parametrize("scenario", SHIPPED)
def test_nothing_is_said_of_what_ships(scenario: str) -> None:
    table = Scenario.load(scenario).table()
    assert _working_points(table.components, parse_connections(table.connections, scenario), scenario) == []


def test_sensors_have_a_bound_for_each_reading() -> None:
    for name in ("odometer", "pulse_odometer"):
        system = PLANTS[name]()
        p = system.unpack_parameters(system.start_parameters())
        bounds = {output: float(system.reading_bound(output, p)) for output in scalar_names(system.outputs)}
        assert bounds["distance"] == 0.0
        assert ("sampled_reading" not in bounds) or bounds["sampled_reading"] > bounds["reading"] > 0.0

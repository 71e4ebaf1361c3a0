"""Runs of the study of the train's diagnosis: journeys recorded once, sensors and diagnosis in batches beside them.

The diagnosis does not act on the train, so a journey is run once (`cosim`), and the sensors (their noise by seeds) and
the diagnosis go beside the recording in `fmus.Batch`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import cosim
import fmus
from fmu_observer.detection.train_isolation import FAULTS, RESIDUALS

PERIOD, STEP = 0.1, 0.02  # [s]
SIGNALS = {
    "axle_1": "train.axle_speed[1]",
    "axle_2": "train.axle_speed[4]",
    "speed": "train.speed",
    "position": "train.position",
    "pressure": "train.cylinder_pressure[1]",
    "gradient": "train.gradient_force",
    "effort": "controller.effort",
    "demand": "controller.brake_demand",
}
SENSORS = ("odometer_1", "odometer_2", "radar", "gps_position", "cylinder_pressure")
BALISES = 150.0  # [m] apart


@dataclass(frozen=True)
class Journey:
    """What a run is made of.

    Attributes:
        speed: held [km/h]. distance: to the stop [m]. acceleration: [m/s2]. deceleration: [m/s2]. rail: friction at
            rest of Polach's curve on the wet part, 0 for none. mass: factor of all masses. grade: not on the map [1].
        plant: parameters of the train that differ. traction: share of the effort that arrives. brake: share of the
            brake demand that arrives in the pipe.
    """

    speed: float
    distance: float
    acceleration: float = 0.5
    deceleration: float = 0.4
    rail: float = 0.0
    mass: float = 1.0
    grade: float = 0.0
    traction: float = 1.0
    brake: float = 1.0
    plant: tuple[tuple[str, Any], ...] = ()


INSIDE = (
    Journey(35.0, 850.0),
    Journey(50.0, 1200.0, 0.35),
    Journey(50.0, 1200.0, 0.35, rail=0.2),
    Journey(35.0, 850.0, mass=1.03),
    Journey(60.0, 1500.0, 0.4, 0.5, mass=0.97, grade=0.001),
    Journey(25.0, 600.0, grade=-0.001),
)
"""Fault-free journeys from which the thresholds come."""
OUTSIDE = (
    Journey(30.0, 700.0, 0.45, 0.35),
    Journey(55.0, 1400.0, 0.45, 0.45, mass=1.02),
    Journey(45.0, 1000.0, 0.3, rail=0.15),
    Journey(40.0, 1000.0, 0.3, 0.5, mass=0.98, grade=0.0008),
    Journey(55.0, 1300.0, rail=0.25, mass=1.03),
    Journey(45.0, 1100.0, 0.5, 0.3, grade=-0.001),
)
"""Other missions, other rails, other loads: none of them made a threshold."""
WET_INSIDE = (
    Journey(30.0, 1000.0, 0.3, rail=0.15),
    Journey(50.0, 1000.0, 0.35, rail=0.15, mass=1.03, grade=0.001),
    *(
        journey
        for rail in (0.2, 0.25)
        for journey in (
            Journey(30.0, 1000.0, 0.3, rail=rail),
            Journey(50.0, 1000.0, 0.35, rail=rail, mass=1.03, grade=0.001),
            Journey(40.0, 1000.0, 0.45, 0.35, rail=rail, mass=0.97, grade=-0.001),
        )
    ),
    Journey(60.0, 1500.0, 0.4, 0.5, rail=0.2),
    Journey(60.0, 1500.0, 0.5, 0.5, rail=0.25, mass=1.03),
)
"""Fault-free journeys on wet rails, from which the preset `wet_rails` comes. Rail and effort are such that wheels
creep, by 0.5 m/s or 3 % at most, and do not spin."""
WET_OUTSIDE = (
    *(journey for journey in OUTSIDE if journey.rail > 0.0),
    Journey(35.0, 900.0, 0.4, rail=0.17),
    Journey(55.0, 1300.0, 0.35, 0.5, rail=0.22, mass=0.98, grade=0.0008),
    Journey(25.0, 600.0, 0.35, rail=0.18, mass=1.02),
)
"""Others on wet rails."""


def recorded(journey: Journey) -> dict[str, np.ndarray]:
    """A journey of the train with 4 wagons under its controller, sampled each `PERIOD`, each shape (k,).

    Args:
        journey: what to run.
    """
    stop = 25.0 + 3.6 * journey.distance / journey.speed + journey.speed / 3.6 / journey.acceleration
    s = cosim.Scenario(stop=10.0 * round(stop / 10.0), step=STEP, certificates="ignore")
    base = {"mass": 90e3, "wagon_mass": 19e3}
    plant = {name: value * journey.mass for name, value in base.items()}
    plant |= {"gradient_position": [0.0, 250.0, 500.0], "gradient": [0.0, 0.006, 0.0]}
    if journey.rail > 0.0:
        plant |= {"zone_from": 20.0, "zone_to": journey.distance, "polach_degraded_mu0": journey.rail}
    else:
        plant |= {"zone_from": 0.0, "zone_to": 0.0}
    options = {"adhesion": "polach", "zone_count": 1, "gradient_count": 3}
    s.add("train", model="train", options=options, parameters=plant | dict(journey.plant))
    mission = {"target_speed": journey.speed / 3.6, "acceleration": journey.acceleration}
    mission |= {"deceleration": journey.deceleration, "distance": journey.distance, "departure_time": 5.0}
    s.add("mission", model="mission", options={"braking": "position"}, parameters=mission)
    s.add("controller", model="adrc_controller", options={"drive": "ramped"})
    s.connect(
        "train.position -> mission.position",
        "train.speed -> controller.odometer",
        "mission.speed_reference -> controller.speed_reference",
        "mission.acceleration_reference -> controller.acceleration_reference",
        {"from": "controller.effort", "to": "train.effort", "factor": journey.traction},
        {"from": "controller.brake_demand", "to": "train.brake_demand", "factor": journey.brake},
    )
    outcome = s.run()
    if outcome.failure is not None:
        raise RuntimeError(f"{journey}: {outcome.failure}")
    every = round(PERIOD / STEP)
    run = {name: outcome[signal][::every] for name, signal in SIGNALS.items()}
    run["time"] = outcome["time"][::every]
    run["gradient"] = run["gradient"] - journey.grade * 166e3 * 9.81  # what the map has
    return run


def sensed(run: Mapping[str, np.ndarray], members: int, seed: int) -> dict[str, np.ndarray]:
    """What the sensors read beside a journey, by the inputs of the diagnosis, each shape (members, k).

    Wheel radii and the radar's angle are off by a constant that is drawn for each member: 0.3 % and 0.2 % as standard
    deviation.

    Args:
        run: of `recorded`. members: seeds. seed: of all.
    """
    rng = np.random.default_rng(seed)
    t = run["time"]
    kinds: dict[str, tuple[str, str, np.ndarray, dict[str, Any]]] = {
        "odometer_1": ("odometer", "wheel_speed", run["axle_1"], {"sample_period": PERIOD, "noise_std": 0.03}),
        "odometer_2": ("odometer", "wheel_speed", run["axle_2"], {"sample_period": PERIOD, "noise_std": 0.03}),
        "radar": ("doppler_radar", "speed", run["speed"], {"scale_error": 0.002 * rng.standard_normal(members)}),
        "gps_position": ("gps", "position", run["position"], {}),
        "cylinder_pressure": ("brake_pressure_sensor", "pressure", run["pressure"], {}),
    }
    read = {}
    for number, (name, (model, signal, value, parameters)) in enumerate(kinds.items()):
        batch = fmus.Batch(model, members=members)
        batch.set("seed", rng.integers(0, 2**31 - 1, members) + number)
        for key, setting in parameters.items():
            batch.set(key, setting)
        scale = 1.0 + 0.003 * rng.standard_normal(members) if model == "odometer" else np.ones(members)
        batch.start()
        read[name] = batch.run(t[1:], results=["reading"], inputs={signal: scale[:, None] * value})[:, :, 0]
    return read


def diagnosed(
    run: Mapping[str, np.ndarray],
    read: Mapping[str, np.ndarray],
    settings: Mapping[str, Any] | None = None,
    balise_error: np.ndarray | None = None,
    results: Sequence[str] | None = None,
) -> dict[str, np.ndarray]:
    """Outputs of the diagnosis beside a journey, each shape (members, k).

    Args:
        run: of `recorded`. read: of the sensors. settings: parameters of the diagnosis.
        balise_error: for each member what each telegram is off [m], shape (members, balises). results: outputs; None
            for residuals and codes.
    """
    members, t = len(read["odometer_1"]), run["time"]
    names = list(results or [*(f"ratio_{r}" for r in RESIDUALS), *(f"{f}_fault" for f in FAULTS)])
    batch = fmus.Batch("train_diagnosis", members=members)
    for key, value in (settings or {}).items():
        batch.set(key, value)
    places = balise_places(run)
    stamps = np.interp(places, *_rising(run))
    error = np.zeros((members, len(places))) if balise_error is None else balise_error
    everyone = np.arange(members)
    for number, (place, stamp) in enumerate(zip(places, stamps, strict=True)):
        batch.notify("balise", everyone, np.full(members, stamp), position=place + error[:, number])
    batch.start()
    equal = {"effort": run["effort"], "brake_demand": run["demand"], "gradient_force": run["gradient"]}
    out = batch.run(t[1:], results=names, inputs={**equal, **read})
    if batch.failures:
        raise RuntimeError(str(batch.failures))
    return {name: out[:, :, i] for i, name in enumerate(names)}


def balise_places(run: Mapping[str, np.ndarray]) -> np.ndarray:
    """Positions of the balises that a journey passes [m].

    Args:
        run: of `recorded`.
    """
    return np.arange(20.0, run["position"].max() - 1.0, BALISES)


def _rising(run: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    p = run["position"]
    moves = np.concatenate([[True], np.diff(np.maximum.accumulate(p)) > 1e-6])
    return p[moves], run["time"][moves]

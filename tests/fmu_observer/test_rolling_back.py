"""Law over every train observer: a train that rolls back is followed, or it is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_standstill import DAVIS, LATE, MASS, PERIOD, TRAIN_OBSERVERS, reported

from cosim import Scenario
from fmu_observer import OBSERVERS

STEEPNESS = 0.02  # sine of the slope; without any effort the train comes to rest and rolls back
FOLLOWED = (0.35, 1.0)  # [m/s], [m]: within the lag of a held reading and of a gain of 1 1/s at 0.2 m/s2


def roll_back(name: str) -> tuple[Any, list[str]]:
    """Up a slope that nobody is told at 2 m/s, to rest, and back by some metres at up to 1 m/s; and what was warned."""
    inputs = {i.name for i in OBSERVERS[name]().inputs}
    late = {"network": {"period": PERIOD, "receivers": [LATE], "nodes": {"tachometer": ["odometer.reading"]}}}
    s = Scenario(stop=15.0, step=PERIOD, certificates="ignore", **(late if name == LATE else {}))
    train = {"mass": MASS, "traction_coefficient": 1.0, "brake_coefficient": 1.0, "train_speed": 2.0, **DAVIS}
    s.add("train", model="longitudinal_train", parameters=train | {"gradient": [STEEPNESS] * 4})
    s.add("odometer", model="odometer", parameters={"sample_period": 0.01 if name == "stopping_uio" else PERIOD})
    s.add(name, observer=name, parameters=reported(name) | {k: 2.0 for k in reported(name) if "speed" in k})
    s.connect("train.wheel_speed -> odometer.wheel_speed")
    s.connect(*(f"odometer.reading -> {name}.odometer" for one in ("odometer",) if one in inputs))
    s.connect(*(f"odometer.reading -> {one}.packet_speed" for one in (name,) if one == LATE))
    warned: list[str] = []
    outcome = s.run(warn=warned.append)
    assert outcome.failure is None, outcome.failure
    return outcome, warned


@pytest.mark.parametrize("name", TRAIN_OBSERVERS)
def test_a_train_that_rolls_back_is_followed_or_reported(name: str) -> None:
    outcome, warned = roll_back(name)
    t, v, place = outcome.result.time, outcome["train.speed"], outcome["train.position"]
    assert 2.0 < place.max() - place[-1] < 10.0
    back = v < -0.4
    lost = (outcome[f"{name}.position"] - place)[v <= 0.0]
    if f"{name}.error_bound" in {s.name for s in outcome.result.signals}:
        assert (np.abs(outcome[f"{name}.speed"] - v) <= outcome[f"{name}.error_bound"] + 1e-9).all()
    speed = np.abs(outcome[f"{name}.speed"] - v)[back].max()
    if speed < FOLLOWED[0] and np.abs(lost - lost[0]).max() < FOLLOWED[1]:
        return
    assert (outcome[f"{name}.rolls_back"][back & (t > t[back][0] + PERIOD)] == 1.0).all()
    assert any(f"{name}: the train rolls back" in text for text in warned)

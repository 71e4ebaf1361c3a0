"""Fixes of the satellite receiver as events of an observer: told by count and stamp, used at their own instants."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fmu_observer.block import make_block
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, memory, output_signal, state
from plant_models.railway.sensors.gps import Gps

SPEED, STEP = 3.0, 0.04  # [m/s], [s]; fixes at 10 Hz lie inside communication steps


class Corrected(HybridSystem):
    """Dead reckoning that takes the place of each fix."""

    name = "corrected"
    description = "Dead reckoning, reset at fixes"
    source = "a test"
    states = (state("place", "m", 7.0), memory("fixes", "1"))
    outputs = (output_signal("position", "m"), output_signal("heard", "1"))
    events = (TriggeredEvent("gps", (input_signal("gps_position", "m", variability="discrete"),)),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": SPEED}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.gps_position, "fixes": x.fixes + 1.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.place, "heard": x.fixes}


class Wired:
    """A block of FMI 2 by names."""

    def __init__(self, system: HybridSystem, **parameters: float) -> None:
        self.block: Any = make_block(system, fmi_version=2)
        self.references = {v.name: v.valueReference for v in self.block.model_description.modelVariables}
        self.block.instantiate()
        for name, value in parameters.items():
            self.write(name, value)
        self.block.setupExperiment(startTime=0.0)
        self.block.enterInitializationMode()
        self.block.exitInitializationMode()

    def write(self, name: str, value: float) -> None:
        self.block.setReal([self.references[name]], [value])

    def read(self, name: str) -> float:
        return float(self.block.getReal([self.references[name]])[0])


def test_a_fix_lands_at_its_own_stamp() -> None:
    receiver, observer = Wired(Gps(), drift_std=0.0, white_std=0.0, sample_offset=0.02), Wired(Corrected())
    for k in range(50):
        t = k * STEP
        receiver.write(
            "position", SPEED * 0.02 + SPEED * 0.1 * np.floor((t + STEP - 0.02) / 0.1 + 1e-9)
        )  # at the fix in this step
        receiver.block.doStep(t, STEP)
        count = receiver.block.getInteger([receiver.references["gps_count"]])
        observer.block.setInteger([observer.references["gps_count"]], count)
        for name in ("gps_time", "gps_position"):
            observer.write(name, receiver.read(name))
        observer.block.doStep(t, STEP)
    assert observer.read("heard") == 20.0  # 0.02, 0.12 ... 1.92 s
    assert observer.read("position") == pytest.approx(SPEED * 2.0, abs=1e-9)  # 7 m off at the start

"""The loop of train, odometer, driver and observer that foreign masters and hosts in C run, in our own master."""

from __future__ import annotations

import cosim

PLANT_PRESET = "chapter_3_four_axles"
TRAIN = {"n_axles": 4.0, "davis_b": 32.0, "davis_c": 1.7}


def balise_loop(stop: float, step: float, spacing: float, method: str) -> cosim.Scenario:
    """The scenario [s], with a balise every `spacing` [m] that is found by the method."""
    s = cosim.Scenario(stop=stop, step=step, certificates="ignore")
    s.add("train", model="locomotive", preset=PLANT_PRESET)
    s.add("odometer", model="odometer").add("driver", model="driver")
    s.add("observer", observer="takagi_sugeno_cdo", parameters=TRAIN)
    s.connect(
        "driver.effort -> train.effort, observer.effort",
        "train.wheel_speed -> odometer.wheel_speed",
        "odometer.reading -> driver.odometer, observer.odometer",
    )
    where = {"position": "train.position", "speed": "train.speed", "track_end": 3000.0}
    return s.balises(**where, layout="spacing", spacing=spacing, method=method)

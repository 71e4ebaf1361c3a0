"""Generic observers of the freight train beside the locomotive, told of balises by the master: by spacing, and
aperiodic.
"""

from typing import Any

import numpy as np
import pytest

from cosim import Scenario

OBSERVERS = {
    "exponential_gain": "theta",
    "output_predictor": "theta",
    "held_innovation": "theta",
    "hybrid_impulsive": None,
}
SPEED = 15.0  # [m/s]
EFFORT = 900.0 + 32.4 * SPEED + 1.65287 * SPEED**2  # [N], what keeps that speed
SPACING = 10.0  # [m], so 0.67 s

LAYOUTS = {
    "spacing": {"layout": "spacing", "spacing": SPACING, "track_end": 600.0, "expected_speed": SPEED},
    "aperiodic": {"layout": "aperiodic", "seed": 3, "min_gap": 0.1, "max_gap": 0.5},
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_they_find_position_and_speed_from_balises_alone(layout: str) -> None:
    s = Scenario(stop=25.0, step=0.05, certificates="require")
    s.add("locomotive", model="locomotive", **{"as": "block3"})
    starts: dict[str, Any] = {"train_speed": SPEED, "wheel_rate": SPEED / 0.575}
    for name, value in starts.items():
        s.set(f"locomotive.{name}", value)
    s.set("locomotive.effort", EFFORT)
    for name in OBSERVERS:
        s.add(name, observer=name, options={"model": "freight_train"}, **{"as": "block3"})
        s.set(f"{name}.effort", EFFORT)
    outcome = s.balises(position="locomotive.position", speed="locomotive.speed", **LAYOUTS[layout]).run()
    assert outcome.failure is None
    events = outcome.result.events
    assert len(events) > 30
    assert all(event.outcomes[name] == "accepted" for event in events for name in OBSERVERS)
    assert set(outcome.result.summary["certificates"]) == set(OBSERVERS)
    truth = np.stack([outcome["locomotive.position"], outcome["locomotive.speed"]])
    for name in OBSERVERS:
        error = np.abs(np.stack([outcome[f"{name}.position"], outcome[f"{name}.speed"]]) - truth)
        assert error[1, 0] > 10.0  # observers start at 1 m/s
        # the locomotive's wheels creep and its inertia counts: a constant bias below 1 mm and 1 mm/s
        assert error[:, -1].max() < 1e-3, (name, error[:, -1])

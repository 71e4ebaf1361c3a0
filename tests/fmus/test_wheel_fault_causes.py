"""Faults of the wheel in C: the causes that are options draw and switch as in Python."""

from __future__ import annotations

import numpy as np
import pytest

from fmus import Batch
from plant_models import PLANTS
from plant_models.hybrid import Runtime, scalar_names

pytestmark = pytest.mark.compiler

OUTPUTS = ("wheel_speed", "wheel_distance", "active", "depth", "effort_loss")
STEP, STEPS = 0.03, 300


@pytest.mark.parametrize(
    ("cause", "changes"),
    [
        ("drawn", {"jam_rate": 2.0, "skid_rate": 1.0, "mean_length": 0.2, "jam_loss": 0.5}),
        ("adhesion", {"jam_loss": 0.5, "skid_loss": 0.3}),
        (
            "gain_and_offset",
            {"fault_onset[1]": 1.0, "fault_rise[1]": 2.0, "fault_length[1]": 3.0, "fault_gain[1]": 0.5},
        ),
    ],
)
def test_compiled_members_are_the_runtime_with_their_seeds(cause: str, changes: dict[str, float]) -> None:
    system = PLANTS["wheel_fault"](cause=cause)
    t = STEP * np.arange(STEPS + 1)
    inputs = {
        "speed": 20.0 + np.sin(t),
        "effort": 8.0 * np.sin(0.9 * t),
        "adhesion_limit": 5.0 + 0.0 * t,
        "brake_released": 1.0 * (np.sin(3.1 * t) > 0.9),
    }
    seeds = [0.0, 7.0, 2.0**40] if cause == "drawn" else [0.0]
    batch = Batch(system, len(seeds))
    for name, value in changes.items():
        batch.set(name, value)
    if cause == "drawn":
        batch.set("seed", np.array(seeds))
    batch.start()
    compiled = batch.run(t[1:], OUTPUTS, inputs)
    assert not batch.failures
    names = scalar_names(system.parameter_signals)
    places = [scalar_names(system.outputs).index(name) for name in OUTPUTS]
    for seed, rows in zip(seeds, compiled, strict=True):
        runtime = Runtime(system)
        for name, value in {**changes, **({"seed": seed} if cause == "drawn" else {})}.items():
            runtime.p[names.index(name)] = value
        runtime.u[:4] = [values[0] for values in inputs.values()]
        runtime.start(0.0)
        for k in range(STEPS):
            runtime.u[:4] = [values[k] for values in inputs.values()]
            runtime.advance(float(t[k + 1]))
            runtime.u[:4] = [values[k + 1] for values in inputs.values()]
            # the two know exp and sin of different libraries, to the last place
            np.testing.assert_allclose(runtime.update_outputs()[places], rows[k + 1], rtol=1e-12, atol=1e-12)
    if cause == "gain_and_offset":
        assert 0.0 < compiled[..., OUTPUTS.index("active")].mean() < 1.0
        return
    faults = compiled[..., OUTPUTS.index("depth")]
    assert (faults < 0.0).any()
    assert (faults > 0.0).any()
    assert cause == "adhesion" or len({tuple(row) for row in faults}) == len(seeds)

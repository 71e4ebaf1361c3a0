"""Edges of zones in exported FMUs: exact events in co-simulation and in model exchange, and refused where they make no zone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer

pytestmark = pytest.mark.compiler

STEP, STEPS = 0.01, 30
RUNNING = {"effort": 80e3, "train_speed": 10.0, "wheel_rate": 10.0 / 0.575}
UNUSED = {f"zone_{end}[{i}]": 0.0 for end in ("from", "to") for i in (2, 3)}
WATCHED = ("speed", "wheel_speed")
SHARPEST = np.array([3.0, 400.0])  # [m/s] of train and wheel by a zone moved by one second, see `test_switching`


def _zone(shift: float) -> dict[str, float]:
    return {**UNUSED, "zone_from[1]": 0.0803 + shift, "zone_to[1]": 0.2001 + shift}


def _cosimulated(made: Any, shift: float) -> np.ndarray:
    made.initialize(**RUNNING, **_zone(shift))
    rows = []
    for k in range(STEPS):
        made.step(k * STEP, STEP)
        rows.append(made.get(*WATCHED))
    return np.array(rows)


def _exchanged(model: Exchange, shift: float) -> np.ndarray:
    importer = Importer(model, model.initialize(**RUNNING, **_zone(shift)), method="Radau", rtol=1e-11, atol=1e-13)
    for k in range(STEPS):
        importer.advance((k + 1) * STEP)
        importer.record(*WATCHED)
    assert np.allclose(importer.run.state_events, [0.0803 + shift, 0.2001 + shift], rtol=0.0, atol=1e-15)
    return importer.run.values()


def test_zones_moved_a_little_change_little(component: Callable[..., Any], exchange: Callable[..., Exchange]) -> None:
    still = _cosimulated(component("locomotive", 3), 0.0), _exchanged(exchange("locomotive", 3), 0.0)
    assert np.abs(still[0] - still[1]).max() < 1e-4  # two ways of integration, one trajectory
    for shift in (1e-9, 2.3e-4):
        moved = _cosimulated(component("locomotive", 3), shift), _exchanged(exchange("locomotive", 3), shift)
        for before, after in zip(still, moved, strict=True):
            change = np.abs(after - before).max(axis=0)
            assert (change > 0.0).all()
            assert (change <= shift * SHARPEST + 1e-10).all(), (shift, change)  # the solver's own tolerance


def test_zones_without_length_are_refused_in_words(component: Callable[..., Any], version: int) -> None:
    made = component("locomotive", version)
    with pytest.raises(Exception, match="xitInitializationMode"):
        made.initialize(**_zone(0.0) | {"zone_to[1]": 0.0803})
    assert any("zone 1 has no length: zone_to[1] must lie behind zone_from[1]" in line for line in made.log)

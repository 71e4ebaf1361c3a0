"""Edges of zones in exported FMUs: exact events in co-simulation and in model exchange, and refused where they make no
zone.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer
from fmpy.fmi1 import FMICallException

from fmu_observer.block import make_block
from fmu_observer.block.block_variables import StepDiscarded
from plant_models.hybrid import HybridSystem, output_signal, parameter, state, switching, vector

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


class Chattering(HybridSystem):
    """Pushed back wherever it goes: its switch changes without end, beside a clock."""

    name = "chattering"
    states = (state("place", "m"), state("elapsed", "s"))
    outputs = (output_signal("clock", "s"),)
    parameters = (parameter("middle", "m", 0.1), parameter("left", "m", 0.0), parameter("right", "m", 0.2))
    switchings = ("side",)
    internal_step = 0.01

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x.place - p.middle)

    def requirements(self, p: Any) -> dict[str, Any]:
        between = np.where(p.middle > p.left, np.where(p.middle < p.right, 1.0, 0.0), 0.0)
        return {"middle must lie between left and right": between}

    def start_requirements(self, x: Any, p: Any) -> dict[str, Any]:
        return {"elapsed must begin with zero, whatever middle": np.where(x.elapsed == 0.0, 1.0, 0.0)}

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        push = 50.0 - 100.0 * self.switches(t, x, u, p)[0]
        return {"place": push, "elapsed": 1.0 + 0.0 * push}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"clock": x.elapsed}


def test_switches_that_chatter_do_not_stop_time(component: Callable[..., Any]) -> None:
    made = component(Chattering(), 3)
    made.initialize()
    made.step(0.0, 0.1)
    assert made.get("clock")[0] == pytest.approx(0.1, abs=1e-12)


class ChatteringBesideAnother(Chattering):
    """The switch that chatters is the second one."""

    switchings = ("never", "side")

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x.elapsed + 1.0, x.place - p.middle)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        push = 50.0 - 100.0 * self.switches(t, x, u, p)[1]
        return {"place": push, "elapsed": 1.0 + 0.0 * push}


@pytest.mark.parametrize("system", [Chattering, ChatteringBesideAnother])
def test_a_step_in_which_a_switch_chatters_without_end_is_discarded(
    system: type[HybridSystem], version: int, component: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """FMU and block give up the same steps at the same instant, name the switch, and go on with shorter steps; a bound
    of 350 divisions stands for that of 100 000, which costs the block seconds.
    """
    monkeypatch.setattr(switching, "MOST_DIVISIONS", 350)
    monkeypatch.setenv("CFLAGS", f"{os.environ['CFLAGS']} -DMOST_DIVISIONS=350")
    made, block = component(system(), version), make_block(system(), version)
    made.initialize()
    block.instantiate()
    initialise(block, version)
    t, gave_up = 0.0, 0
    for h in (0.03, 0.05, 0.02, 1e3, 0.025, 0.01, 0.05):  # a hundred divisions in each 0.01 s
        instants = []
        for step in (block.instance.step, made.step):
            try:
                step(t, h)
            except (FMICallException, StepDiscarded) as error:
                said = str(error) if isinstance(error, StepDiscarded) else made.log[-1]
                found = re.search(r"event_indicator\.side changes its sign without end at (\S+) s", said)
                assert found, said
                instants.append(float(found[1]))
        assert len(instants) in (0, 2)
        assert len(instants) == (2 if h > 0.035 else 0)
        if instants:
            gave_up += 1
            assert instants[0] == pytest.approx(instants[1], abs=1e-12)
            assert t < instants[0] < t + 0.04
        else:
            t += h
        assert made.get("clock")[0] == pytest.approx(t, abs=1e-12)
        assert block.instance.runtime.t == pytest.approx(t, abs=1e-12)
    assert gave_up == 3


def initialise(block: Any, version: int) -> None:
    """From its instantiation to its first step."""
    if version == 2:
        block.setupExperiment(startTime=0.0)
        block.enterInitializationMode()
    else:
        block.enterInitializationMode(startTime=0.0)
    block.exitInitializationMode()


def test_what_parameters_must_fulfil_together_is_refused_with_their_values(component: Callable[..., Any]) -> None:
    made = component(Chattering(), 3)
    with pytest.raises(Exception, match="xitInitializationMode"):
        made.initialize(middle=0.25)
    said = "these values: middle must lie between left and right (middle = 0.25, left = 0, right = 0.20000000000000001)"
    assert said in made.log[-1]


def test_start_values_that_are_none_are_refused_and_only_where_time_begins(component: Callable[..., Any]) -> None:
    """In the FMU and in the block; the test below restores states with other values."""
    made, block = component(Chattering(), 3), make_block(Chattering(), 3)
    with pytest.raises(Exception, match="xitInitializationMode"):
        made.initialize(elapsed=0.5)
    said = "these values: elapsed must begin with zero, whatever middle ("
    assert f"{said}middle = 0.10000000000000001, elapsed = 0.5)" in made.log[-1]
    block.instantiate()
    block.enterInitializationMode(startTime=0.0)
    block.instance.runtime.x[1] = 0.5
    with pytest.raises(FMICallException, match=re.escape(f"{said}middle = 0.1, elapsed = 0.5)")):
        block.exitInitializationMode()


def test_states_with_parameters_with_which_time_cannot_run_are_refused(component: Callable[..., Any]) -> None:
    """In the FMU and in the block: the state is that of a run, but for one parameter."""
    made, block = component(Chattering(), 3), make_block(Chattering(), 3)
    made.initialize()
    made.step(0.0, 0.1)
    saved = made.save()
    content = made.serialize(saved)
    made.free(saved)
    legal, broken = struct.pack("<3d", 0.1, 0.0, 0.2), struct.pack("<3d", 0.25, 0.0, 0.2)
    assert content.count(legal) == 1
    made.free(made.deserialize(content))
    with pytest.raises(FMICallException):
        made.deserialize(content.replace(legal, broken))
    block.instantiate()
    block.enterInitializationMode(startTime=0.0)
    block.exitInitializationMode()
    block.deserializeFMUState(block.serializeFMUState(block.getFMUState()))
    block.instance.runtime.p[0] = 0.25
    with pytest.raises(FMICallException, match="time cannot run on from this state"):
        block.deserializeFMUState(block.serializeFMUState(block.getFMUState()))


def test_zones_without_length_are_refused_in_words(component: Callable[..., Any], version: int) -> None:
    made = component("locomotive", version)
    with pytest.raises(Exception, match="xitInitializationMode"):
        made.initialize(**_zone(0.0) | {"zone_to[1]": 0.0803})
    assert any("zone 1 has no length: zone_to[1] must lie behind zone_from[1]" in line for line in made.log)

"""A system in ordinary Python, which no tracer could follow, works as a block; what it throws is a refused call."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from block_systems import Doorman, Driven, H, Swing, kick, weather
from fmpy import simulate_fmu

from fmu_observer.block import BlockCallError
from plant_models.hybrid import NumpyKernel

BOTH = pytest.mark.parametrize("version", [2, 3])


class PlainSwing(Swing):
    """The pendulum of the other tests, said to be untraceable."""

    traceable = False


@BOTH
def test_ordinary_python_runs_as_a_block(version: int) -> None:
    driven = Driven(Doorman(), version)
    assert isinstance(driven.block.instance.runtime._kernel, NumpyKernel)
    driven.start()
    driven.step(0.0, 1.0)
    driven.set(speed=5.0)  # above the limit of 2 m/s
    driven.event("stop", 1.25, {"stop_length": 30.0})
    driven.step(1.0, 0.5)
    driven.event("stop", 1.5, {"stop_length": 10.0})  # too short for the doors
    driven.step(1.5, 0.5)
    assert driven.get("travelled_out")[0] == pytest.approx(1.0 + 1.0 * 2.0, rel=1e-13)  # sums of 200 internal steps
    assert driven.get("doors_out") == [1.0]


@BOTH
def test_late_events_and_saved_states_work_without_tracing(version: int) -> None:
    late, on_time = Driven(Doorman(), version).start(), Driven(Doorman(), version).start()
    on_time.event("stop", 0.02, {"stop_length": 30.0})
    on_time.step(0.0)
    late.step(0.0)
    saved = late.block.serializeFMUState(late.block.getFMUState())
    late.event("stop", 0.02, {"stop_length": 30.0})
    for one in (on_time, late):
        one.step(H)
    np.testing.assert_array_equal(late.get("travelled", "doors"), on_time.get("travelled", "doors"))
    assert late.block.counters.replayed == 1
    late.block.setFMUState(late.block.deserializeFMUState(saved))
    late.step(H)
    assert late.get("doors") == [0.0]


def test_traced_or_not_the_block_runs_equally() -> None:
    runs = []
    for system in (Swing(), PlainSwing()):
        driven = Driven(system, 3).start()
        for k in range(20):
            driven.set_all(weather(k))
            if k in (3, 9):
                driven.event("kick", (k - 0.6) * H, kick(1.0))
            driven.step(k * H)
        runs.append(driven.everything())
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-12, atol=1e-12)  # the same operations, in another order


@BOTH
def test_every_output_depends_on_every_input_where_nobody_can_know(version: int) -> None:
    description = Driven(Doorman(), version).block.model_description
    for unknown in (*description.outputs, *description.derivatives):
        assert [v.name for v in unknown.dependencies] == ["time", "speed", "stop_length", "travelled"]


@BOTH
def test_what_the_system_throws_is_a_refused_call_with_its_cause(version: int) -> None:
    driven = Driven(Doorman(), version, instance_name="door").start()
    driven.step(0.0)
    driven.set(speed=-1.0)
    with pytest.raises(
        BlockCallError, match=r"^doStep: door at t = 0\.05 s: the model failed: RuntimeError: no reverse gear"
    ) as caught:
        driven.step(H)
    assert isinstance(caught.value.__cause__, RuntimeError)


class Awkward(Doorman):
    """Fails where it is told to."""

    name = "awkward"

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if u.speed == 13.0:
            raise ZeroDivisionError("thirteen")
        return super().output(t, x, u, p)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        if u.stop_length == 13.0:
            raise KeyError("thirteen")
        return {"doors": np.zeros(3)} if u.stop_length == 3.0 else super().jump(event, t, x, u, p)


def test_failures_of_outputs_and_jumps_are_refused_calls_too() -> None:
    driven = Driven(Awkward(), 3).start(speed=13.0)
    with pytest.raises(
        BlockCallError, match=r"^getFloat64: awkward at t = 0\.0 s: the model failed: ZeroDivisionError"
    ):
        driven.get("doors_out")
    driven.set(speed=1.0)
    assert driven.get("doors_out") == [0.0]
    with pytest.raises(BlockCallError, match=r"^updateDiscreteStates: .*the model failed: KeyError"):
        driven.event("stop", None, {"stop_length": 13.0})
    driven.block.enterStepMode()
    with pytest.raises(BlockCallError, match=r"jump\('stop'\) returns 'doors' of shape \(3,\); expected one number"):
        driven.event("stop", None, {"stop_length": 3.0})


def test_fmpy_simulates_ordinary_python() -> None:
    block = Driven(Doorman(), 3).block
    result = simulate_fmu(
        block.unzipDirectory,
        fmu_instance=block,
        model_description=block.model_description,
        fmi_type="CoSimulation",
        stop_time=1.0,
        output_interval=0.1,
        start_values={"speed": 1.5},
    )
    np.testing.assert_allclose(result["travelled_out"], 1.5 * result["time"], rtol=1e-13)  # sums of 100 internal steps

"""fmpy's own tools accept a block: `simulate_fmu`, `Recorder` and `Input`, for both versions of FMI."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Driven, H, Reference, kick
from fmpy import simulate_fmu
from fmpy.simulation import Input, Recorder

from fmu_observer import OBSERVERS
from fmu_observer.block import BlockCallError, make_block

STOP = 20 * H
OUTPUTS = ["energy", "last_sample", "net_torque"]
STATES = ["angle", "rate", "sample", "sampled_at", "marks[1]", "marks[2]"]


def _simulate(block: Any, **arguments: Any) -> Any:
    return simulate_fmu(
        block.unzipDirectory,
        fmu_instance=block,
        model_description=block.model_description,
        fmi_type="CoSimulation",
        stop_time=STOP,
        output_interval=H,
        **arguments,
    )


def _expected(
    events: dict[int, tuple[float, str, Any]] | None = None, system: Any = SWING, **starts: float
) -> np.ndarray:
    """Rows of fmpy's result: outputs and states of the runtime on the points that fmpy steps through."""
    bare = Reference(system).start(0.0, **starts)
    rows = [bare.values()]
    for k in range(20):
        here = (events or {}).get(k)
        # fmpy hands over differences of times; the last place of the end is lost in the comparison
        t, end = k * H, (k + 1) * H
        bare.step(t, end - t, [here] if here else [])
        rows.append(bare.values())
    return np.array(rows)


def _columns(result: Any) -> np.ndarray:
    return np.array([[row[name] for name in OUTPUTS + STATES] for row in result])


ROUNDING = 1e-12  # the times of the rows may differ in the last place


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("instantiated", [False, True])
def test_simulate_fmu_gives_the_run_of_the_runtime(version: int, instantiated: bool) -> None:
    block = make_block(SWING, version)  # type: ignore[arg-type]
    if instantiated:
        block.instantiate()
    starts = {"angle": 0.7, "stiffness[1]": 2.0, "torque": 0.1, "damping": 0.3, "seed": 5.0}
    result = _simulate(block, output=OUTPUTS + STATES, start_values=starts)
    np.testing.assert_allclose(result["time"], np.arange(21) * H, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(_columns(result), _expected(**starts), rtol=ROUNDING, atol=ROUNDING)
    assert block.mode == "terminated"


@pytest.mark.parametrize("instantiated", [False, True])
def test_simulate_fmu_may_use_event_mode(instantiated: bool) -> None:
    block = make_block(SWING, 3)
    if instantiated:
        block.instantiate(eventModeUsed=True)
    result = _simulate(block, output=OUTPUTS + STATES, use_event_mode=True)
    np.testing.assert_allclose(_columns(result), _expected(), rtol=ROUNDING, atol=ROUNDING)


def test_event_mode_of_simulate_fmu_with_inputs_that_jump() -> None:
    signals = np.array(
        [(0.0, 0.5), (0.25, 0.5), (0.25, -1.0), (STOP, -1.0)], dtype=[("time", np.float64), ("torque", np.float64)]
    )
    results = []
    for use_event_mode in (False, True):
        block = make_block(SWING, 3)
        block.instantiate(eventModeUsed=use_event_mode)
        results.append(_simulate(block, input=signals, output=STATES, use_event_mode=use_event_mode))
    last = [np.array([result[name][-1] for name in STATES]) for result in results]
    np.testing.assert_allclose(last[0], last[1], rtol=ROUNDING, atol=ROUNDING)
    bare = Reference(SWING).start()
    for k in range(20):
        bare.set_all({"torque": 0.5 if k < 5 else -1.0})
        bare.step(k * H)
    np.testing.assert_allclose(last[0], bare.values()[3:], rtol=ROUNDING, atol=ROUNDING)


def test_event_mode_on_a_block_instantiated_without_it_is_refused_in_words() -> None:
    block = make_block(SWING, 3)
    block.instantiate(eventModeUsed=False)
    with pytest.raises(
        BlockCallError, match=r"updateDiscreteStates: swing at t = .*not allowed in mode 'step', expected event"
    ):
        _simulate(block, use_event_mode=True)


def test_simulate_fmu_carries_events_through_fmi2_inputs() -> None:
    """fmpy sets its columns at its own communication points; the stamp says where inside the step the event belongs."""
    # the last one is late
    reported = {3: (3 * H + 0.011, kick(2.0)), 9: (9 * H + 0.03, kick(-1.0)), 10: (9 * H + 0.04, kick(0.5))}
    names = ["kick_count", "kick_time", "kick_impulse", "kick_share[1]", "kick_share[2]"]
    rows, values = [], dict.fromkeys(names, 0.0)
    for k in range(21):
        if k in reported:
            stamp, payload = reported[k]
            values |= payload | {"kick_time": stamp, "kick_count": values["kick_count"] + 1}
        rows.append((k * H, *(values[name] for name in names)))
    types = [("time", np.float64), (names[0], np.int32), *((name, np.float64) for name in names[1:])]
    block = make_block(SWING, 2)
    result = _simulate(block, input=np.array(rows, dtype=types), output=STATES)
    assert (block.counters.accepted, block.counters.replayed, block.counters.lost) == (3, 1, 0)
    bare = Reference(SWING).start()
    for k in range(20):
        events = [(reported[i][0], "kick", reported[i][1]) for i in reported if int(reported[i][0] / H) == k]
        bare.step(k * H, H, events)
    last = np.array([result[name][-1] for name in STATES])
    np.testing.assert_allclose(last, bare.values()[3:], rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("version", [2, 3])
def test_recorder_and_input_work_on_a_block(version: int) -> None:
    driven = Driven(SWING, version)
    signals = np.array([(0.0, 1.0), (1.0, 3.0)], dtype=[("time", np.float64), ("torque", np.float64)])
    inputs = Input(fmu=driven.block, modelDescription=driven.block.model_description, signals=signals)
    recorder = Recorder(driven.block, driven.block.model_description, variableNames=["angle", "energy"], interval=H)
    driven.start()
    for k in range(4):
        inputs.apply(k * H)
        assert driven.get("torque")[0] == pytest.approx(1.0 + 2.0 * k * H, rel=1e-14)  # interpolated
        recorder.sample(k * H)
        driven.step(k * H)
    result = recorder.result()
    assert result.dtype.names == ("time", "energy", "angle")
    assert result["angle"][0] == 0.3
    assert len(set(result["energy"])) == 4


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("as_bytes", [False, True])
def test_simulate_fmu_goes_on_from_a_saved_state(version: int, as_bytes: bool) -> None:
    driven = Driven(SWING, version).start()
    for k in range(10):
        driven.step(k * H)
    state = driven.block.getFMUState()
    other = make_block(SWING, version)  # type: ignore[arg-type]
    result = _simulate(
        other,
        start_time=10 * H,
        fmu_state=other.serializeFMUState(state) if as_bytes else state,
        output=OUTPUTS + STATES,
    )
    np.testing.assert_allclose(_columns(result), _expected()[10:], rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("version", [2, 3])
def test_a_terminated_block_says_how_to_begin_again(version: int) -> None:
    block = make_block(SWING, version)  # type: ignore[arg-type]
    first = _simulate(block, output=STATES)
    with pytest.raises(BlockCallError, match=r"'terminated', expected instantiated; begin anew with reset\(\)"):
        _simulate(block)
    block.reset()
    np.testing.assert_array_equal(_simulate(block, output=STATES), first)


@pytest.mark.parametrize("name", sorted(OBSERVERS))
@pytest.mark.parametrize("version", [2, 3])
def test_shipped_observers_run_in_simulate_fmu(name: str, version: int) -> None:
    system = OBSERVERS[name]()
    block = make_block(system, version)  # type: ignore[arg-type]
    result = _simulate(block, start_values={"odometer": 14.0} if "odometer" in {i.name for i in system.inputs} else {})
    assert len(result) == 21
    assert all(np.isfinite(result[column]).all() for column in result.dtype.names)


def test_start_values_in_display_units_are_converted_by_fmpy() -> None:
    block = make_block(SWING, 3)
    _simulate(block, start_values={"torque": (0.002, "kN.m")}, output=STATES)
    torque = next(v.valueReference for v in block.model_description.modelVariables if v.name == "torque")
    assert block.getFloat64([torque]) == [2.0]

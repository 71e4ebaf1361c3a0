"""Saved states: what follows a restore is bit for bit what followed the save, in every mode, here or in another
process.
"""

from __future__ import annotations

import base64
import json
import math
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Driven, H, Swing, kick, weather
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_observer import OBSERVERS
from fmu_observer.block import BlockCallError
from plant_models.hybrid import scalar_names

Crossing = Callable[[Driven, Any], Driven]


def _through_value(driven: Driven, state: Any) -> Driven:
    """Restored into the same block, which has gone on in the meantime."""
    driven.block.setFMUState(state)
    return driven


def _through_bytes(driven: Driven, state: Any) -> Driven:
    """Restored into another block, which has lived another life."""
    other = Driven(driven.block.system, driven.version).start(3.0)
    other.step(3.0)
    other.block.setFMUState(other.block.deserializeFMUState(driven.block.serializeFMUState(state)))
    return other


CROSSINGS = [pytest.param(_through_value, id="value"), pytest.param(_through_bytes, id="bytes")]


def _walk(driven: Driven, first: int, count: int, kicked: int | None = None) -> list[np.ndarray]:
    rows = [driven.everything()]
    for k in range(first, first + count):
        driven.set_all(weather(k))
        if k == kicked:
            driven.event("kick", (k - 3.3) * H, kick(1.5))
        driven.step(k * H)
        rows.append(driven.everything())
    rows.append(np.array(list(vars(driven.block.counters).values()), dtype=float))
    return rows


def _to_instantiated(driven: Driven) -> None:
    driven.instantiate()
    driven.set(angle=0.9, period=0.04)
    if driven.version == 2:
        driven.block.setupExperiment(startTime=2.0)  # FMI 2: part of the state


def _from_instantiated(driven: Driven) -> list[np.ndarray]:
    if driven.version == 2:
        driven.block.enterInitializationMode()
    else:
        driven.enter_initialization(2.0)
    return _from_initialization(driven)


def _to_initialization(driven: Driven) -> None:
    driven.instantiate()
    driven.set(angle=0.9)
    driven.enter_initialization(2.0)
    driven.set(damping=0.4)


def _from_initialization(driven: Driven) -> list[np.ndarray]:
    rows = [driven.everything()]
    driven.set(rate=0.2)
    driven.exit_initialization()
    return [*rows, *_walk(driven, 40, 5)]


def _to_step(driven: Driven) -> None:
    """With one event waiting for its stamp, one replayed, and, in FMI 2, one announced but not yet seen."""
    driven.start()
    driven.event("mark", 14.5 * H)
    _walk(driven, 0, 8, kicked=6)
    if driven.version == 2:
        driven.event("kick", 7.5 * H, kick(0.7))


def _from_step(driven: Driven) -> list[np.ndarray]:
    return _walk(driven, 8, 10, kicked=12)


def _to_event(driven: Driven) -> None:
    """With a clock active, payload and stamp set, and nothing updated yet."""
    driven.start()
    _walk(driven, 0, 8)
    driven.block.enterEventMode()
    driven.block.setClock(driven.vr("kick"), [True])
    driven.set_all(kick(1.2) | {"kick_time": 5.2 * H})


def _from_event(driven: Driven) -> list[np.ndarray]:
    assert driven.block.getClock(driven.vr("kick", "mark")) == [True, False]
    driven.block.updateDiscreteStates()
    driven.block.enterStepMode()
    return _walk(driven, 8, 6)


def _to_terminated(driven: Driven) -> None:
    driven.start()
    _walk(driven, 0, 3)
    driven.block.terminate()


def _from_terminated(driven: Driven) -> list[np.ndarray]:
    assert driven.block.mode == "terminated"
    with pytest.raises(BlockCallError):
        driven.step(3 * H)
    return [driven.everything()]


MODES = [
    pytest.param(2, _to_instantiated, _from_instantiated, id="2-instantiated"),
    pytest.param(3, _to_instantiated, _from_instantiated, id="3-instantiated"),
    pytest.param(2, _to_initialization, _from_initialization, id="2-initialization"),
    pytest.param(3, _to_initialization, _from_initialization, id="3-initialization"),
    pytest.param(2, _to_step, _from_step, id="2-step"),
    pytest.param(3, _to_step, _from_step, id="3-step"),
    pytest.param(3, _to_event, _from_event, id="3-event"),
    pytest.param(2, _to_terminated, _from_terminated, id="2-terminated"),
    pytest.param(3, _to_terminated, _from_terminated, id="3-terminated"),
]


@pytest.mark.parametrize("crossing", CROSSINGS)
@pytest.mark.parametrize(("version", "to_mode", "go_on"), MODES)
def test_in_every_mode_what_follows_a_restore_is_what_followed_the_save(
    version: int, to_mode: Callable[[Driven], None], go_on: Callable[[Driven], list[np.ndarray]], crossing: Crossing
) -> None:
    driven = Driven(SWING, version)
    to_mode(driven)
    saved = driven.block.getFMUState()
    first = go_on(driven)
    restored = crossing(driven, saved)
    for found, expected in zip(go_on(restored), first, strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("crossing", CROSSINGS)
@pytest.mark.parametrize(
    "name", ["differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio", "slip_indicator"]
)
def test_shipped_observers_go_on_from_a_saved_state(name: str, crossing: Crossing) -> None:
    driven = Driven(OBSERVERS[name](), 3).start(odometer=12.0)
    telling = "balise" in driven.references

    def go_on(one: Driven) -> list[np.ndarray]:
        rows = []
        for k in range(7, 15):
            one.set(odometer=12.0 + np.sin(k))
            if telling and k in (8, 12):
                one.event("balise", (k - 2.5) * H, {"balise_position": 12.0 * k * H})
            one.step(k * H)
            rows.append(one.everything())
        return rows

    for k in range(7):
        driven.step(k * H)
    saved = driven.block.getFMUState()
    first = go_on(driven)
    np.testing.assert_array_equal(go_on(crossing(driven, saved)), first)
    assert np.ptp(first, axis=0).max() > 0.1


ONE, OTHER = Driven(SWING, 3), Driven(SWING, 3)


@settings(max_examples=60, deadline=None)
@given(
    steps=st.lists(st.floats(1e-3, 0.3), min_size=1, max_size=6),
    kicked=st.lists(st.tuples(st.integers(0, 5), st.floats(0.0, 1.0), st.floats(-2.0, 2.0)), max_size=4),
    saved_after=st.integers(0, 5),
)
def test_any_run_goes_on_from_any_of_its_points(
    steps: list[float], kicked: list[tuple[int, float, float]], saved_after: int
) -> None:
    def walk(driven: Driven, first: int, t: float) -> None:
        for k in range(first, len(steps)):
            for at, stamp, impulse in kicked:
                if at == k:
                    driven.event("kick", stamp, kick(impulse))
            driven.step(t, steps[k])
            t += steps[k]
            if k == saved_after:
                points.append((k + 1, t, driven.block.serializeFMUState(driven.block.getFMUState())))

    points: list[tuple[int, float, bytes]] = []
    walk(ONE.start(), 0, 0.0)
    for first, t, content in points[:1]:
        OTHER.block.setFMUState(OTHER.block.deserializeFMUState(content))
        walk(OTHER, first, t)
        np.testing.assert_array_equal(OTHER.everything(), ONE.everything())
        assert OTHER.block.counters == ONE.block.counters


def test_a_state_is_a_value_that_may_be_restored_often() -> None:
    driven = Driven(SWING, 3)
    _to_step(driven)
    saved = driven.block.getFMUState()
    runs = []
    for _ in range(3):
        driven.block.setFMUState(saved)
        runs.append(_from_step(driven))
    for run in runs[1:]:
        for found, expected in zip(run, runs[0], strict=True):
            np.testing.assert_array_equal(found, expected)


def test_a_saved_past_is_not_touched_by_a_replay_after_it() -> None:
    driven = Driven(SWING, 3).start()
    _walk(driven, 0, 8)
    saved = driven.block.getFMUState()
    before = driven.block.serializeFMUState(saved)
    driven.event("kick", 2.5 * H, kick(1.0))
    _walk(driven, 8, 4)
    assert driven.block.serializeFMUState(saved) == before


def test_the_spelling_of_fmi2_has_an_equal_effect() -> None:
    driven = Driven(SWING, 2)
    _to_step(driven)
    block = driven.block
    saved = block.getFMUstate()
    content = block.serializeFMUstate(saved)
    assert content == block.serializeFMUState(saved)
    first = _from_step(driven)
    block.setFMUstate(block.deSerializeFMUstate(content))
    block.freeFMUstate(saved)
    for found, expected in zip(_from_step(driven), first, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_serialised_again_the_bytes_are_equal() -> None:
    driven = Driven(SWING, 3)
    _to_event(driven)
    block = driven.block
    content = block.serializeFMUState(block.getFMUState())
    assert block.serializeFMUState(block.deserializeFMUState(content)) == content


def test_not_a_number_and_infinity_survive_the_bytes() -> None:
    driven = Driven(SWING, 3).start(torque=float("inf"))
    driven.set(**{"wind[1]": float("nan")})
    driven.event("mark", 100.0)
    restored = _through_bytes(driven, driven.block.getFMUState())
    np.testing.assert_array_equal(restored.get("torque", "wind[1]"), [np.inf, np.nan])


CONTINUED = """
import json, sys
from block_systems import SWING, Driven
from test_block_states import _from_step
driven = Driven(SWING, 3)
driven.block.setFMUState(driven.block.deserializeFMUState(sys.stdin.buffer.read()))
print(json.dumps([[value.hex() for value in row.tolist()] for row in _from_step(driven)]))
"""


def test_another_process_goes_on_from_the_bytes() -> None:
    driven = Driven(SWING, 3)
    _to_step(driven)
    content = driven.block.serializeFMUState(driven.block.getFMUState())
    run = subprocess.run(
        [sys.executable, "-c", CONTINUED],
        input=content,
        capture_output=True,
        check=True,
        cwd=Path(__file__).parent,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    found = [[float.fromhex(value) for value in row] for row in json.loads(run.stdout)]
    for row, expected in zip(found, _from_step(driven), strict=True):
        np.testing.assert_array_equal(row, expected)


def _doubles(text: str, place: int, value: float) -> str:
    numbers = np.frombuffer(base64.b64decode(text), dtype="<f8").copy()
    numbers[place] = value
    return base64.b64encode(numbers.tobytes()).decode()


def _garbage(content: bytes) -> dict[str, bytes]:
    data = json.loads(content)

    def changed(**entries: Any) -> bytes:
        return json.dumps(data | entries).encode()

    return {
        "nothing": b"",
        "noise": bytes(range(256)),
        "another format": pickle.dumps([1, 2]),
        "a list": b"[1, 2, 3]",
        "a number": b"7",
        "deep nesting": b"[" * 100_000,
        "cut off": content[:-20],
        "a key missing": json.dumps({k: v for k, v in data.items() if k != "queue"}).encode(),
        "unknown mode": changed(mode="flying"),
        "unknown policy": changed(late_policy=4),
        "unknown clock": changed(active=[7]),
        "negative clock": changed(active=[-1]),
        "too little memory": changed(memory=data["memory"][:-16]),
        "no base64": changed(memory="%%%"),
        "text for ticks": changed(ticks=["a"]),
        "too many ticks": changed(ticks=[1, 2, 3]),
        "unknown event waiting": changed(queue=[["explosion", data["queue"][0][1]]]),
        "payload of wrong size": changed(queue=[["mark", data["queue"][0][1] + data["queue"][0][1]]]),
        "counts missing": changed(counts=[]),
        "unknown counter": changed(counters={"accepted": 1, "eaten": 2}),
        "past without events": changed(past={k: v for k, v in data["past"].items() if k != "events"}),
        "time that is no number": changed(times=_doubles(data["times"], 0, math.nan)),
        "start that is not finite": changed(times=_doubles(data["times"], 1, math.inf)),
        "negative tick": changed(ticks=[-1]),
        "tick that is not exact": changed(ticks=[2**53]),
        "stamp waiting for ever": changed(queue=[["mark", _doubles(data["queue"][0][1], 0, math.inf)[:12]]]),
        "past in no order": changed(past=data["past"] | {"times": _doubles(data["past"]["times"], 0, 1e300)}),
        "past of wrong size": changed(past=data["past"] | {"ticks": data["past"]["ticks"][1:]}),
    }


def _waiting() -> Driven:
    driven = Driven(SWING, 3)
    _to_step(driven)
    return driven


@pytest.mark.parametrize("kind", list(_garbage(_waiting().block.serializeFMUState(_waiting().block.getFMUState()))))
def test_garbage_is_refused_with_a_reason_and_changes_nothing(kind: str) -> None:
    driven = _waiting()
    content = driven.block.serializeFMUState(driven.block.getFMUState())
    with pytest.raises(
        BlockCallError, match=r"^deserializeFMUState: swing at t = .* s: these bytes are not the serialised state"
    ):
        driven.block.deserializeFMUState(_garbage(content)[kind])
    assert driven.block.serializeFMUState(driven.block.getFMUState()) == content


def test_the_state_of_another_model_preset_or_version_is_refused() -> None:
    class Other(Swing):
        name = "other"

    driven = Driven(SWING, 3).start()
    for stranger in (Driven(Other(), 3), Driven(SWING, 3, preset="soft"), Driven(SWING, 2)):
        state = stranger.start().block.getFMUState()
        with pytest.raises(BlockCallError, match="belongs to another model"):
            driven.block.setFMUState(state)
        with pytest.raises(BlockCallError, match="belongs to another model"):
            driven.block.deserializeFMUState(stranger.block.serializeFMUState(state))
    with pytest.raises(BlockCallError, match="bytes is not a saved state"):
        driven.block.setFMUState(b"")


@pytest.mark.parametrize("version", [2, 3])
def test_a_state_brings_its_policy_and_its_horizon_with_it(version: int) -> None:
    """They are parameters: a block that is started with others goes on by those of the state."""
    source, taker = Driven(SWING, version), Driven(SWING, version)
    _to_step(source)
    taker.instantiate()
    setter = taker.block.setInteger if version == 2 else taker.block.setInt64
    setter(taker.vr("late_policy"), [2])
    taker.set(replay_horizon=0.0)
    taker.enter_initialization()
    taker.exit_initialization()
    taker.block.setFMUState(source.block.getFMUState())
    getter = taker.block.getInteger if version == 2 else taker.block.getInt64
    assert (getter(taker.vr("late_policy")), taker.get("replay_horizon").tolist()) == ([1], [10.0])
    taker.event("mark", 5.0 * H)
    taker.step(8 * H)
    # FMI 2: one was announced
    assert taker.block.counters.replayed == source.block.counters.replayed + {2: 2, 3: 1}[version]


@pytest.mark.parametrize("version", [2, 3])
def test_after_a_reset_an_equal_run_comes_out(version: int) -> None:
    driven = Driven(SWING, version)
    _to_step(driven)
    first = _from_step(driven)
    driven.block.reset()
    assert driven.block.mode == "instantiated"
    np.testing.assert_array_equal(driven.everything(), Driven(SWING, version).everything())
    driven.enter_initialization()
    driven.exit_initialization()
    driven.event("mark", 14.5 * H)
    _walk(driven, 0, 8, kicked=6)
    if version == 2:
        driven.event("kick", 7.5 * H, kick(0.7))
    for found, expected in zip(_from_step(driven), first, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_reset_and_instantiate_return_to_the_preset_and_forget_active_clocks() -> None:
    driven = Driven(SWING, 3, preset="soft")
    for again in (driven.block.reset, driven.instantiate):
        _to_event(driven)
        again()
        assert driven.get("angle", "stiffness[1]", "seed", "time").tolist() == [1.5, 0.5, 7.0, 0.0]
        assert driven.block.getClock(driven.vr("kick")) == [False]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("internal_step", 0.0),
        ("internal_step", 1e300),
        ("period", -1.0),
        ("offset", -1e300),
        ("seed", -1.0),
        ("seed", 0.5),
    ],
)
def test_a_state_with_which_time_cannot_run_is_refused(name: str, value: float) -> None:
    driven = _waiting()
    content = driven.block.serializeFMUState(driven.block.getFMUState())
    data = json.loads(content)
    parameters = list(scalar_names(SWING.parameter_signals))
    data["memory"] = _doubles(data["memory"], parameters.index(name) - len(parameters), value)
    with pytest.raises(BlockCallError, match="time cannot run on from this state"):
        driven.block.deserializeFMUState(json.dumps(data).encode())
    data = json.loads(content)
    data["times"] = _doubles(data["times"], 2, -1.0)
    with pytest.raises(BlockCallError, match="horizon"):
        driven.block.deserializeFMUState(json.dumps(data).encode())

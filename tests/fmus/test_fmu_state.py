"""Saved, restored, serialised and reset instances continue exactly as the original did."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

pytestmark = pytest.mark.compiler

H = 0.013


def test_restored_instance_repeats_itself(
    system_name: str, version: int, component: Callable[..., Any], drive: Callable[..., np.ndarray]
) -> None:
    made = component(system_name, version)
    made.initialize()
    drive(made, H, 10)
    saved = made.save()
    at_save = made.values()
    first = drive(made, H, 20, 10)
    made.restore(saved)
    np.testing.assert_array_equal(made.values(), at_save)
    np.testing.assert_array_equal(drive(made, H, 20, 10), first)
    made.free(saved)


def test_state_moves_to_another_instance_as_bytes(
    system_name: str, version: int, component: Callable[..., Any], drive: Callable[..., np.ndarray]
) -> None:
    made, other = component(system_name, version), component(system_name, version)
    made.initialize()
    other.initialize(5.0)
    drive(made, H, 10)
    saved = made.save()
    content = made.serialize(saved)
    restored = other.deserialize(content)
    assert other.serialize(restored) == content
    other.restore(restored)
    np.testing.assert_array_equal(drive(other, H, 20, 10), drive(made, H, 20, 10))
    made.free(saved)
    other.free(restored)


def test_state_holds_parameters_and_pending_events(version: int, component: Callable[..., Any]) -> None:
    made, other = component("tracker", version), component("tracker", version)
    made.initialize(gain=0.25, period=0.02)
    other.initialize()
    made.event("balise", stamp=0.55, balise_position=100.0)  # lies ahead and waits
    made.step(0.0, 0.1)
    saved = made.save()
    other.restore(other.deserialize(made.serialize(saved)))
    for k in range(1, 10):
        made.step(0.1 * k, 0.1)
        other.step(0.1 * k, 0.1)
        np.testing.assert_array_equal(other.values(), made.values())
    assert made.get("innovation") != 0.0
    assert other.get("gain") == 0.25


def test_reset_begins_anew(
    system_name: str, version: int, component: Callable[..., Any], drive: Callable[..., np.ndarray]
) -> None:
    made = component(system_name, version)
    made.initialize()
    first = drive(made, H, 20)
    made.slave.reset()
    made.initialize()
    np.testing.assert_array_equal(drive(made, H, 20), first)


def test_reset_forgets_what_was_set(version: int, component: Callable[..., Any]) -> None:
    made = component("oscillator", version)
    made.initialize(stiffness=7.0, position=9.0)
    made.slave.reset()
    np.testing.assert_array_equal(made.get("stiffness", "position", "time"), [40.0, 1.0, 0.0])


def test_terminated_instance_returns_to_life_with_its_state(version: int, component: Callable[..., Any]) -> None:
    made = component("oscillator", version)
    made.initialize()
    saved = made.save()
    made.step(0.0, 0.1)
    expected = made.values()
    made.slave.terminate()
    np.testing.assert_array_equal(made.values(), expected)  # still readable
    made.restore(saved)
    made.step(0.0, 0.1)
    np.testing.assert_array_equal(made.values(), expected)


def test_state_of_another_model_is_refused(version: int, component: Callable[..., Any]) -> None:
    made, stranger = component("oscillator", version), component("slider", version)
    made.initialize()
    stranger.initialize()
    content = stranger.serialize(stranger.save())
    with pytest.raises(FMICallException):
        made.deserialize(content)
    with pytest.raises(FMICallException):
        made.restore(stranger.save())
    assert any("not a state of this model" in line for line in made.log)


def test_damaged_bytes_are_refused(version: int, component: Callable[..., Any]) -> None:
    made = component("tracker", version)
    made.initialize()
    content = made.serialize(made.save())
    mode = 16  # after the digest and the size, eight bytes each
    for damaged in (
        content[:-8],
        content + b"12345678",
        content[:mode] + b"\xff" * 8 + content[mode + 8 :],
        b"\0" * len(content),
    ):
        with pytest.raises(FMICallException):
            made.deserialize(damaged)
    queue_length = np.frombuffer(content).size - 1 - 64 * 4  # 64 entries of event, stamp and two numbers of payload
    numbers = np.frombuffer(content).copy()
    numbers[queue_length] = 1e6
    with pytest.raises(FMICallException):
        made.deserialize(numbers.tobytes())

"""Saved states that are damaged or belong elsewhere are refused: what decides how time runs, counts, modes of the other
type.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

pytestmark = pytest.mark.compiler

H = 0.013
MODE, START, T, T0, STEP = 2, 3, 4, 5, 6  # words of the head; the range of the past, then the memory
MEMORY = 9
STEP_MODE, EVENT_MODE, CONTINUOUS = 8, 4, 32
NO_TIME = (nan, inf, -inf)
NOT_POSITIVE = (*NO_TIME, 0.0, -0.01)
NO_TICK = (*NO_TIME, -1.0, 0.5, 2.0**53)
NO_COUNT = (*NO_TIME, 0.5, 2.0**31)


def tracker_words() -> dict[int, tuple[float, ...]]:
    """Words of a tracker's state without a past, and what must not stand there: memory is x, u, p, then what is named
    here.
    """
    x, u, p = 3, 4, 3  # gain, period, internal_step
    periods = MEMORY + x + u + p
    offsets, ticks, resolved, active = periods + 1, periods + 2, periods + 3, periods + 4
    raised, seen, policy = active + 2, active + 4, active + 8
    horizon, outcomes, queue_length, queue = policy + 1, policy + 2, policy + 9, policy + 10
    return {
        T: NO_TIME,
        T0: NO_TIME,
        START: NO_TIME,
        STEP: (*NOT_POSITIVE, 1e300),
        periods: NOT_POSITIVE,
        offsets: (*NO_TIME, -1e300),
        ticks: NO_TICK,
        resolved: (nan, 0.5, 2.0, -1.0),
        active: (nan, 0.5, -1.0),
        raised: NO_COUNT,
        seen + 1: NO_COUNT,
        policy: (*NO_TIME, 0.0, 4.0, 1.5),
        horizon: (*NO_TIME, -1.0),
        outcomes: NO_TICK,
        outcomes + 6: NO_TICK,
        queue_length: (*NO_TIME, -1.0, 0.5, 65.0),
        queue: (nan, -1.0, 2.0, 0.5),
        queue + 1: NO_TIME,
    }


def damaged(content: bytes, place: int, value: float) -> bytes:
    """The state with another number in one place."""
    return content[: 8 * place] + struct.pack("<d", value) + content[8 * place + 8 :]


def with_mode(content: bytes, mode: int) -> bytes:
    """The state as if it had been saved in this mode."""
    return content[: 8 * MODE] + struct.pack("<q", mode) + content[8 * MODE + 8 :]


def _waiting_tracker(component: Callable[..., Any], version: int) -> Any:
    """One with an event in its queue and no past."""
    made = component("tracker", version)
    made.set_policy(2)  # reject: nothing is remembered
    made.initialize()
    made.event("balise", stamp=50.0, balise_position=1.0)
    made.step(0.0, H)
    return made


@pytest.mark.parametrize(("place", "values"), tracker_words().items())
def test_numbers_with_which_time_cannot_run_are_refused(
    version: int, place: int, values: tuple[float, ...], component: Callable[..., Any]
) -> None:
    made = _waiting_tracker(component, version)
    content = made.serialize(made.save())
    before = made.values()
    for value in values:
        with pytest.raises(FMICallException):
            made.deserialize(damaged(content, place, value))
    np.testing.assert_array_equal(made.values(), before)
    made.free(made.deserialize(content))  # unharmed it is accepted


@pytest.mark.parametrize(("place", "values"), [(p, v) for p, v in tracker_words().items() if p < MEMORY + 20])
def test_model_exchange_refuses_them_too(
    version: int, place: int, values: tuple[float, ...], exchange: Callable[..., Any]
) -> None:
    one = exchange("tracker", version)
    one.initialize()
    content = one.save()
    for value in values:
        with pytest.raises(FMICallException):
            one.restore(damaged(content, place, value))
    one.restore(content)


def test_damaged_seed_is_refused(version: int, component: Callable[..., Any]) -> None:
    made = component("sampler", version)
    made.initialize(seed=1234567.0)
    content = made.serialize(made.save())
    (place,) = np.flatnonzero(np.frombuffer(content) == 1234567.0)
    for value in (*NO_TIME, -1.0, 2.0**53):
        with pytest.raises(FMICallException):
            made.deserialize(damaged(content, int(place), value))


def test_damaged_instants_of_the_past_are_refused(version: int, component: Callable[..., Any]) -> None:
    """A replay through them would take for ever."""
    made = component("tracker", version)
    made.initialize()
    steps = 40
    for k in range(steps):
        made.step(k * H, H)
    content = made.serialize(made.save())
    numbers = np.frombuffer(content)
    (first, *_), last = np.flatnonzero(numbers == -1.0), np.flatnonzero(numbers == -1.0)[-1]  # kind: an advance
    for kind in (first, last):
        for place in (kind - 2, kind - 1):
            for value in (*NO_TIME, -1e300 if place == kind - 1 else 1e300, 1e300):
                with pytest.raises(FMICallException):
                    made.deserialize(damaged(content, int(place), value))
    ticks_of_snapshot = int(first) - 3  # before the first record: x (and no noise), then one tick
    for value in NO_TICK:
        with pytest.raises(FMICallException):
            made.deserialize(damaged(content, ticks_of_snapshot, value))


def test_before_time_runs_anything_may_be_set(version: int, component: Callable[..., Any]) -> None:
    """A state saved then is a legal one, whatever will be refused when time begins."""
    made = component("tracker", version)
    made.set(replay_horizon=nan, period=-1.0)
    saved = made.deserialize(made.serialize(made.save()))
    made.restore(saved)
    made.free(saved)
    made.initialize(replay_horizon=1.0, period=0.05)
    made.step(0.0, H)


# -- modes
# --------------------------------------------------------------------------------------------------------------


def test_model_exchange_refuses_step_mode(version: int, exchange: Callable[..., Any]) -> None:
    """It has no memory by which a step could be undone."""
    one = exchange("tracker", version)
    one.initialize()
    content = one.save()
    with pytest.raises(FMICallException):
        one.restore(with_mode(content, STEP_MODE))
    assert "Step Mode, in which this instance for model exchange cannot be" in one.log[-1]
    one.restore(with_mode(content, EVENT_MODE))


@pytest.mark.parametrize(
    ("system", "mode", "message"),
    [
        ("tracker", CONTINUOUS, "Continuous-Time Mode, in which this instance for co-simulation"),
        ("oscillator", EVENT_MODE, "co-simulation without event mode"),
    ],
)
def test_co_simulation_refuses_modes_it_has_not(
    system: str, mode: int, message: str, version: int, component: Callable[..., Any]
) -> None:
    made = component(system, version)
    made.initialize()
    saved = made.deserialize(with_mode(made.serialize(made.save()), mode))
    with pytest.raises(FMICallException):
        made.restore(saved)
    made.free(saved)
    assert message in made.log[-1]
    made.step(0.0, H)


# -- the importer's table of functions
# ------------------------------------------------------------------------------------


def test_table_of_callbacks_may_be_gone_after_instantiation(component: Callable[..., Any]) -> None:
    """FMI 2: an importer may have it on its stack."""
    made = component("oscillator", 2)
    table = made._callbacks
    kept = table.logger  # the function itself must live on
    struct.pack_into("<5Q", table, 0, 8, 8, 8, 8, 8)  # a call through one of these is the end of the process
    made.initialize()
    with pytest.raises(FMICallException):
        made.step(7.0, H)
    assert "the model stands at 0 s" in made.log[-1]
    assert kept is not None

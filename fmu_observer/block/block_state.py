"""Saved states: everything that decides the future of a block, as a value and as bytes.

The bytes are JSON; arrays of floats stand in it as base64 of little-endian doubles, so that every bit comes back, on
any machine. Bytes from outside are checked before anything is built from them.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import chain, pairwise
from math import isfinite
from typing import Any, get_args

import numpy as np

from fmu_observer.block.block_journal import Record, Stamped
from fmu_observer.block.block_variables import BlockError, Mode
from fmu_observer.block.policy import Counters
from fmu_observer.event_protocol import LATE_POLICIES
from plant_models.hybrid import Snapshot

DOUBLE = np.dtype("<f8")
TICKS = range(2**53)  # whole numbers that are exact as floats


@dataclass(frozen=True)
class BlockState:
    """A saved block; a value, never changed after it is taken.

    Args:
        token: instantiation token of the model it belongs to.
        mode: mode of the life cycle. active: numbers of the active clocks (FMI 3).
        runtime: state, inputs, parameters and time.
        protocol: number of the late policy, and the horizon [s]. records: the recent past, for replay.
        queue: events announced for later. stamps, counts, seen: the event variables.
        counters: what became of the events so far.
    """

    token: str
    mode: Mode
    active: tuple[int, ...]
    runtime: Snapshot
    protocol: tuple[int, float]
    records: tuple[Record, ...]
    queue: tuple[Stamped, ...]
    stamps: tuple[float, ...]
    counts: tuple[int, ...]
    seen: tuple[int, ...]
    counters: Counters


@dataclass(frozen=True)
class Shape:
    """What the states of one model look like.

    Args:
        token: its instantiation token.
        memory: number of floats of state, inputs and parameters. ticks: number of periodic events.
        payloads: positions of the payload in the inputs, for each triggered event, by name.
    """

    token: str
    memory: int
    ticks: int
    payloads: dict[str, tuple[int, ...]]


def serialize(state: BlockState) -> bytes:
    """A saved state as bytes."""
    runtime = state.runtime
    past_events = {i: _event_data(record.event) for i, record in enumerate(state.records) if record.event is not None}
    data = {
        "token": state.token,
        "mode": state.mode,
        "active": state.active,
        "memory": _encode(runtime.memory),
        "times": _encode([runtime.t, runtime.t0, state.protocol[1], *state.stamps]),
        "late_policy": state.protocol[0],
        "ticks": runtime.ticks,
        "past": {
            "memory": _encode([r.memory for r in state.records]),
            "times": _encode([(r.t, r.until) for r in state.records]),
            "ticks": [r.ticks for r in state.records],
            "events": past_events,
        },
        "queue": [_event_data(event) for event in state.queue],
        "counts": state.counts,
        "seen": state.seen,
        "counters": asdict(state.counters),
    }
    return json.dumps(data).encode()


def deserialize(content: bytes, shape: Shape) -> BlockState:
    """The state that `serialize` wrote.

    Args:
        content: the bytes.
        shape: of the model the state should belong to.

    Raises:
        BlockError: the bytes are not a state, or one of another model.
    """
    try:
        return _decode_state(json.loads(bytes(content)), shape)
    except BlockError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise BlockError(
            f"these bytes are not the serialised state of a block ({type(error).__name__}: {error})."
        ) from error


def check_owner(token: str, expected: str) -> None:
    """Refuse the state of another model.

    Args:
        token: of the model that the state comes from. expected: of this model.

    Raises:
        BlockError: the tokens differ.
    """
    if token != expected:
        raise BlockError(f"the state belongs to another model (token {token}, expected {expected}).")


def _decode_state(data: dict[str, Any], shape: Shape) -> BlockState:
    check_owner(str(data["token"]), shape.token)
    count = len(shape.payloads)
    if data["mode"] not in get_args(Mode):
        raise ValueError(f"unknown mode {data['mode']!r}")
    t, t0, horizon, *stamps = map(float, _decode(data["times"], (3 + count,)))
    if not (isfinite(t) and isfinite(t0)):
        raise ValueError(f"the times {t!r} s and {t0!r} s are not finite")
    (policy,) = _integers([data["late_policy"]], 1, range(1, len(LATE_POLICIES) + 1))
    return BlockState(
        token=shape.token,
        mode=data["mode"],
        active=_integers(data["active"], len(data["active"]), range(count)),
        runtime=Snapshot(_decode(data["memory"], (shape.memory,)), t, t0, _integers(data["ticks"], shape.ticks, TICKS)),
        protocol=(policy, horizon),
        records=_decode_records(data["past"], shape),
        queue=tuple(_event(entry, shape) for entry in data["queue"]),
        stamps=tuple(stamps),
        counts=_integers(data["counts"], count),
        seen=_integers(data["seen"], count),
        counters=Counters(**{name: int(value) for name, value in data["counters"].items()}),
    )


def _decode_records(past: dict[str, Any], shape: Shape) -> tuple[Record, ...]:
    count = len(past["ticks"])
    memory = _decode(past["memory"], (count, shape.memory))
    times = _decode(past["times"], (count, 2)).tolist()
    events = {int(i): _event(entry, shape) for i, entry in past["events"].items()}
    instants = list(chain.from_iterable(times))
    if not all(map(isfinite, instants)) or any(later < earlier for earlier, later in pairwise(instants)):
        raise ValueError("the records are not in the order of time")
    ticks = [_integers(entry, shape.ticks, TICKS) for entry in past["ticks"]]
    return tuple(Record(memory[i], t, until, ticks[i], events.get(i)) for i, (t, until) in enumerate(times))


def _event_data(event: Stamped) -> list[Any]:
    return [event.name, _encode([event.stamp, *event.payload])]


def _event(entry: Sequence[Any], shape: Shape) -> Stamped:
    name, numbers = entry
    positions = shape.payloads[name]
    stamp, *payload = map(float, _decode(numbers, (1 + len(positions),)))
    if not isfinite(stamp):
        raise ValueError(f"the stamp {stamp!r} s of event {name} is not finite")
    return Stamped(name, stamp, positions, tuple(payload))


def _integers(values: Sequence[Any], count: int, allowed: range | None = None) -> tuple[int, ...]:
    whole = len(values) == count and all(
        type(value) is int and (allowed is None or value in allowed) for value in values
    )
    if not whole:
        raise ValueError(f"expected {count} whole numbers, got {values!r}")
    return tuple(values)


def _encode(values: Any) -> str:
    return base64.b64encode(np.asarray(values, dtype=DOUBLE).tobytes()).decode()


def _decode(text: str, shape: tuple[int, ...]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text, validate=True), dtype=DOUBLE).reshape(shape).astype(float)

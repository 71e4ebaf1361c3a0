"""The chain: the stages through which a planned component moves over a step, in one order for all runs.

Whoever changes how a component moves adds a stage here; nobody assigns to its methods. `Position` is the order,
`PlannedComponent.add_stage` enforces it, `cosim show` prints it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Any, Protocol

import numpy as np

Mover = Callable[[float, float], None]
"""Brings a component from one time to another [s]."""


class Preparer(Protocol):
    """Gathers the inputs of a component for a step."""

    def __call__(self, t: float, until: float, *, ends_known: bool | np.ndarray = False) -> None:
        """Gather for a step from `t` to `until` [s]; `ends_known` as for `PlannedComponent.prepare`."""


class Position(IntEnum):
    """Where a stage stands in the chain, outermost first. A component has at most one stage at each position."""

    RATE = 0
    """The component takes one step of its own for several communication steps."""
    EVENTS = 1
    """The component waits where a step is divided at events and it cannot stop, or has gone past the event."""
    BALISES = 2
    """The balise service looks for crossings on the way of the plant, or delivers telegrams on the way of a
    receiver. Trial steps of an iterated loop leave this stage out.
    """
    COMPILED = 3
    """One call into the compiled stepper does what is inside, where nothing extraordinary is due."""


COMPILED_STAGE_TEXT = "compiled stepper"


def unchanged(inner: Any) -> Any:
    """What a stage does around a call that it leaves alone: nothing.

    Args:
        inner: the call inside the stage.
    """
    return inner


@dataclass(frozen=True)
class Stage:
    """One stage of a chain. Each argument but the first two takes the call inside the stage and returns the call with
    the stage around it.

    Args:
        position: where it stands.
        text: what it is, for people.
        prepare: around gathering the inputs.
        move: around the whole way over a step, as an algorithm asks for it.
        drive: around the plain way (send inputs, advance, read outputs), which trial steps take as well.
        advance: around the plain way without reading the outputs.
    """

    position: Position
    text: str
    prepare: Callable[[Preparer], Preparer] = unchanged
    move: Callable[[Mover], Mover] = unchanged
    drive: Callable[[Mover], Mover] = unchanged
    advance: Callable[[Mover], Mover] = unchanged


def around(way: Callable[[Mover, float, float], None]) -> Callable[[Mover], Mover]:
    """What a stage does around a call, by a function that is handed the call inside it and both times [s].

    Args:
        way: called with the call inside, start and end of the step [s].
    """
    return lambda inner: partial(way, inner)


def plain_way(interpolator: str | None, substeps: int, *, inputs: bool, gated: bool) -> str:
    """The inner end of every chain in words, in the order in which things are done.

    Args:
        interpolator: name of the input interpolator; None where inputs are held over a step.
        substeps: steps that the component takes for one of the master's.
        inputs: whether any input is connected. gated: whether discrete inputs are sent in Event Mode only.
    """
    how = "held" if interpolator is None else f"interpolated: {interpolator}"
    sent = [f"send inputs ({how}{', discrete ones at events' if gated else ''})"] if inputs else []
    return ", ".join([*sent, "advance" if substeps == 1 else f"advance in {substeps} substeps", "read outputs"])

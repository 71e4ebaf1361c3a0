"""Slaves in plain Python with clocks of every kind, for what C examples cannot say: odd intervals, fractions, wrong
answers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from fmpy.model_description import ModelVariable
from mock_slaves import Mock, variable

NOT_YET_KNOWN, UNCHANGED, CHANGED = 0, 1, 2


def clock(
    name: str, reference: int, causality: str = "input", kind: str = "triggered", **attributes: Any
) -> ModelVariable:
    """A clock as `read_description` would make it."""
    made = variable(name, causality, reference, "Clock")
    made.intervalVariability = kind
    for attribute, value in attributes.items():
        setattr(made, attribute, value)
    return made


class Clocked(Mock):
    """One time-based clock `tick` of a kind; output `ticks` counts, `seen` keeps all instants.

    `responses` are (interval, qualifier) in the order in which it is asked, the last one for ever.
    """

    capabilities: ClassVar[dict[str, Any]] = {"hasEventMode": True}
    outputs: ClassVar[dict[str, Any]] = {"ticks": 0.0}
    memory = ("v", "x", "time", "asked")
    TICK = 90

    def __init__(
        self, kind: str, responses: Sequence[tuple[float, int]] = (), shift: float = 0.0, **attributes: Any
    ) -> None:
        self._clock = clock("tick", self.TICK, kind=kind, **attributes)
        self.responses, self.shift = list(responses), shift
        super().__init__()

    def more_variables(self) -> list[ModelVariable]:
        return [self._clock]

    def begin(self) -> None:
        self.x = {"ticks": 0.0}
        self.asked, self.active, self.in_event_mode = 0, False, False
        self.seen: list[float] = []

    def compute(self) -> None:
        self.v["ticks"] = self.x["ticks"]

    def exitInitializationMode(self) -> None:
        self.in_event_mode = True

    def enterEventMode(self) -> None:
        assert not self.in_event_mode
        self.in_event_mode = True

    def enterStepMode(self) -> None:
        assert self.in_event_mode
        self.in_event_mode = False

    def setClock(self, references: Sequence[int], values: Sequence[bool]) -> None:
        assert self.in_event_mode
        assert list(references) == [self.TICK]
        self.active = True

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        assert self.in_event_mode
        if self.active:
            self.seen.append(self.time)
            self.x["ticks"] += 1.0
        self.active = False
        return False, False, False, False, False, 0.0

    def _response(self) -> tuple[float, int]:
        response = self.responses[min(self.asked, len(self.responses) - 1)]
        self.asked += 1
        return response

    def getIntervalDecimal(self, references: Any, intervals: Any, qualifiers: Any) -> None:
        assert list(references) == [self.TICK]
        intervals[0], qualifiers[0] = self._response()

    def getShiftDecimal(self, references: Any, shifts: Any) -> None:
        shifts[0] = self.shift

    def getIntervalFraction(self, references: Any, counters: Any, resolutions: Any, qualifiers: Any) -> None:
        counters[0], resolutions[0], qualifiers[0] = 1, 3, self._response()[1]

    def getShiftFraction(self, references: Any, counters: Any, resolutions: Any) -> None:
        counters[0], resolutions[0] = 1, 6


class Planned(Mock):
    """Announces its next event from a plan; every update is one event. Output `events`."""

    capabilities: ClassVar[dict[str, Any]] = {"hasEventMode": True}
    outputs: ClassVar[dict[str, Any]] = {"events": 0.0}

    def __init__(self, plan: Callable[[float, int], float]) -> None:
        self.plan = plan
        super().__init__()

    def begin(self) -> None:
        self.x = {"events": -1.0}  # the update that ends initialisation is none
        self.seen: list[float] = []

    def compute(self) -> None:
        self.v["events"] = max(self.x["events"], 0.0)

    def enterEventMode(self) -> None:
        self.seen.append(self.time)

    def enterStepMode(self) -> None:
        pass

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        self.x["events"] += 1.0
        following = self.plan(self.time, int(self.x["events"]))
        return False, False, False, False, following < math.inf, following


class Flag(Mock):
    """Takes a discrete input in Event Mode only, and says when it was set; output `heard`."""

    capabilities: ClassVar[dict[str, Any]] = {"hasEventMode": True}
    inputs: ClassVar[dict[str, Any]] = {}
    outputs: ClassVar[dict[str, Any]] = {"heard": 0.0}

    def more_variables(self) -> list[ModelVariable]:
        return [variable("u", "input", 80, "Float64", variability="discrete")]

    def begin(self) -> None:
        self.x = {"heard": 0.0}
        self.seen: list[tuple[float, float]] = []
        self.mode = "initialization"

    def compute(self) -> None:
        self.v["heard"] = self.x["heard"]

    def exitInitializationMode(self) -> None:
        self.mode = "event"

    def enterEventMode(self) -> None:
        self.mode = "event"

    def enterStepMode(self) -> None:
        self.mode = "step"

    def _set(self, references: Any, values: Any) -> None:
        assert self.mode != "step", "a discrete input changed in Step Mode"
        super()._set(references, values)

    setFloat64 = _set

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        if self.v["u"] != self.x["heard"]:
            self.x["heard"] = self.v["u"]
            self.seen.append((self.time, self.v["u"]))
        return False, False, False, False, False, 0.0

"""Time-based clocks of an FMI 3.0 slave: when each of them ticks next. Knows the clock functions of a slave, and no
master.

FMI 3.0.2, 2.2.10 and 2.3.5: a clock with ``intervalVariability`` ``constant``, ``fixed`` or ``tunable`` is periodic; a
``changing`` one says at each tick when the next one comes, a ``countdown`` says in Event Mode how long it is until it
ticks once. Instants follow from their number and are never accumulated.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from fmpy.fmi3 import fmi3IntervalChanged, fmi3IntervalNotYetKnown, fmi3IntervalUnchanged
from fmpy.model_description import ModelVariable

from fmus.fmi.standard import NEVER, TIME_TOLERANCE

PERIODIC = ("constant", "fixed", "tunable", "calculated")
APERIODIC = ("changing", "countdown")
LAST_PRIORITY = 2**31
"""Of a clock that declares none: after those that do."""

Refuse = Callable[[str], Exception]
Found = list[tuple[float, float, int]]
"""Interval (or counter), resolution (1 for decimals) and qualifier of each clock asked."""


@dataclass(frozen=True)
class Rhythm:
    """Instants ``begin + (shift + n * interval) / resolution`` [s], n = 0, 1, ...

    Args:
        begin: [s]. shift, interval: [s / resolution]. resolution: 1 where they are decimals.
    """

    begin: float
    shift: float
    interval: float
    resolution: float = 1.0

    def instant(self, n: int) -> float:
        """The n-th instant [s]."""
        return self.begin + (self.shift + n * self.interval) / self.resolution


@dataclass
class _TimeClock:
    """One clock and its next tick.

    Args:
        variable: in the model description.
        rhythm: None while a countdown is not set.
        number: of the next instant in the rhythm.
        ticked: in the event that is being handled.
    """

    variable: ModelVariable
    rhythm: Rhythm | None = None
    number: int = 0
    ticked: bool = False

    @property
    def name(self) -> str:
        """Name of the variable."""
        return str(self.variable.name)

    @property
    def kind(self) -> str:
        """Its ``intervalVariability``."""
        return str(self.variable.intervalVariability)

    @property
    def priority(self) -> int:
        """Its ``priority``; the lowest number comes first."""
        return LAST_PRIORITY if self.variable.priority is None else int(self.variable.priority)

    @property
    def next(self) -> float:
        """When it ticks next [s]."""
        return NEVER if self.rhythm is None else self.rhythm.instant(self.number)

    @property
    def declared(self) -> tuple[float, float, float] | None:
        """(shift, interval, resolution) from the model description, or None where the slave must be asked."""
        v = self.variable
        if v.supportsFraction and v.resolution and v.intervalCounter:
            return float(v.shiftCounter or 0), float(v.intervalCounter), float(v.resolution)
        return None if v.intervalDecimal is None else (float(v.shiftDecimal or 0.0), float(v.intervalDecimal), 1.0)


@dataclass
class ClockSchedule:
    """The time-based input clocks of one slave.

    Args:
        slave: gives the slave, with fmpy's call surface. variables: all of its model description.
        refuse: makes the error for a clock that says something impossible.
    """

    slave: Callable[[], Any]
    variables: Sequence[ModelVariable]
    refuse: Refuse
    clocks: list[_TimeClock] = field(init=False)

    def __post_init__(self) -> None:
        found = [_TimeClock(v) for v in self.variables if _is_time_based(v)]
        self.clocks = sorted(found, key=lambda clock: clock.priority)

    def __bool__(self) -> bool:
        return bool(self.clocks)

    @property
    def next(self) -> float:
        """When the first of them ticks [s]."""
        return min((clock.next for clock in self.clocks), default=NEVER)

    def due(self, t: float) -> list[_TimeClock]:
        """Those that tick at `t` [s], by priority."""
        return [clock for clock in self.clocks if clock.next <= t + TIME_TOLERANCE]

    def begin(self, t: float) -> None:
        """Initialisation ends at `t` [s]: ask for what the model description leaves open. To be called in
        Initialization Mode.
        """
        for clock in self.clocks:
            clock.rhythm, clock.number, clock.ticked = None, 0, False
            if clock.kind in PERIODIC and clock.declared is not None:
                shift, interval, resolution = clock.declared
                self._start(clock, Rhythm(t, shift, interval, resolution), 0)
        asked = [c for c in self.clocks if c.rhythm is None]
        for clock, (interval, resolution, qualifier) in self._intervals(asked):
            if qualifier == fmi3IntervalNotYetKnown:
                if clock.kind != "countdown":
                    raise self.refuse(
                        f"clock '{clock.name}' ({clock.kind}) does not know its interval at the end of initialisation"
                    )
            elif clock.kind in PERIODIC:
                self._start(clock, Rhythm(t, self._shift(clock, resolution), interval, resolution), 0)
            else:
                self._start(clock, Rhythm(t, 0.0, interval, resolution), 1)

    def tick(self, clocks: Sequence[_TimeClock]) -> None:
        """These clocks were set active: on to their next instants."""
        for clock in clocks:
            clock.ticked = True
            clock.number += 1
            if clock.kind == "countdown":
                clock.rhythm = None

    def ask(self, t: float) -> None:
        """Discrete states were updated at `t` [s]: ask for intervals that may have changed. To be called in Event
        Mode.
        """
        asked = [c for c in self.clocks if _may_change(c)]
        for clock, (interval, resolution, qualifier) in self._intervals(asked):
            clock.ticked = False
            if qualifier == fmi3IntervalChanged:
                self._start(clock, Rhythm(t, 0.0, interval, resolution), 1)
            elif qualifier == fmi3IntervalNotYetKnown and clock.kind == "countdown":
                clock.rhythm = None
            elif qualifier not in (fmi3IntervalUnchanged, fmi3IntervalNotYetKnown):
                raise self.refuse(f"clock '{clock.name}': unknown interval qualifier {qualifier}")

    def save(self) -> list[tuple[Rhythm | None, int, bool]]:
        """What ticks and events change here."""
        return [(clock.rhythm, clock.number, clock.ticked) for clock in self.clocks]

    def restore(self, state: list[tuple[Rhythm | None, int, bool]]) -> None:
        """Return to what was saved.

        Args:
            state: from `save`.
        """
        for clock, (rhythm, number, ticked) in zip(self.clocks, state, strict=True):
            clock.rhythm, clock.number, clock.ticked = rhythm, number, ticked

    # -- internals --------------------------------------------------------------------------------------------------

    def _start(self, clock: _TimeClock, rhythm: Rhythm, number: int) -> None:
        seconds = rhythm.interval / rhythm.resolution if rhythm.resolution > 0.0 else math.nan
        least = "above 0" if clock.kind in PERIODIC else "0 or more"
        if not math.isfinite(seconds) or seconds < 0.0 or (seconds == 0.0 and clock.kind in PERIODIC):
            raise self.refuse(
                f"clock '{clock.name}' ({clock.kind}) has the interval {seconds:g} s, expected one {least}"
            )
        if not (math.isfinite(rhythm.shift) and rhythm.shift >= 0.0):
            raise self.refuse(
                f"clock '{clock.name}' has the shift {rhythm.shift / rhythm.resolution:g} s, expected 0 or more"
            )
        clock.rhythm, clock.number = rhythm, number

    def _shift(self, clock: _TimeClock, resolution: float) -> float:
        references = (ctypes.c_uint32 * 1)(clock.variable.valueReference)
        if clock.variable.supportsFraction:
            counters, resolutions = (ctypes.c_uint64 * 1)(), (ctypes.c_uint64 * 1)()
            self.slave().getShiftFraction(references, counters, resolutions)
            return counters[0] * (resolution / resolutions[0])
        shifts = (ctypes.c_double * 1)()
        self.slave().getShiftDecimal(references, shifts)
        return float(shifts[0])

    def _intervals(self, clocks: Sequence[_TimeClock]) -> Iterator[tuple[_TimeClock, tuple[float, float, int]]]:
        for ask, some in ((self._decimals, False), (self._fractions, True)):
            group = [clock for clock in clocks if bool(clock.variable.supportsFraction) is some]
            if group:
                yield from zip(group, ask([clock.variable.valueReference for clock in group]), strict=True)

    def _decimals(self, references: Sequence[int]) -> Found:
        count = len(references)
        intervals, qualifiers = (ctypes.c_double * count)(), (ctypes.c_int * count)()
        self.slave().getIntervalDecimal((ctypes.c_uint32 * count)(*references), intervals, qualifiers)
        return [(float(i), 1.0, int(q)) for i, q in zip(intervals, qualifiers, strict=True)]

    def _fractions(self, references: Sequence[int]) -> Found:
        count = len(references)
        counters, resolutions = (ctypes.c_uint64 * count)(), (ctypes.c_uint64 * count)()
        qualifiers = (ctypes.c_int * count)()
        self.slave().getIntervalFraction((ctypes.c_uint32 * count)(*references), counters, resolutions, qualifiers)
        return [(float(c), float(r), int(q)) for c, r, q in zip(counters, resolutions, qualifiers, strict=True)]


def _is_time_based(variable: ModelVariable) -> bool:
    """Whether a variable is a clock that the importer sets by the time."""
    return (
        variable.type == "Clock"
        and variable.causality == "input"
        and variable.intervalVariability in PERIODIC + APERIODIC
    )


def clock_references(variable: ModelVariable) -> frozenset[int]:
    """Value references of the clocks of a variable; fmpy holds the clocks themselves, descriptions made in Python
    references.

    Args:
        variable: in the model description.
    """
    return frozenset(int(getattr(entry, "valueReference", entry)) for entry in variable.clocks or ())


def _may_change(clock: _TimeClock) -> bool:
    """Whether the slave must be asked after an update of its discrete states."""
    if clock.kind == "changing":
        return clock.ticked
    return clock.kind == "countdown" or (clock.kind == "tunable" and clock.declared is None)

"""Test FMUs with events: clocks, time events, early return, event iteration; and awkward ones. Each with its closed
form.

    from test_fmus.events import countdown_fmu, periodic_fmu, receiver_fmu, timed_fmu, triggered_fmu
    source, sink = triggered_fmu(tmp_path), receiver_fmu(tmp_path)
    # triggered.crossing -> receiver.tick, triggered.crossing_value -> receiver.tick_value

``event_mode=False`` builds the same model without event mode (in FMI 3.0 without clocks as well): it sees its events at
the communication points only, so that the loss shows. ``early=False`` keeps event mode but never returns early.
``version`` 1 and 2 are always without event mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from test_fmus.build import CATEGORIES, TIME, Define, build_fmu, capability_flags
from test_fmus.description import Variable, Version

LEVEL = 0.173
INSTANTS, LEVELS, FIRST_LEVEL = (0.07, 0.255, 0.4, 0.7123), (2.0, -1.0, 3.0, 0.5), 1.0
DELAY, ARM_TIME = 0.137, 0.21


def _make(
    folder: Path,
    name: str,
    source: str,
    version: Version,
    event_mode: bool,
    early: bool,
    variables: Sequence[Variable],
    defines: dict[str, Define],
) -> Path:
    event_mode = event_mode and version == 3
    flags = capability_flags(version, event_mode=event_mode, might_return_early=event_mode and early)
    defines |= {"HAS_EVENT_MODE": event_mode, "MIGHT_RETURN_EARLY": early}
    return build_fmu(folder, name, source, version, [TIME, *variables], flags, defines)


def _only(event_mode: bool, version: Version, *clocks: Variable) -> list[Variable]:
    return list(clocks) if event_mode and version == 3 else []


# -- a time-based clock
# ---------------------------------------------------------------------------------------------------


def periodic_fmu(
    folder: Path,
    name: str = "periodic",
    *,
    version: Version = 3,
    event_mode: bool = True,
    interval: float = 0.03,
    shift: float = 0.01,
) -> Path:
    """A sampler on the input clock ``tick``: constant interval, first tick at start + shift [s].

    Input ``u``; outputs at the last tick: ``count`` (Int32), ``when`` [s] (-1 before the first) and ``sample`` = u.
    """
    clocked = (1,) if event_mode and version == 3 else ()
    interval_attributes = {
        "intervalVariability": "constant",
        "intervalDecimal": repr(interval),
        "shiftDecimal": repr(shift),
    }
    variables = [
        *_only(event_mode, version, Variable("tick", 1, "input", "Clock", further=interval_attributes)),
        Variable("u", 2, "input", start=0.0),
        Variable("count", 3, "output", "Int32", variability="discrete", clocks=clocked),
        Variable("when", 4, "output", variability="discrete", unit="s", clocks=clocked),
        Variable("sample", 5, "output", variability="discrete", depends=("u",) if clocked else (), clocks=clocked),
    ]
    return _make(
        folder, name, "periodic.c", version, event_mode, False, variables, {"INTERVAL": interval, "SHIFT": shift}
    )


def periodic_ticks(until: float, interval: float = 0.03, shift: float = 0.01, start: float = 0.0) -> np.ndarray:
    """The instants of `periodic_fmu` up to and with `until` [s]."""
    count = int(np.floor((until - start - shift) / interval + 1e-9)) + 1
    return start + shift + interval * np.arange(max(count, 0))


# -- a triggered output clock, and what listens to it
# ----------------------------------------------------------------------


def triggered_fmu(
    folder: Path,
    name: str = "triggered",
    *,
    version: Version = 3,
    event_mode: bool = True,
    early: bool = True,
    level: float = LEVEL,
) -> Path:
    """A ramp ``rate * t`` whose output clock ``crossing`` ticks at every multiple of ``level``: at ``k level / rate``.

    Parameters ``rate`` (1) and ``level``; outputs ``crossing_value`` = k level (clocked), ``count`` = k (Int32),
    ``ramp``, ``when`` [s] of the last crossing as the FMU saw it (-1 before the first).
    """
    clocked = (3,) if event_mode and version == 3 else ()
    variables = [
        Variable("rate", 1, "parameter", start=1.0),
        Variable("level", 2, "parameter", start=level),
        *_only(
            event_mode,
            version,
            Variable("crossing", 3, "output", "Clock", further={"intervalVariability": "triggered"}),
        ),
        Variable("crossing_value", 4, "output", variability="discrete", clocks=clocked),
        Variable("count", 5, "output", "Int32", variability="discrete"),
        Variable("ramp", 6, "output"),
        Variable("when", 7, "output", variability="discrete", unit="s"),
    ]
    return _make(folder, name, "triggered.c", version, event_mode, early, variables, {"LEVEL_START": level})


def receiver_fmu(folder: Path, name: str = "receiver", *, version: Version = 3, event_mode: bool = True) -> Path:
    """Takes ``tick_value`` when its triggered input clock ``tick`` ticks, and integrates what it holds.

    Outputs ``count`` (Int32) of values taken, ``held``, ``integral`` of held over time, ``when`` [s] of the last.
    Without event mode ``tick_value`` is a plain discrete input.
    """
    with_clock = event_mode and version == 3
    variables = [
        *_only(
            event_mode, version, Variable("tick", 1, "input", "Clock", further={"intervalVariability": "triggered"})
        ),
        Variable("tick_value", 2, "input", variability="discrete", start=0.0, clocks=(1,) if with_clock else ()),
        Variable("count", 3, "output", "Int32", variability="discrete"),
        Variable("held", 4, "output", variability="discrete"),
        Variable("integral", 5, "output"),
        Variable("when", 6, "output", variability="discrete", unit="s"),
    ]
    return _make(folder, name, "receiver.c", version, event_mode, False, variables, {})


def crossing_times(until: float, level: float = LEVEL, rate: float = 1.0) -> np.ndarray:
    """When `triggered_fmu` ticks, up to and with `until` [s]."""
    return level / rate * np.arange(1, int(np.floor(until * rate / level + 1e-9)) + 1)


def received_integral(t: float, level: float = LEVEL, rate: float = 1.0) -> float:
    """``integral`` of a receiver behind `triggered_fmu` at t [s]: every crossing adds `level` to what is held."""
    return float(level * np.sum(t - crossing_times(t, level, rate)))


# -- time events, and what feels them
# --------------------------------------------------------------------------------------


def timed_fmu(
    folder: Path,
    name: str = "timed",
    *,
    version: Version = 3,
    event_mode: bool = True,
    early: bool = True,
    instants: Sequence[float] = INSTANTS,
    levels: Sequence[float] = LEVELS,
    first: float = FIRST_LEVEL,
) -> Path:
    """A discrete output ``level`` that starts at `first` and jumps to `levels` at `instants` [s], announced as
    nextEventTime.

    Outputs ``level`` and ``jumps`` (Int32).
    """
    variables = [
        Variable("level", 1, "output", variability="discrete"),
        Variable("jumps", 2, "output", "Int32", variability="discrete"),
    ]
    defines: dict[str, Define] = {
        "JUMPS": len(instants),
        "INSTANTS": tuple(instants),
        "LEVELS": tuple(levels),
        "FIRST_LEVEL": first,
    }
    return _make(folder, name, "timed.c", version, event_mode, early, variables, defines)


def integrator_fmu(folder: Path, name: str = "integrator", *, version: Version = 3, event_mode: bool = True) -> Path:
    """Integrates its discrete input ``u``.

    Outputs ``integral``, ``changes`` (Int32) of u since the start, ``when`` [s] of the last.
    """
    variables = [
        Variable("u", 1, "input", variability="discrete", start=0.0),
        Variable("integral", 2, "output"),
        Variable("changes", 3, "output", "Int32", variability="discrete"),
        Variable("when", 4, "output", variability="discrete", unit="s"),
    ]
    return _make(folder, name, "integrator.c", version, event_mode, False, variables, {})


def timed_level(
    t: float, instants: Sequence[float] = INSTANTS, levels: Sequence[float] = LEVELS, first: float = FIRST_LEVEL
) -> float:
    """``level`` of `timed_fmu` at t [s], after the jump where there is one."""
    return float((first, *levels)[int(np.searchsorted(np.asarray(instants), t, side="right"))])


def timed_integral(
    t: float, instants: Sequence[float] = INSTANTS, levels: Sequence[float] = LEVELS, first: float = FIRST_LEVEL
) -> float:
    """``integral`` of an integrator behind `timed_fmu` at t [s]."""
    edges = np.clip([0.0, *instants, np.inf], 0.0, t)
    return float(np.dot((first, *levels), np.diff(edges)))


# -- a countdown clock
# -----------------------------------------------------------------------------------------------------


def countdown_fmu(
    folder: Path,
    name: str = "countdown",
    *,
    version: Version = 3,
    event_mode: bool = True,
    early: bool = True,
    delay: float = DELAY,
    arm_time: float = ARM_TIME,
) -> Path:
    """The countdown clock ``alarm`` gets its interval, parameter ``delay`` [s], from the event that arms it.

    Armed by the triggered clock ``start``, and once by a time event at the parameter ``arm_time`` [s] (never where it
    is negative); with the Boolean parameter ``repeat`` (false) every alarm arms the next. Outputs ``alarms`` (Int32),
    ``when`` [s] of the last alarm (-1 before), ``armed`` (Boolean).
    """
    variables = [
        *_only(
            event_mode,
            version,
            Variable("start", 1, "input", "Clock", further={"intervalVariability": "triggered"}),
            Variable("alarm", 2, "input", "Clock", further={"intervalVariability": "countdown"}),
        ),
        Variable("delay", 3, "parameter", start=delay, unit="s"),
        Variable("arm_time", 4, "parameter", start=arm_time, unit="s"),
        Variable("repeat", 5, "parameter", "Boolean", start=False),
        Variable("alarms", 6, "output", "Int32", variability="discrete"),
        Variable("when", 7, "output", variability="discrete", unit="s"),
        Variable("armed", 8, "output", "Boolean", variability="discrete"),
    ]
    return _make(
        folder,
        name,
        "countdown.c",
        version,
        event_mode,
        early,
        variables,
        {"DELAY_START": delay, "ARM_START": arm_time},
    )


def alarm_times(until: float, delay: float = DELAY, arm_time: float = ARM_TIME, repeat: bool = False) -> np.ndarray:
    """When `countdown_fmu` rings that is armed by its own time event, up to and with `until` [s]."""
    count = int(np.floor((until - arm_time) / delay + 1e-9))
    return arm_time + delay * np.arange(1, (max(count, 0) if repeat else min(max(count, 0), 1)) + 1)


# -- events that cause events
# ----------------------------------------------------------------------------------------------

NEVER_SETTLES = 1e300
KICK_TIME, ROUNDS = 0.15, 5


def bouncer_fmu(
    folder: Path,
    name: str,
    *,
    add: float,
    limit: float = NEVER_SETTLES,
    kick_time: float = -1.0,
    version: Version = 3,
    event_mode: bool = True,
    early: bool = True,
) -> Path:
    """On a change of the discrete input ``u``: output ``y = u + add``, where u < `limit`. At `kick_time` [s], if
    positive: y = 1.

    Parameters ``kick_time``, ``add``, ``limit``; outputs ``y`` and ``changes`` (Int32) of y. y does not depend directly
    on u: it follows with the update of the discrete states.
    """
    variables = [
        Variable("u", 1, "input", variability="discrete", start=0.0),
        Variable("y", 2, "output", variability="discrete"),
        Variable("changes", 3, "output", "Int32", variability="discrete"),
        Variable("kick_time", 4, "parameter", start=kick_time, unit="s"),
        Variable("add", 5, "parameter", start=add),
        Variable("limit", 6, "parameter", start=limit),
    ]
    defines: dict[str, Define] = {"KICK_START": kick_time, "ADD_START": add, "LIMIT_START": limit}
    return _make(folder, name, "bouncer.c", version, event_mode, early, variables, defines)


def bouncing_pair(folder: Path, rounds: float = ROUNDS, kick_time: float = KICK_TIME) -> tuple[Path, Path]:
    """``ping`` and ``pong``; connect ``ping.y -> pong.u`` and ``pong.y -> ping.u``.

    At `kick_time` both go, at one instant, to y = `rounds` and changes = `rounds`; with `NEVER_SETTLES` rounds they
    never settle.
    """
    return bouncer_fmu(folder, "ping", add=1.0, limit=rounds, kick_time=kick_time), bouncer_fmu(folder, "pong", add=0.0)


# -- awkward
# ---------------------------------------------------------------------------------------------------------------

Behaviour = Literal[
    "quit",
    "quit-in-event",
    "discard",
    "discard-silently",
    "short",
    "own-steps",
    "chatty",
    "warns",
    "fails",
    "dies",
    "waits",
    "exact-steps",
    "overshoots",
    "cries",
    "halves",
]
_CODES = {
    "quit": 1,
    "quit-in-event": 2,
    "discard": 3,
    "discard-silently": 3,
    "short": 4,
    "chatty": 5,
    "warns": 6,
    "fails": 7,
    "dies": 8,
    "waits": 9,
    "own-steps": 10,
    "exact-steps": 11,
    "overshoots": 12,
    "cries": 13,
    "halves": 14,
}
_EARLY = ("quit", "quit-in-event", "short", "halves")
"""What may return early."""


def awkward_fmu(
    folder: Path,
    behaviour: Behaviour,
    name: str = "awkward",
    *,
    version: Version = 3,
    at: float = 0.25,
    longest_step: float = 0.04,
    every: float = 0.1,
    early: bool = True,
    declares_early: bool = True,
) -> Path:
    """An integrator, ``y' = u`` (y = 0 at the start), that does something awkward at the time `at` [s].

    Args:
        behaviour: ``quit`` asks for the end of the run at `at` (FMI 1.0, 2.0: discard), ``quit-in-event`` does so from
            an event (3.0); ``discard`` refuses a step over `at` longer than `longest_step`: FMI 1.0 and 2.0 come to
            `at` and say so, or stay where they were (``discard-silently``); FMI 3.0 stays where it was; ``short``
            comes no further than `longest_step` in a step (FMI 3.0 with earlyReturn; FMI 1.0, 2.0: nothing tells);
            ``own-steps`` moves in steps of its own of that length, stays at the last one within a step, which is FMI
            3.0's lastSuccessfulTime, and does not return early; ``chatty`` logs at `at`, `at` + `every`, ..., see
            `chatter`; ``warns``: every step returns a warning; ``fails``, ``dies``: error or fatal in the step over
            `at`; ``waits``: pending there (FMI 1.0, 2.0); ``exact-steps`` refuses a step that is no whole multiple of
            ``u``, to the last bit; ``overshoots`` says from `at` on that it stands a step beyond the end of each step,
            ``cries`` that there is an event at `at`; ``halves`` comes half of the way in every step, early (FMI 3.0).
        early: it may return early. declares_early: and says so.
    """
    event_mode = behaviour == "quit-in-event" and version == 3
    returns_early = declares_early and version == 3 and early and behaviour in _EARLY
    flags = capability_flags(version, event_mode=event_mode, might_return_early=returns_early)
    if behaviour == "waits":
        flags["canRunAsynchronuously"] = "true"
    variables = [TIME, Variable("u", 1, "input", start=1.0), Variable("y", 2, "output")]
    defines: dict[str, Define] = {
        "BEHAVIOUR": _CODES[behaviour],
        "AT": at,
        "LONGEST_STEP": longest_step,
        "EVERY": every,
        "HIDES_LAST_TIME": behaviour == "discard-silently",
        "HAS_EVENT_MODE": event_mode,
        "MIGHT_RETURN_EARLY": early,
    }
    return build_fmu(folder, name, "awkward.c", version, variables, flags, defines)


def chatter(until: float, at: float = 0.25, every: float = 0.1, u: float = 1.0) -> list[tuple[float, int, str, str]]:
    """What ``chatty`` logs up to `until` [s], logging on: time, status, category, text, with the arguments in place."""
    said = []
    for k in range(int(np.floor((until - at) / every + 1e-9)) + 1):
        when = at + every * k
        said.append(
            (
                (when, 0, "logEvents", f"event {k} of 'test_fmus' at {when:.3f} s"),
                (when, 1, "logStatusWarning", f"u = {u:g} is large, 100 % sure"),
                (when, 0, "logAll", "nothing to say"),
            )[k % 3]
        )
    return said


DEEDS = (
    "nothing",
    "exits",
    "exits-at-once",
    "crashes",
    "hangs",
    "crashes-when-freed",
    "crashes-when-terminated",
    "exits-when-freed",
    "moves",
    "rounds",
    "paints",
    "interrupts",
    "bounds",
    "overwrites",
    "warns",
    "hangs-when-freed",
    "hangs-when-terminated",
    "fails-when-terminated",
    "closes",
    "deafens",
    "localises",
    "sets-variable",
    "handles",
    "lowers-limits",
    "masks",
    "closes-opened",
    "closes-all",
)
"""What `hostile_fmu` does with ``deed = 0, 1, 2, ...``"""


def hostile_fmu(folder: Path, name: str = "hostile", beside: Path | None = None) -> Path:
    """An integrator, ``y' = 1`` (FMI 2.0), that harms its process in the step over the time ``at``; the parameter
    ``deed`` is the place in `DEEDS`: calls exit or _exit, raises SIGSEGV, never returns, changes the working directory
    or the rounding mode, logs escape sequences, sends SIGINT to its own process, bounds ``at`` to 0.3, overwrites it
    with that, returns a warning from there on, does not return from fmi2FreeInstance or fmi2Terminate, refuses the
    latter, closes the standard output, ignores SIGINT, sets another locale or an environment variable, ignores SIGUSR2,
    lowers a limit of the process, takes all permissions from new files, closes all files but the standard streams, or
    these too. `beside` is a shared library that it brings along."""
    parameters = [Variable("deed", 1, "parameter", start=0.0), Variable("at", 2, "parameter", start=0.25)]
    variables = [TIME, *parameters, Variable("y", 3, "output")]
    return build_fmu(folder, name, "hostile.c", 2, variables, capability_flags(2), {}, beside=beside)


LOG_CATEGORIES = CATEGORIES
"""Of all FMUs here."""

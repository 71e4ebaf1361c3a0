"""Checks of events in co-simulation: triggered input clocks (FMI 3), and counted events, which this package writes into
FMUs.

A counted event ``e`` is an integer input ``e_count`` with a real input ``e_time``, the stamp: raising the count before
a step announces that the event happens at the stamp, inside that step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmus.check.behaviour import RESOLUTION, STEP_TOLERANCE, UNEVEN, divided_steps, worst
from fmus.check.check import DISTRUST, Check
from fmus.check.checks.life_checks import listed, not_finite
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, limited, passed, skipped
from fmus.check.runner import WARM_UP_STEPS, Runner
from fmus.fmi.fmi3 import FMI3Slave

PAYLOAD = "give what comes with an event a value that makes sense"
NONE = "declares neither a triggered input clock nor a counted event"


def _no_event_mode(clocks: Sequence[str]) -> CheckOutcome:
    return limited(f"declares the triggered input clocks {listed(clocks)} but no event mode", "leave its clocks alone")


def _clocks(context: Context, clocks: Sequence[str]) -> CheckOutcome:
    """Each clock ticks once, with the values its inputs have."""
    with context.fresh_runner() as runner:
        runner.begin()
        for clock in clocks:
            runner.steps((runner.h,))
            assert isinstance(runner.component, FMI3Slave)
            runner.component.activate(clock)
        rows = runner.steps((runner.h,) * WARM_UP_STEPS)
    bad = not_finite(runner.output_names, np.sum(rows, axis=0), runner.component.variables)
    if bad:
        return limited(f"not finite after a tick with the start values of its inputs: {listed(bad)}", PAYLOAD)
    return passed(f"its input clocks tick in event mode and the run goes on: {listed(clocks)}")


def _counted(context: Context, names: Sequence[str]) -> CheckOutcome:
    """An event inside a step against the same one where two shorter steps meet."""
    runner = context.runner
    divisible = runner.component.can_vary_step and not divided_steps(runner)
    for name in names:
        start = _warmed_up(runner)
        whole = _crossing(runner, name, (), (runner.h,))
        bad = not_finite(runner.output_names, whole, runner.component.variables)
        if bad:
            return limited(
                f"not finite after event {name} with the start values of its payload: {listed(bad)}", PAYLOAD
            )
        slack = STEP_TOLERANCE * np.abs(whole - start) + RESOLUTION * np.abs(whole)
        until, rest = UNEVEN * runner.h, (1.0 - UNEVEN) * runner.h
        for before, after in (((), (until, rest)), ((until,), (rest,))) if divisible else ():
            _warmed_up(runner)
            split = _crossing(runner, name, before, after)
            if np.any(np.abs(whole - split) > slack):
                return failed(f"event {name} inside a step does not happen at its stamp: {worst(runner, whole, split)}")
    exact = "happen at their stamps inside a step" if divisible else "are taken"
    return passed(f"its counted events {exact}: {listed(names)}")


def _warmed_up(runner: Runner) -> np.ndarray:
    runner.begin()
    return runner.steps((runner.h,) * WARM_UP_STEPS)[-1]


def _crossing(runner: Runner, name: str, before: Sequence[float], after: Sequence[float]) -> np.ndarray:
    """Outputs after steps of lengths [s], the event announced between `before` and `after`, always with the same
    stamp.
    """
    stamp = runner.now + UNEVEN * runner.h
    runner.steps(before)
    slave = runner.component
    write, buffer = slave.writer([f"{name}_time", f"{name}_count"])
    buffer[:] = stamp, slave.read([f"{name}_count"])[0] + 1.0
    write()
    return runner.steps(after)[-1]


class EventsCheck(Check, failing=DISTRUST, place=17):
    """Every declared event happens once, and the run goes on."""

    name = "events"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        slave = context.runner.component
        names = list(slave.events)
        if not names:
            return skipped(NONE)
        if slave.fmi_version == 2:
            return _counted(context, names)
        return _clocks(context, names) if slave.has_event_mode else _no_event_mode(names)

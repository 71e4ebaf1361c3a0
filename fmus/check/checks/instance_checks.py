"""Checks of many instances of an FMU: one after the other, which must leave nothing behind, and two at once."""

from __future__ import annotations

import gc
import os
from contextlib import suppress
from pathlib import Path
from time import perf_counter

from fmus.check.check import LIMIT, ONE_INSTANCE, Check
from fmus.check.checks.life_checks import SHARE_OF_BUDGET, compared
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed, skipped
from fmus.check.runner import WARM_UP_STEPS, elsewhere, end_of_experiment
from fmus.fmi.surroundings import open_files

_INSTANCES = 50
_FIRST_INSTANCES = 10
"""Instances made before memory is measured: libraries open files and fill caches once."""

_LEAK = 16 * 1024
"""Growth of memory for each instance that is taken for a leak [bytes]; a few pages each are the allocator's own."""

_LEAK_OF_STUDY = 50 * 1024
"""What a study feels [bytes]: half a gigabyte after 10 000 runs in one process."""


# -- what the process holds ------------------------------------------------------------------------------------------


def memory_bytes() -> tuple[int, int] | None:
    """Memory of this process, reserved and in use [bytes], or None where that is not known."""
    gc.collect()
    with suppress(OSError, ValueError):
        pages = Path("/proc/self/statm").read_text(encoding="ascii").split()
        return int(pages[0]) * os.sysconf("SC_PAGE_SIZE"), int(pages[1]) * os.sysconf("SC_PAGE_SIZE")
    return None


def _mark(count: int) -> tuple[int, int | None, int]:
    memory = memory_bytes()
    return count, None if memory is None else memory[1], len(open_files())


def _growth(first: tuple[int, int | None, int], last: tuple[int, int | None, int]) -> CheckOutcome:
    count = last[0] - first[0]
    said = []
    if not first[2]:
        said.append("open files are not counted on this system")
    elif last[2] > first[2]:
        return failed(f"leaks file descriptors: {last[2] - first[2]} more are open after {count} more instances")
    else:
        said.append("no file stays open")
    if first[1] is None or last[1] is None:
        said.append("memory is not measured on this system")
    elif last[1] - first[1] > _LEAK * count:
        grown = (last[1] - first[1]) / 1024
        what = f"leaks memory: {grown:.0f} kB more after {count} more instances, {grown / count:.0f} kB each"
        return failed(what) if last[1] - first[1] > _LEAK_OF_STUDY * count else noted(what)
    else:
        said.append(f"memory grew by {max(last[1] - first[1], 0) / 1024:.0f} kB over the last {count}")
    return passed(f"{last[0]} instances, {', '.join(said)}")


class TwoInstancesCheck(Check, failing=LIMIT, advice=ONE_INSTANCE, compares=True, place=14, several=True):
    """Two instances at once, under different inputs, step by step in turn: the first one must not notice."""

    name = "two instances"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.fresh_runner() as other:
            runner = context.runner
            runner.begin()
            alone = runner.steps((runner.h,) * (2 * WARM_UP_STEPS))
            runner.begin()
            other.begin()
            other.set_inputs(elsewhere(runner.amplitude))
            beside = []
            for _ in alone:
                other.steps((runner.h,))
                beside += runner.steps((runner.h,))
        return compared(
            runner, (alone, beside), "beside a second instance", "a second instance changes nothing in the first"
        )


class RepeatedInstantiationCheck(
    Check, failing=LIMIT, advice="do not make many instances in one process", place=15, several=True
):
    """Many instances, one after the other: memory and open files must not grow."""

    name = "repeated instantiation"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        if not context.ends:
            return skipped("no instance is freed, because the process does not survive it")
        slave = context.slave()
        since, marks = perf_counter(), []
        try:
            for count in range(1, _INSTANCES + 1):
                slave.instantiate()
                slave.enter_initialization(
                    context.start_time, end_of_experiment(context.description, context.start_time)
                )
                slave.exit_initialization()
                slave.free_instance_only()
                if count in (_FIRST_INSTANCES, _INSTANCES):
                    marks.append(_mark(count))
                elif perf_counter() - since > SHARE_OF_BUDGET * context.budget and count > _FIRST_INSTANCES:
                    marks.append(_mark(count))
                    break
        finally:
            slave.free()
        if len(marks) < 2:
            return skipped(f"instances take too long to make {_FIRST_INSTANCES + 1} of them; use a longer --timeout")
        return _growth(*marks)

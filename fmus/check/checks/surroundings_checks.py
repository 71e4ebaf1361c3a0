"""Checks of what an FMU leaves behind in its process and in the working directory."""

from __future__ import annotations

from pathlib import Path
from time import sleep

import numpy as np

from fmus.check.behaviour import worst
from fmus.check.check import LIMIT, Check
from fmus.check.checks.instance_checks import memory_bytes
from fmus.check.checks.life_checks import listed
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed, skipped
from fmus.check.runner import SLOW_STEPS, WARM_UP_STEPS
from fmus.fmi.surroundings import CHARACTERS, open_files

_MEMORY_STEPS = 5
_LEAK_OF_STEP = 64 * 1024
"""Growth of memory with each step that is taken for a leak [bytes]: 6 GB in a run of 100 000 steps."""

_WAIT = 0.1
"""For threads that write after a step has returned [s]."""


class SurroundingsCheck(
    Check, failing=LIMIT, advice="run it in a process of its own, since others in the process meet that too", place=25
):
    """What belongs to everybody in the process is as it was before the first check: see `fmus.fmi.surroundings`."""

    name = "surroundings"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(WARM_UP_STEPS)
        changed = context.surroundings.put_back()
        now = open_files()
        closed = [str(number) for number, file in context.open_files.items() if now and now.get(number) != file]
        changed += [f"files that were open in the process, number {listed(closed)}"] if closed else []
        if changed:
            what = f"it changed {' and '.join(changed)}"
            return noted(f"{what}, which a run puts back") if changed == [CHARACTERS] else failed(what)
        return passed("it changes nothing that belongs to the process")


class WrittenFilesCheck(
    Check, failing=LIMIT, advice="give each run a working directory of its own, and look after the files", place=26
):
    """No file appears in the working directory."""

    name = "written files"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(WARM_UP_STEPS)
        new = sorted({entry.name for entry in Path(context.directory).iterdir()} - context.entries)
        if new:
            return failed(f"it writes into the working directory: {listed(new)}")
        return passed("it writes no file")


class MemoryOfStepsCheck(Check, failing=LIMIT, advice="keep runs short: a long one runs out of memory", place=6.05):
    """Steps take no more and more memory, used or only reserved."""

    name = "memory of steps"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(WARM_UP_STEPS)  # which may fill caches once
            marks = [memory_bytes()]
            for _ in range(2):
                steps = runner.steps_at_most(_MEMORY_STEPS)
                marks.append(memory_bytes())
        if None in marks:
            return skipped("memory is not measured on this system")
        found = np.diff(np.array(marks, dtype=float), axis=0).min(axis=0)  # what grows once is no leak
        kept = float(found.max()) / max(steps, 1)
        if kept > _LEAK_OF_STEP:
            return failed(f"each step takes {kept / 1e6:.3g} MB more of memory, which it keeps")
        return passed("no step keeps more memory than the one before")


class BetweenCallsCheck(
    Check,
    failing=LIMIT,
    advice="compare no two runs digit by digit: what is read depends on the speed of the machine",
    place=6.35,
):
    """Outputs stay as they are while nothing is called: no thread of the FMU writes them after a step has returned."""

    name = "between calls"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(WARM_UP_STEPS)
            first = runner.outputs()
            sleep(_WAIT)
            second = runner.outputs()
            if not np.array_equal(first, second, equal_nan=True):
                return failed(f"outputs change though nothing is called: {worst(runner, first, second)}")
        return passed("outputs stay as they are while nothing is called")


class OpenFilesCheck(Check, failing=LIMIT, advice="keep runs short: it opens a file in each step", place=27):
    """Steps open no file that stays open."""

    name = "open files"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(1)  # which may open some once
            before = len(open_files())
            steps = runner.steps_at_most(SLOW_STEPS)
            after = len(open_files())
        if not before:
            return skipped("open files are not counted on this system")
        if after - before >= max(steps, 1):
            return failed(f"{after - before} more files are open after {steps} more steps")
        return passed("no step leaves a file open")

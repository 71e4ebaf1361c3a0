"""Checks of what an FMU leaves behind in its process and in the working directory."""

from __future__ import annotations

from pathlib import Path

from fmus.check.check import LIMIT, Check
from fmus.check.checks.instance_checks import open_files
from fmus.check.checks.life_checks import listed
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, passed, skipped
from fmus.check.runner import SLOW_STEPS, WARM_UP_STEPS


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
        if changed:
            return failed(f"it changed {' and '.join(changed)}")
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


class OpenFilesCheck(Check, failing=LIMIT, advice="keep runs short: it opens a file in each step", place=27):
    """Steps open no file that stays open."""

    name = "open files"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with context.begun_runner() as runner:
            runner.steps_at_most(1)  # which may open some once
            before = open_files()
            steps = runner.steps_at_most(SLOW_STEPS)
            after = open_files()
        if before is None or after is None:
            return skipped("open files are not counted on this system")
        if after - before >= max(steps, 1):
            return failed(f"{after - before} more files are open after {steps} more steps")
        return passed("no step leaves a file open")

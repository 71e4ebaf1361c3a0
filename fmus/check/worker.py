"""The child process: runs the checks of a job and tells each finding as one line of JSON.

Started by `fmus.check.isolated` as ``python -m fmus.check.worker``. What the FMU prints goes to the file that the parent opened
for it; the lines go to what was standard output when the process began.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from fmus.check.catalogue import CATALOGUE, Check
from fmus.check.context import Context
from fmus.check.description import read_description
from fmus.check.findings import Finding, Outcome, Verdict, failed
from fmus.check.job import Job
from fmus.check.steppable import FAILURES

MAX_FILE_BYTES = 256 * 1024**2
"""A file that the FMU writes, its console output included, may not grow beyond this."""


def main() -> int:
    """Read a job from standard input, run it, tell the findings."""
    lines = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)  # from here on standard output is the file for console output, like standard error
    _limit()
    job = Job.from_json(sys.stdin.readline())

    def tell(message: dict[str, Any]) -> None:
        lines.write(json.dumps(message) + "\n")
        lines.flush()

    run(job, tell)
    tell({"done": True})
    lines.close()
    os._exit(0)  # an FMU may have left threads, or handlers that crash at exit


def run(job: Job, tell: Callable[[dict[str, Any]], None]) -> None:
    """Run a job.

    Args:
        job: which checks of which FMU.
        tell: is called with ``{"start": name}`` before each check and with its finding after it.
    """
    description = read_description(Path(job.folder))
    context = Context(Path(job.folder), description, job.step, job.start_time, job.starts, job.budget)
    wanted = [check for check in CATALOGUE[job.interface] if check.name in job.checks]
    for finding in findings(wanted, context, lambda name: tell({"start": name})):
        tell({"finding": finding.to_dict()})
    context.close()


def findings(checks: list[Check], context: Context, starting: Callable[[str], None] = lambda _: None) -> Iterator[Finding]:
    """Run checks one after the other; where one that is the basis of the others fails, these are skipped.

    Args:
        checks: in order. context: what is checked. starting: is called with the name of each check before it runs.
    """
    broken = ""
    for check in checks:
        if broken:
            yield unrun(check.name, broken)
            continue
        starting(check.name)
        outcome = _outcome(check, context)
        yield Finding(check.name, outcome.verdict, outcome.detail)
        if check.basis and outcome.verdict is Verdict.FAIL:
            broken = check.name


def unrun(name: str, basis: str) -> Finding:
    """The finding of a check that could not run because another one failed."""
    return Finding(name, Verdict.SKIPPED, f"not run, because '{basis}' failed")


def _outcome(check: Check, context: Context) -> Outcome:
    try:
        return check.run(context)
    except FAILURES as error:
        if "bench" in context.__dict__:
            context.bench.reset_works = False  # whatever failed, go on with a fresh instance
        return failed(str(error))


def _limit() -> None:
    """No core files, no endless files; where the system has such limits."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 - exists on POSIX systems only

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (MAX_FILE_BYTES, MAX_FILE_BYTES))


if __name__ == "__main__":
    sys.exit(main())

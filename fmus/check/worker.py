"""The child process: runs the checks of a job and reports each finding as one line of JSON.

Forked by `fmus.check.watchdog`. What the FMU prints goes to the file that the parent opened
for it; the lines go to what was standard output when the process began.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from traceback import extract_tb
from typing import Any, NoReturn

from fmus.check.check import REPEATED, Check
from fmus.check.checked_instance import SlaveError
from fmus.check.context import Context
from fmus.check.findings import CheckFinding, CheckOutcome, Verdict, failed
from fmus.check.job import CheckJob
from fmus.check.known_checks import CHECKS, EXPECTED
from fmus.exchange.description import as_stepped
from fmus.fmi.description import read_description
from plant_models.user_file import UserFileError, load_class

FILES_CLOSED = 97
"""Exit code of a worker that cannot report any more, because the FMU has closed files that it did not open."""
BY_HAND = "check this by hand"
DIFFERS = "not run, because equal runs differ"
_MAX_FILE_BYTES = 256 * 1024**2
"""A file that the FMU writes, its console output included, may not grow beyond this."""


def main() -> NoReturn:
    """Read a job from standard input, run it, report the findings."""
    lines = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)  # from here on standard output is the file for console output, like standard error
    _limit()
    job = CheckJob.from_json(sys.stdin.readline())

    me = os.getpid()

    def report(message: dict[str, Any]) -> None:
        if os.getpid() != me:
            os._exit(0)  # the FMU has forked: a copy of the worker, which must report nothing
        try:
            lines.write(json.dumps(message) + "\n")
            lines.flush()
        except OSError:
            os._exit(FILES_CLOSED)

    run(job, report)
    lines.close()
    os._exit(0)  # an FMU may have left threads, or handlers that crash at exit


def run(job: CheckJob, report: Callable[[dict[str, Any]], None]) -> None:
    """Run a job.

    Args:
        job: which checks of which FMU.
        report: is called with ``{"start": name}`` before each check, with its finding after it, and with ``{"ending":
            call}`` before a call that ends an instance.
    """
    description = as_stepped(read_description(Path(job.folder)))
    folder = Path(job.folder)
    context = Context(folder, description, job.step, job.start_time, job.starts, job.budget, job.steps, job.ends)
    context.announce = lambda call: report({"ending": call, "only_once": context.only_once})
    for name, place in job.places.items():
        try:
            CHECKS[name] = load_class(place, EXPECTED)
        except UserFileError as error:
            report({"finding": CheckFinding(name, Verdict.ERROR, str(error), BY_HAND).to_dict()})
    wanted = [CHECKS[name] for name in job.checks if name in CHECKS]
    for finding in findings(wanted, context, lambda name: report({"start": name})):
        report({"finding": finding.to_dict()})
    context.close()


def findings(
    checks: list[type[Check]], context: Context, starting: Callable[[str], None] = lambda _: None
) -> Iterator[CheckFinding]:
    """Run checks one after the other; where one that is the basis of the others fails, these are skipped.

    Args:
        checks: in order. context: what is checked. starting: is called with the name of each check before it runs.
    """
    broken, differs = "", False
    for check in checks:
        if broken or (differs and check.compares):
            yield unrun(check.name, broken) if broken else CheckFinding(check.name, Verdict.SKIPPED, DIFFERS)
            continue
        starting(check.name)
        finding = check.finding(_outcome(check, context))
        yield finding
        differs |= check.name == REPEATED and finding.verdict is not Verdict.PASS
        if check.basis and finding.verdict in (Verdict.DISTRUST, Verdict.ERROR):
            broken = check.name


def unrun(name: str, basis: str) -> CheckFinding:
    """The finding of a check that could not run because another one failed.

    Args:
        name: of the class.
        basis: name of the check that failed.
    """
    return CheckFinding(name, Verdict.SKIPPED, f"not run, because '{basis}' failed")


def _outcome(check: type[Check], context: Context) -> CheckOutcome:
    """What a check says; what an FMU raises is its failure, what a mistake in the check raises is the check's own."""
    try:
        outcome = check.outcome(context)
        if not isinstance(outcome, CheckOutcome):
            raise TypeError(f"run() returned {type(outcome).__name__}; expected a CheckOutcome")
        return outcome
    except SlaveError as error:
        outcome = failed(str(error))
    except Exception as error:  # whatever is wrong here must not be blamed on the FMU
        place = extract_tb(error.__traceback__)[-1]
        said = f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
        outcome = CheckOutcome(
            Verdict.ERROR, f"an error of this check, not of the FMU; please report it: {said}", BY_HAND
        )
    if "runner" in context.__dict__:
        context.runner.reset_works = False  # whatever failed, go on with a fresh instance
    return outcome


def _limit() -> None:
    """No core files, no endless files; where the system has such limits."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 - exists on POSIX systems only

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (_MAX_FILE_BYTES, _MAX_FILE_BYTES))

"""From the task of a run to its outcome: checked, made ready, executed; everything freed at its end.

Each step takes values and returns one: `cosim.run.checked`, `cosim.run.ready`, `cosim.run.executed`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter

from cosim.components.component import Component
from cosim.diagnostics.call_log import CallLog
from cosim.process.exit_guard import limited_calls
from cosim.process.interruption import Interruption
from cosim.run.checked import check_task
from cosim.run.executed import execute
from cosim.run.outcome import Outcome
from cosim.run.ready import Progress, make_ready
from cosim.run.remarks import Remarks
from cosim.run.run_seeds import with_seeds
from cosim.run.streaming import Streaming
from cosim.run.task import RunTask

LOG = logging.getLogger("cosim")
CALL_LOG = Path("calls.log")
Report = Callable[[str], None]


def run_scenario(
    task: RunTask,
    progress: Progress | None = None,
    warn: Report | None = None,
    call_log: Path | None = None,
    building: Report | None = None,
    stream: Streaming | None = None,
    warnings: Sequence[str] = (),
    finish: Callable[[Outcome], Outcome] = lambda outcome: outcome,
) -> Outcome:
    """Run a scenario to its end or to its first failure.

    Args:
        task: what is to be run. progress: called with the time reached and the end [s].
        warn: called with everything doubtful as soon as it is known, before the run where it can be; by default the log
            ``cosim``.
        call_log: where calls are logged, where the scenario asks for that; by default `CALL_LOG` in the working folder.
        building: called for FMUs that are built before the run, as they are done; by default the log, as information.
        stream: the folder that rows are written to as they come; None to keep them in memory.
        warnings: from before, which have been reported already.
        finish: called with the outcome before any component is closed, since an FMU may take the process along there;
            what it returns is returned.

    Raises:
        CosimError: the scenario cannot be set up; failures on the way are in the outcome.
    """
    master = task.table.master
    remarks = Remarks(warn or LOG.warning, list(warnings))
    with limited_calls(master.call_timeout, ends=True), ExitStack() as resources:
        log = _open_log(call_log or CALL_LOG, resources) if master.log_calls else None
        with limited_calls(master.call_timeout):
            begin = perf_counter()
            with task.named_in_errors():
                checked = check_task(task.with_table(with_seeds(task.table)), building or LOG.info, remarks, resources)
                ready = make_ready(checked, progress, log, stream, remarks, resources)
            seconds = perf_counter() - begin
            with Interruption() as interruption:
                outcome = finish(execute(ready, seconds, log, interruption, remarks))
        if outcome.failure is None:
            interruption.check()  # it came while the results were put away
    if outcome.failure is None:
        remarks.warn(*_failed_ends(ready.coupled.components))
    return outcome


def _failed_ends(components: Mapping[str, Component]) -> Iterator[str]:
    """A warning for each component that could not be put away; the outcome is written by then."""
    for name, component in components.items():
        if component.failed_ends:
            yield f"{name} could not be put away after the run, which is complete: {'; '.join(component.failed_ends)}"


def _open_log(path: Path, resources: ExitStack) -> CallLog:
    log = CallLog(path)
    resources.callback(log.close)
    return log

"""One run in a process of its own, for a script or a test that nobody watches: what its FMUs do, they do there."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

from cosim.errors import CosimError, RunError
from cosim.evaluation.stored_spec import spec_of
from cosim.process.interruption import Interruption
from cosim.process.last_call import LAST_CALL
from cosim.results.result import Result
from cosim.results.salvage import salvaged
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.runs.job import Ended, Failure
from cosim.runs.run import Run
from cosim.runs.workers import Team
from cosim.scenario.scenario_tables import Isolate

_FROM_ENVIRONMENT = "FMU_OBSERVER_ISOLATE"
_CHOICES: tuple[Isolate, ...] = ("no", "run", "component")
_PATIENCE = 1.0
"""How long a run may take to end after Ctrl-C [s]."""
_HERE = (
    "The FMUs of this run share the process of the script: {0}. What ends it ends the script; isolate = 'component' "
    "gives each of them its own."
)
_default: ContextVar[Isolate | None] = ContextVar("isolate", default=None)
_kept: list[tuple[Any, Team]] = []
"""A process that has done a run and waits for the next, with what it knows of this one."""


@contextmanager
def isolated_unless_stated(isolate: Isolate | None) -> Iterator[None]:
    """Within this context, runs whose scenarios say nothing else.

    Args:
        isolate: where they are made; None for the default of the program.
    """
    token = _default.set(isolate or _default.get())
    try:
        yield
    finally:
        _default.reset(token)


def where_it_runs(scenario: Any) -> tuple[Isolate | None, str]:
    """What of a scenario runs in a process of its own: what it states, else what the program states, else the whole run
    where an FMU is in it that was not built here and nobody watches this process.

    Args:
        scenario: what is to be run.

    Returns:
        That, and why the run is made here although it should not be, in words; empty where there is no such reason.

    Raises:
        RunError: the variable of the environment says something else.
    """
    stated: Isolate | None = scenario.table().master.isolate or _default.get()
    if stated is not None or LAST_CALL.watched:
        return stated, ""
    if (named := os.environ.get(_FROM_ENVIRONMENT)) is not None:
        if named not in _CHOICES:
            raise RunError(f"{_FROM_ENVIRONMENT} is {named!r}; expected one of {', '.join(_CHOICES)}.")
        return (None if named == "no" else named), ""
    run = Run(scenario)
    if not run.calls_foreign_fmus:
        return None, ""
    return ("run", "") if not (reason := run.bound_to_script) else (None, _HERE.format(reason))


@dataclass(frozen=True)
class _StreamedRun(Run):
    """A run whose rows are where who asked finds them.

    Args:
        keywords: further ones of `Scenario.run`.
    """

    keywords: tuple[tuple[str, Any], ...] = ()

    def do(self) -> Ended:
        keywords: dict[str, Any] = dict(self.keywords)
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            return Ended(self.scenario.run(warn=lambda _: None, progress=False, **keywords))
        except KeyboardInterrupt:
            return Ended(failure=Failure(INTERRUPTED, outside=True))
        except CosimError as error:
            return Ended(_sent(error))
        finally:
            signal.signal(signal.SIGINT, before)


def _sent(error: CosimError) -> CosimError:
    """The error, or its words where it cannot be sent as it is."""
    try:
        return error if str(pickle.loads(pickle.dumps(error))) == str(error) else RunError(str(error))
    except (TypeError, AttributeError, ValueError, pickle.PicklingError):
        return RunError(str(error))


def run_apart(
    scenario: Any,
    warn: Callable[[str], None],
    stream: Path | None,
    call_log: Path | None,
    progress: Callable[[float, float], None] | None = None,
) -> Outcome:
    """A scenario, run in a process of its own. Ctrl-C ends it as it ends a run here.

    Args:
        scenario: what is run. warn: receives its warnings when it has ended.
        stream: results folder that it streams to; None for none. call_log: as for `Scenario.run`.
        progress: called with the time reached and the end [s].

    Returns:
        The outcome; of a process that died with the rows up to there.

    Raises:
        CosimError: it cannot be set up, or nothing had been computed yet.
    """
    with TemporaryDirectory(prefix="run-") as spare:
        rows = stream or Path(spare) / "rows"
        rows.mkdir(parents=True, exist_ok=True)
        kept = {"fallback" if stream is None else "stream": rows, "call_log": call_log}
        ended = _done(_StreamedRun(scenario, keywords=tuple(kept.items())), scenario.table().stop, progress)
        if isinstance(ended.row, CosimError):
            raise ended.row
        outcome: Outcome = ended.row or _salvaged(rows, ended)
    for warning in outcome.warnings:
        warn(warning)
    return outcome


def _done(run: _StreamedRun, end: float, progress: Callable[[float, float], None] | None) -> Ended:
    """What a run left; of one that did not end in time after Ctrl-C that it was interrupted."""
    with _team(run) as team, Interruption() as interruption:
        asked: list[float] = []

        def given_up() -> bool:
            if progress is not None and (reached := team.reached()) is not None:
                progress(reached, end)
            if interruption.came and not asked:
                asked.append(monotonic())
                team.interrupt()
            return bool(asked) and monotonic() - asked[0] > _PATIENCE

        found = [ended for _, ended in team.each([run], given_up)]
    return found[0] if found else Ended(failure=Failure(INTERRUPTED, outside=True))


@contextmanager
def _team(run: Run) -> Iterator[Team]:
    """A process for a run: the one of the run before where the script has changed nothing that it would not know of."""
    known = os.getpid(), Path.cwd(), dict(os.environ), tuple(sys.path)
    former = _kept.pop() if _kept else None
    team = former[1] if former is not None and former[0] == known and not run.has_own_code else Team(1)
    try:
        yield team
    finally:
        if former is not None and former[1] is not team and former[0][0] == known[0]:
            former[1].close()
        if run.has_own_code or _kept:
            team.close()
        else:
            _kept.append((known, team))


def _salvaged(rows: Path, ended: Ended) -> Outcome:
    """What a process had computed that is gone."""
    reason = "it left nothing" if ended.failure is None else ended.failure.reason
    result = salvaged(rows, reason)
    if result is not None:
        whole = Result.of(result)
        whole = replace(whole, failure=INTERRUPTED) if reason == INTERRUPTED else whole
        return Outcome(whole, spec_of(whole))
    if reason == INTERRUPTED:
        raise KeyboardInterrupt
    raise RunError(reason)

"""One run in a process of its own, for a script or a test that nobody watches: what its FMUs do, they do there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cosim.errors import RunError
from cosim.evaluation.stored_spec import spec_of
from cosim.results.result import Result
from cosim.results.salvage import salvaged
from cosim.run.outcome import Outcome
from cosim.runs.job import Ended
from cosim.runs.run import Run
from cosim.runs.workers import Team


@dataclass(frozen=True)
class _StreamedRun(Run):
    """A run whose rows are where who asked finds them.

    Args:
        keywords: further ones of `Scenario.run`.
    """

    keywords: tuple[tuple[str, Any], ...] = ()

    def do(self) -> Ended:
        keywords: dict[str, Any] = dict(self.keywords)
        return Ended(self.scenario.run(warn=lambda _: None, progress=False, **keywords))


def run_apart(scenario: Any, warn: Callable[[str], None], stream: Path | None, call_log: Path | None) -> Outcome:
    """A scenario, run in a process of its own; its progress is not seen.

    Args:
        scenario: what is run. warn: receives its warnings when it has ended.
        stream: results folder that it streams to; None for none. call_log: as for `Scenario.run`.

    Returns:
        The outcome; of a process that died with the rows up to there.

    Raises:
        RunError: nothing had been computed yet.
    """
    with TemporaryDirectory(prefix="run-") as spare, Team(1) as team:
        rows = stream or Path(spare) / "rows"
        rows.mkdir(parents=True, exist_ok=True)
        kept = {"fallback" if stream is None else "stream": rows, "call_log": call_log}
        ((_, ended),) = team.each([_StreamedRun(scenario, keywords=tuple(kept.items()))])
        if ended.row is not None:
            outcome: Outcome = ended.row
        else:
            reason = "it left nothing" if ended.failure is None else ended.failure.reason
            result = salvaged(rows, reason)
            if result is None:
                raise RunError(reason)
            whole = Result.of(result)
            outcome = Outcome(whole, spec_of(whole))
    for warning in outcome.warnings:
        warn(warning)
    return outcome

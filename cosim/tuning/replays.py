"""Candidates as members of one batch over the inputs of an observer: the numbers of runs, without a master."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cosim.errors import CosimError
from cosim.run.component_models import make_system
from cosim.run.outcome import Outcome
from cosim.simulation.scenario import Scenario
from cosim.studies.replay import Replay
from cosim.tuning.costs import Cost, ExpectationCost
from fmus.batch.error import BatchError

VALUES = 20_000_000
"""Of outputs that are held at a time; 160 MB."""


class Replays:
    """An observer beside a recording, replayed with the parameters of many candidates at once.

    Args:
        outcome: of the run beside the recording. observer: the component.

    Raises:
        CosimError: it cannot be replayed.
    """

    def __init__(self, outcome: Outcome, observer: str) -> None:
        self.replay, self.outcome, self.observer = Replay(outcome, observer), outcome, observer
        before = f"{observer}."
        self._names = [n.removeprefix(before) for n in outcome.result.table.dtype.names or () if n.startswith(before)]

    def outcomes(self, candidates: Sequence[Mapping[str, Any]]) -> Iterator[Outcome | str]:
        """What the run would have been with each candidate, or why it would have failed.

        A result shares its table with the next one, so it is read before the next is asked for.

        Args:
            candidates: settings by name, of parameters of the observer.
        """
        varied = self._varied([candidate for candidate in candidates if candidate])
        for candidate in candidates:
            yield next(varied) if candidate else self.outcome  # without settings: the run that is there

    def _varied(self, candidates: Sequence[Mapping[str, Any]]) -> Iterator[Outcome | str]:
        """Outcomes of candidates that change something, all of them the same parameters."""
        table = self.outcome.result.table.copy()
        result = replace(self.outcome.result, table=table)
        size = max(1, VALUES // (len(table) * len(self._names)))
        for first in range(0, len(candidates), size):
            part = candidates[first : first + size]
            columns = {n.partition(".")[2]: np.array([c[n] for c in part], float) for n in part[0]}
            try:
                found = self.replay.run(self._names, columns, members=len(part))
            except BatchError as error:
                yield from (str(error) for _ in part)
                continue
            for rows in found:
                if not np.isfinite(rows[-1]).all():
                    yield "a state of the observer is no finite number any more, or its parameters are refused"
                    continue
                for place, name in enumerate(self._names):
                    table[f"{self.observer}.{name}"] = rows[:, place]
                yield replace(self.outcome, result=result)


def make_replays(base: Scenario, observer: str, cost: Cost, settings: Sequence[str]) -> Replays | None:
    """The replays of an observer, where it can be replayed and the cost needs no more than that.

    Args:
        base: the observer beside a recording. observer: the component. cost: of a run.
        settings: names of what candidates change.

    Returns:
        None where it cannot.
    """
    table = base.table().components[observer]
    try:
        system = make_system(table, observer)
        if isinstance(cost, ExpectationCost) or system is None or system.triggered_events:
            return None
        known = {signal.name for signal in system.parameter_signals}
        if {name.partition(".")[2] for name in settings} - known:
            return None
        return Replays(base.run(warn=lambda _text: None), observer)
    except (CosimError, ValueError):
        return None  # the master says what is wrong, where anything is

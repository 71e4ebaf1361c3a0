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

BYTES = 16_000_000
"""Of the tables of members that are stepped at a time: what a processor keeps at hand."""


class Replays:
    """An observer beside a recording, replayed with the parameters of many candidates at once.

    Args:
        outcome: of the run beside the recording. observer: the component.

    Raises:
        CosimError: it cannot be replayed.
    """

    def __init__(self, outcome: Outcome, observer: str) -> None:
        self.replay, self.outcome, self.observer = Replay(outcome, observer), outcome, observer
        fields, before = outcome.result.table.dtype.names or (), f"{observer}."
        own = [place for place, name in enumerate(fields) if name.startswith(before)]
        self._own = slice(own[0], own[-1] + 1)
        self._names = [name.removeprefix(before) for name in fields[self._own]]

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
        """Outcomes of candidates that change something, all of them the same parameters.

        Each has a copy of the table of the run, into which the members write the columns of the observer.
        """
        table = self.outcome.result.table
        size = max(1, min(len(candidates), BYTES // table.nbytes))
        tables = np.tile(table, (size, 1))
        written = tables.view(float).reshape(size, len(table), -1)[:, :, self._own]
        outcomes = [replace(self.outcome, result=replace(self.outcome.result, table=member)) for member in tables]
        for first in range(0, len(candidates), size):
            part = candidates[first : first + size]
            every = [*part, *[part[-1]] * (size - len(part))]  # a batch of another size would have to be made
            columns = {n.partition(".")[2]: np.array([c[n] for c in every], float) for n in part[0]}
            try:
                self.replay.run(self._names, columns, members=size, into=written)
            except BatchError as error:
                yield from (str(error) for _ in part)
                continue
            for rows, outcome in zip(written, outcomes[: len(part)], strict=False):
                if np.isfinite(rows[-1]).all():
                    yield outcome
                else:
                    yield "a state of the observer is no finite number any more, or its parameters are refused"


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
        return Replays(base.run(warn=lambda _text: None, progress=False), observer)
    except (CosimError, ValueError):
        return None  # the master says what is wrong, where anything is

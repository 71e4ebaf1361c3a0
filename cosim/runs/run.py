"""A run of a scenario as a job: settings, and what is taken of the outcome."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from cosim.errors import CosimError
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.runs.job import Ended, Failure, Job
from cosim.runs.keys import digest, scenario_content
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.origin import ForeignFile, Origin, foreign_files


def whole(outcome: Outcome) -> Outcome:
    """The outcome itself, where all of it is wanted.

    Args:
        outcome: of a run.
    """
    return outcome


@dataclass(frozen=True)
class Run(Job):
    """One run of a scenario.

    Args:
        scenario: what is run. settings: values that are changed, by the names of `Scenario.set`.
        take: what is kept of the outcome, also of a run that ended early: a function of a module.
        rests_on: what the row follows from besides the scenario and its settings, as text: what is taken.
    """

    scenario: RunnableScenario
    settings: Mapping[str, Any] = field(default_factory=dict)
    take: Callable[[Outcome], Any] = whole
    rests_on: str = ""

    @cached_property
    def key(self) -> str:
        """Digest of the resolved scenario, the content of its files, the seed, the versions, and what is taken."""
        return digest(scenario_content(self._resolved()), self.rests_on)

    @property
    def seed(self) -> int | None:
        """Seed of the run."""
        return int(self._resolved().table().seed)

    @property
    def apart(self) -> bool:
        """Whether it calls native code of others, which may take its process along, and can be done in another one:
        a class that a script defines is not found there without the script.
        """
        named = [*(str(file.path) for file in self.files()), *map(str, self.settings.values())]
        return any(name.endswith(".fmu") for name in named) and b"__main__" not in pickle.dumps(self)

    def do(self) -> Ended:
        """Run it and take what is wanted. What is doubtful is in the outcome, and not said for every run."""
        outcome = self.scenario.run(overrides=self.settings, warn=_silent)
        reason = outcome.failure
        failure = None if reason is None else Failure(reason, outside=reason == INTERRUPTED)
        return Ended(self.take(outcome), failure)

    def files(self) -> Sequence[ForeignFile]:
        """The files that the scenario names."""
        try:
            scenario = self._resolved()
            return foreign_files(scenario.table(), scenario.folder)
        except CosimError:  # the run says why it cannot be
            return ()

    def code(self) -> Sequence[Callable[..., Any]]:
        """`take`, and the classes that a script put into the scenario."""
        tables = self.scenario.table().components.values()
        given = [getattr(table.model or table.observer, "given", None) for table in tables]
        return [self.take, *(g if isinstance(g, type) else type(g) for g in given if g is not None)]

    def moved(self, places: Mapping[str, str]) -> Run:
        """The same run with its files at other places; a class in a file keeps its name."""
        scenario = self._resolved()
        tables = scenario.table().model_dump(by_alias=True)
        for key, place in places.items():
            node: Any = tables
            for part in key.split("."):
                node = node[part]
            _, colon, wanted = str(node).rpartition(".py:")
            scenario.set(key.removeprefix("components."), f"{place}:{wanted}" if colon else place)
        return replace(self, scenario=scenario, settings={})

    def brought_back(self, ended: Ended) -> Ended:
        """An outcome names the files of this machine."""
        if not isinstance(ended.row, Outcome):
            return ended
        scenario = self._resolved()
        origin = Origin.of(scenario.table(), scenario.name, scenario.folder, scenario.where)
        return replace(ended, row=replace(ended.row, origin=origin))

    def _resolved(self) -> RunnableScenario:
        """The scenario with the settings in it."""
        scenario = self.scenario.copy()
        for name, value in self.settings.items():
            scenario.set(name, value)
        return scenario

    def __getstate__(self) -> dict[str, Any]:
        """Without the key, which nobody needs elsewhere."""
        return {name: value for name, value in self.__dict__.items() if name != "key"}


def _silent(_text: str) -> None: ...

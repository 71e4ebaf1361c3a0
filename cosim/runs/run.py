"""A run of a scenario as a job: settings, and what is taken of the outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.components.description import read_description
from cosim.errors import CosimError, RunError
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.runs.job import Ended, Failure, Job, pickled
from cosim.runs.keys import digest, table_content
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.origin import ForeignFile, Origin, foreign_files
from fmus.fmi.standard import OWN_TOOL

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable


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

    @property
    def key(self) -> str:
        """Digest of the scenario with its settings and seed, the contents of files, the versions, and `rests_on`."""
        return self._identity[0]

    @property
    def seed(self) -> int | None:
        """Seed of the run."""
        return self._identity[1]

    @cached_property
    def _identity(self) -> tuple[str, int]:
        """Key and seed: no more is kept of the table, for there are thousands of runs."""
        table = self._table
        return digest(table_content(table, self.scenario.folder), self.rests_on), int(table.seed)

    @property
    def apart(self) -> bool:
        """Whether it may take its process along, for it calls native code of others or has calls that are limited in
        time, and can be done in another one.
        """
        return (self._calls_fmus or self._is_limited) and not self.bound_to_script

    @property
    def bound_to_script(self) -> str:
        """Why it can be done in this process only, in words: a class that a script defines is not found elsewhere
        without the script, and not all that it holds can be sent. Empty where it can be done elsewhere.
        """
        try:
            return "a class or a function of the script is in it" if b"__main__" in pickled(self) else ""
        except RunError as error:
            return str(error).partition(". Run with")[0]

    @property
    def has_own_code(self) -> bool:
        """Whether classes of the user's are in it, which may change between two runs."""
        return bool(self._stated) or any(file.path.suffix == ".py" for file in self.files())

    @property
    def calls_foreign_fmus(self) -> bool:
        """Whether FMUs are in it that were not built here and share its process with it."""
        tables = self._table.components.values()
        named = [table.fmu for table in tables if table.fmu is not None and table.isolate is None]
        return any(_is_foreign(self.scenario.folder / name) for name in named)

    @property
    def _calls_fmus(self) -> bool:
        """Whether FMUs of others are in it."""
        named = [*(str(file.path) for file in self.files()), *map(str, self.settings.values())]
        return any(name.endswith(".fmu") for name in named)

    @property
    def _is_limited(self) -> bool:
        """Whether a call that takes too long is to be ended, for which its process must end."""
        try:
            return self._table.master.call_timeout is not None
        except CosimError:  # the run says why it cannot be
            return False

    def do(self) -> Ended:
        """Run it and take what is wanted. Its warnings are handed over with the row, and not printed for every run."""
        outcome = self.scenario.run(overrides=self.settings, warn=_silent, progress=False)
        reason = outcome.failure
        failure = None if reason is None else Failure(reason, outside=reason == INTERRUPTED)
        return Ended(self.take(outcome), failure, warnings=tuple(outcome.warnings))

    def files(self) -> Sequence[ForeignFile]:
        """The files that the scenario names."""
        try:
            named = foreign_files(self._table, self.scenario.folder)
        except CosimError:  # the run says why it cannot be
            return ()
        return [file for file in named if file.owner not in self._stated]

    def code(self) -> Sequence[Callable[..., Any]]:
        """`take`, and the classes that a script put into the scenario."""
        stated = self._stated.values()
        return [self.take, *(model if isinstance(model, type) else type(model) for model in stated)]

    def moved(self, places: Mapping[str, str]) -> Run:
        """The same run with its files at other places; a class in a file keeps its name."""
        scenario, tables = self._resolved(), self._table.model_dump(by_alias=True)
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
        origin = Origin.of(self._table, self.scenario.name, self.scenario.folder, self.scenario.where)
        return replace(ended, row=replace(ended.row, origin=origin))

    @property
    def _table(self) -> ScenarioTable:
        """The scenario with the settings in it."""
        return self._resolved().table()

    @property
    def _stated(self) -> dict[str, Any]:
        """Classes and instances that a script put into the scenario, by component: they travel as they are."""
        models = {name: table.model or table.observer for name, table in self._table.components.items()}
        return {name: model.stated for name, model in models.items() if model is not None and model.stated is not None}

    def _resolved(self) -> RunnableScenario:
        """The scenario with the settings in it."""
        return self.scenario.with_settings(self.settings)

    def __getstate__(self) -> dict[str, Any]:
        """Without what follows from the rest."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def _is_foreign(path: Path) -> bool:
    """Whether a file is an FMU of another tool; what cannot be read is none, and the run says why."""
    try:
        return bool(read_description(path).generationTool != OWN_TOOL)
    except CosimError:
        return False


def _silent(_text: str) -> None: ...

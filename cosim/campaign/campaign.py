"""A campaign: the runs that the table ``[campaign]`` of a scenario asks for, ready to run, on the one engine of runs.
Touches the folder it is given.
"""

from __future__ import annotations

import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any
from uuid import uuid4

from cosim.campaign.campaign_result import CampaignResult
from cosim.campaign.chunk import Keyed, RunChunk
from cosim.campaign.kept import keep_results
from cosim.campaign.plan import check_settings, planned_runs
from cosim.campaign.store import PARTS, Row, Store, setting_type
from cosim.campaign.tally import Tally
from cosim.errors import OutputError, ScenarioError
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor, make_executor
from cosim.runs.job import Ended, Failure
from cosim.runs.keys import digest, table_content, version_text
from cosim.runs.runnable import RunnableScenario
from cosim.scenario.campaign_table import CampaignTable
from cosim.scenario.schema import ScenarioTable
from cosim.studies.setting_units import setting_unit
from fmus.cli.progress import Progress, reported
from fmus.tables.plain_data import jsonable
from fmus.tables.table import FirstScreen, Parts

ABOUT, SCENARIO = "campaign.json", "scenario.toml"
_LARGEST = 200
"""Runs of a chunk at most, and chunks of a campaign about: enough for a scheduler, few enough to be told of."""


@dataclass(frozen=True)
class Campaign(FirstScreen):
    """Many runs of a scenario; made by `make_campaign`.

    Args:
        stated: the scenario with its campaign. scenario: as it is run. table: the campaign. runs: all, in their order.
        units: of settings, by name.
    """

    stated: RunnableScenario
    scenario: RunnableScenario
    table: CampaignTable
    runs: Sequence[Keyed]
    units: Mapping[str, str]

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def names(self) -> list[str]:
        """Names of the settings that vary."""
        return list(self.runs[0].planned.settings)

    def first_screen(self) -> Parts:
        """How many runs there will be, and what varies."""
        designs = self.runs[-1].planned.design + 1
        each = f" ({len(self) // designs} disturbances, {designs} designs each)" if designs > 1 else ""
        return [f"{len(self)} runs of {self.scenario.name}{each}; what varies: {', '.join(self.names)}."]

    def run(
        self,
        directory: str | Path,
        workers: int = 1,
        *,
        scheduler: str | None = None,
        resume: bool = False,
        retry: bool = False,
        progress: Progress = None,
    ) -> CampaignResult:
        """Do all runs that are not in the folder yet; one that fails, crashes or hangs does not stop the others.

        Args:
            directory: folder of the campaign: ``campaign.json``, ``scenario.toml``, ``parts/*.parquet``, and ``kept``,
                with whole results of some runs. workers: processes at a time; numbers do not depend on it.
            scheduler: address of a scheduler of `dask.distributed` whose workers do the runs.
            resume: whether runs of an earlier attempt at this campaign in the folder are taken over.
            retry: with `resume`, do again what failed.
            progress: called with runs done, runs in all, and what came of them; see `Scenario.vary`.

        Returns:
            What came of it.

        Raises:
            ScenarioError: `workers` is less than 1. OutputError: the folder holds another campaign, or cannot be
                written. RunError: the cluster cannot be used. KeyboardInterrupt: it was interrupted.
        """
        folder = Path(directory).absolute()
        chunks = self._chunks(self._opened(folder, resume), retry)
        unfinished = [chunk for chunk, rows in chunks if len(rows) < len(chunk.runs)]
        if unfinished and unfinished[0].store.is_shared():
            random.shuffle(unfinished)  # two processes in one folder seldom do the same
        apart = any(chunk.apart for chunk, _ in chunks)
        with make_executor(workers, scheduler, apart=apart) as executor, reported(progress, "run") as report:
            tally = Tally(len(self), self.table.keep.of, report)
            tally.add(row for _, rows in chunks for row in rows.values())
            try:
                missing = _Rounds(executor, tally).all_done(unfinished)
            finally:
                for chunk in unfinished:  # of what was interrupted
                    if rows := chunk.store.known(chunk.number):
                        chunk.store.commit(chunk.number, list(rows.values()))
            result = CampaignResult.read(folder, self.table, self.names, missing)
            return keep_results(
                result, self.scenario, {run.planned.number: run.planned.settings for run in self.runs}, executor
            )

    def _opened(self, folder: Path, resume: bool) -> Store:
        """The store of this campaign in a folder."""
        identity, path = self.identity(), folder / ABOUT
        try:
            if path.is_file():
                _compare(json.loads(path.read_text(encoding="utf-8"))["identity"], identity, folder)
                if not resume:
                    raise OutputError(f"{folder} holds runs of this campaign: go on with --resume, or choose another.")
            (folder / PARTS).mkdir(parents=True, exist_ok=True)
            self.stated.save(folder / SCENARIO)
            new = path.with_suffix(f".{uuid4().hex}")
            new.write_text(json.dumps({"scenario": self.scenario.name, "identity": identity}, indent=2) + "\n")
            new.replace(path)
        except OutputError:
            raise
        except OSError as error:
            raise OutputError(f"{folder} cannot be written: {error.strerror or error}.") from error
        except (ValueError, KeyError, TypeError) as error:
            raise OutputError(f"{path} is damaged ({error}); choose another folder.") from error
        values = {name: [run.planned.settings[name] for run in self.runs] for name in self.names}
        return Store(folder, {name: setting_type(taken) for name, taken in values.items()}, self.units)

    def identity(self) -> dict[str, str]:
        """What distinguishes the campaign from others, as texts by name."""
        table = self.table.model_dump(exclude={"keep"}, exclude_defaults=True)
        stated = {f"campaign.{key}": json.dumps(jsonable(value), sort_keys=True) for key, value in table.items()}
        runs = digest(*(run.key for run in self.runs))
        return {"versions": version_text(), "scenario": self.scenario.name, **stated, "runs of it": runs}

    def _chunks(self, store: Store, retry: bool) -> list[tuple[RunChunk, dict[str, Row]]]:
        """All chunks, with the rows of each that are there."""
        # files that a text names travel with the first run of a chunk, so that its texts are those of all
        ordered = sorted(self.runs, key=lambda run: _texts(run.planned.settings))
        size = max(1, min(_LARGEST, len(ordered) // _LARGEST))
        groups = [list(members) for _, members in groupby(ordered, lambda run: _texts(run.planned.settings))]
        listed = [group[place : place + size] for group in groups for place in range(0, len(group), size)]
        found = []
        for number, runs in enumerate(listed):
            chunk, rows = RunChunk(number, runs, self.scenario, store, uuid4().hex), store.known(number)
            if retry and any(row["failure"] is not None for row in rows.values()):
                rows = {key: row for key, row in rows.items() if row["failure"] is None}
                store.commit(number, list(rows.values()))
            elif len(rows) == len(runs) and not store.part(number).is_file():  # killed before it took its place
                store.commit(number, list(rows.values()))
            found.append((chunk, rows))
        return found


@dataclass(frozen=True)
class _Rounds:
    """Chunks that are done until each of their runs has a row.

    Args:
        executor: where. tally: told of what ends.
    """

    executor: Executor
    tally: Tally

    def all_done(self, chunks: Sequence[RunChunk]) -> list[str]:
        """Do them; why some have no row, for a reason outside of them."""
        missing: list[str] = []
        while chunks:
            again: list[RunChunk] = []
            for done in run_jobs(chunks, self.executor):
                assert isinstance(done.job, RunChunk)
                if done.row is None and done.failure is not None and not done.failure.outside:
                    again += self._after_crash(done.job, done.failure)
                    continue
                missing += [] if done.failure is None else [done.failure.reason]
                if done.row is not None:
                    self._took(done.job, done.row["rows"], done.row["here"])
            chunks = again
        return missing

    def _took(self, chunk: RunChunk, rows: Sequence[Row], here: bool) -> None:
        """Rows of a chunk that was done; those of a machine that does not see the folder are written now."""
        if not here:
            for row in rows:
                chunk.store.note(chunk.number, chunk.attempt, row)
        self.tally.add(rows)

    def _after_crash(self, chunk: RunChunk, failure: Failure) -> list[RunChunk]:
        """What is to be done where a run took its process along: that run failed, the others go on."""
        begun = chunk.store.begun(chunk.number, chunk.attempt)
        if begun is None and len(chunk.runs) > 1:  # done where the folder is not seen: each by itself
            return [_of_runs(chunk, [run]) for run in chunk.runs]
        run = next((run for run in chunk.runs if run.key == begun), chunk.runs[0])
        row = run.row(chunk.store.settings, Ended(failure=failure))
        chunk.store.note(chunk.number, chunk.attempt, row)
        if len(chunk.runs) > 1:
            return [chunk]
        self.tally.add([row])
        return []


def _of_runs(chunk: RunChunk, runs: Sequence[Keyed]) -> RunChunk:
    return RunChunk(chunk.number, runs, chunk.scenario, chunk.store, chunk.attempt)


def _texts(settings: Mapping[str, Any]) -> str:
    """What of settings is text."""
    return repr([(name, value) for name, value in settings.items() if isinstance(value, str)])


def _compare(there: Mapping[str, str], here: Mapping[str, str], folder: Path) -> None:
    """Refuse a folder of another campaign.

    Raises:
        OutputError: it says what differs.
    """
    names = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    if not names:
        return
    named = [name for name in names if name != "runs of it"]
    said = [f"{name}: {_short(there.get(name))} there, {_short(here.get(name))} here" for name in named[:3]]
    what = "; ".join(said) or "the scenario, or the content of its files"
    raise OutputError(f"{folder} holds another campaign, which differs in {what}. Choose another folder with --out.")


def _short(text: str | None) -> str:
    return "none" if text is None else text if len(text) <= 60 else f"{text[:57]}..."


def make_campaign(scenario: RunnableScenario) -> Campaign:
    """The campaign of a scenario, whose every setting can be.

    Args:
        scenario: with a table ``[campaign]``.

    Raises:
        CosimError: there is none, or something in it cannot be.
    """
    table = scenario.table()
    if table.campaign is None:
        raise ScenarioError(
            f"{scenario.where}: a campaign needs a table [campaign]; for instance: runs = 1000 and "
            f"vary = {{ seed = {{ whole = [0, 99999] }} }}."
        )
    planned = planned_runs(scenario, table.campaign)
    plain = scenario.with_settings(_of_each_run(table))
    check_settings(plain, planned)
    contents: dict[str, str] = {}

    def key(settings: Mapping[str, Any]) -> str:
        texts = {name: value for name, value in settings.items() if isinstance(value, str)}
        if (content := contents.get(repr(texts))) is None:
            content = contents[repr(texts)] = table_content(plain.with_settings(texts).table(), plain.folder)
        return digest(content, json.dumps(jsonable(settings), sort_keys=True))

    units = {name: unit for name in planned[0].settings if (unit := setting_unit(plain, name)) is not None}
    return Campaign(scenario.copy(), plain, table.campaign, [Keyed(key(run.settings), run) for run in planned], units)


def _of_each_run(table: ScenarioTable) -> dict[str, Any]:
    """What is set in every run of a campaign.

    Certificates that are only warned of are not computed for each: that takes longer than the run, and changes no
    number; `cosim run` says them. Nor does an FMU that crashed once get a process of its own where nobody says so: a
    worker is one, and the words of a failure would follow from what was run before.
    """
    settings: dict[str, Any] = {"campaign": None}
    settings |= {"certificates": "ignore"} if table.certificates == "warn" else {}
    return settings | ({"master.isolate": "no"} if table.master.isolate is None else {})

"""Falsification of a scenario: runs of a search, on the one engine of runs, until one breaks an expectation; then it is
made small. Touches the folder that it is given.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from cosim.campaign.variables import VariedSettings
from cosim.errors import ScenarioError
from cosim.falsification.margins import Margin, expectations_of, margin_of
from cosim.falsification.search import RestartedSearch
from cosim.falsification.smallest import fewest, nearest
from cosim.falsification.weakness import Falsification
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor, make_executor
from cosim.runs.journal import Journal
from cosim.runs.keys import code_content
from cosim.runs.run import Run
from cosim.simulation.scenario import Scenario
from cosim.studies.distributions import Distribution
from cosim.studies.sampling_plans import drawn_from
from cosim.studies.sweep import make_sweep
from cosim.tuning.parameters import present_value
from fmus.cli.progress import Progress, Report, reported

_DEEPER = 5
"""Populations after the first that breaks something: what is broken by more needs fewer changes."""


def falsify(
    scenario: Scenario,
    values: Mapping[str, Iterable[Any] | Distribution] | VariedSettings,
    *,
    expectation: int | None = None,
    runs: int = 200,
    worst: bool = False,
    seed: int = 0,
    directory: str | Path | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    retry: bool = False,
    progress: Progress = None,
) -> Falsification:
    """Search for a run that breaks an expectation, and make it as small as it can be.

    The cost is the smallest `margin` of the expectations. The search is that of `RestartedSearch`, over the shares of
    the distributions. After the first run that breaks an expectation five populations follow, so that it is broken by
    more; then changes are left out as long as the same expectation stays broken, and numbers brought towards what the
    scenario has.

    Args:
        scenario: with expectations, all of them met as it is. values: names as for `Scenario.set`, each with a range or
            the values it takes; or what varies in a campaign, whose conditions every run meets that is judged.
        expectation: its number in the scenario, from 1; None for whichever is broken first.
        runs: of the search at most. worst: whether it goes on to the last of them, to what is broken most.
        seed: of the search. directory: of the journal; None for none. workers, scheduler: see `make_executor`.
        resume, retry: see `Journal`. progress: called with the number done and the number in all.

    Returns:
        What was found; nothing has been written but the journal.

    Raises:
        ScenarioError: there is nothing to break, or a name or a value cannot be; the scenario as it is breaks it, or
            cannot be run.
    """
    _demand_expectation(scenario, expectation)
    varied = values if isinstance(values, VariedSettings) else _varied(scenario, values, seed)
    if resume and directory is None:
        raise ScenarioError("A search is resumed from its folder: give directory=...")
    journal = None if directory is None else Journal(Path(directory), resume=resume, retry=retry)
    apart = Run(scenario, varied.settings(np.full(len(varied.drawn), 0.5))).apart
    with make_executor(workers, scheduler, apart=apart) as executor, reported(progress, "run") as report:
        nominal = {name: value for name in varied.drawn if isfinite(value := _present(scenario, name))}
        return _falsified(
            _Margins(scenario, varied, nominal, executor, journal, expectation, runs, report), seed, worst
        )


def _varied(scenario: Scenario, values: Mapping[str, Iterable[Any] | Distribution], seed: int) -> VariedSettings:
    """Names and values that can be."""
    if not values:
        raise ScenarioError("Nothing is varied: name settings with ranges, such as {'balises.spacing': (200, 900)}.")
    make_sweep(scenario, values, "latin", 1, seed)
    return VariedSettings({name: drawn_from(name, stated) for name, stated in values.items()})


@dataclass
class _Margins:
    """Margins of settings, by runs.

    Args:
        scenario: that is run. varied: what varies in it. nominal: what it has of that, of numbers. executor: where.
        journal: of the runs, or None. which: expectation, or None for all.
        most: runs of the search. report: of progress, or None. done: runs of the search so far. shrinking: others.
        failures: how many runs ended early, by reason.
    """

    scenario: Scenario
    varied: VariedSettings
    nominal: Mapping[str, float]
    executor: Executor
    journal: Journal | None
    which: int | None
    most: int
    report: Report | None
    done: int = 0
    shrinking: int = 0
    failures: Counter[str] = field(default_factory=Counter)

    def of(self, settings: Sequence[Mapping[str, Any]], *, searching: bool) -> list[Margin]:
        """The margin with each of some settings, in their order; infinite of a run that ended early, and without a run
        where they do not meet a condition.
        """
        rests_on = code_content(expectations_of)
        found, places = [Margin()] * len(settings), [n for n, each in enumerate(settings) if self._may_be(each)]
        jobs = [Run(self.scenario, settings[place], expectations_of, rests_on) for place in places]
        self.done += (len(settings) - len(places)) * searching  # so that a search ends where nothing may be
        for done in run_jobs(jobs, self.executor, self.journal):
            found[places[done.number]] = margin_of(done.row, self.which)
            self.failures.update([] if done.failure is None else [done.failure.reason])
            self.done += searching
            self.shrinking += not searching
            if self.report is not None:
                self.report(min(self.done, self.most), self.most)
        return found

    def _may_be(self, settings: Mapping[str, Any]) -> bool:
        """Whether settings meet the conditions, the rest as the scenario has it; without any change they may."""
        whole = {**self.nominal, **settings}
        known = settings and len(whole) == len(self.varied.drawn)
        return not known or self.varied.unmet(whole) is None

    def broken(self, settings: Sequence[Mapping[str, Any]]) -> list[bool]:
        """Whether the expectation is broken with each of some settings."""
        return [margin.broken for margin in self.of(settings, searching=False)]


def _falsified(margins: _Margins, seed: int, worst: bool) -> Falsification:
    as_it_is = margins.of([{}], searching=False)[0]
    _demand_met(as_it_is, margins)
    margins.shrinking = 0
    found, best, first = _search(margins, seed, worst)
    smallest: dict[str, Any] = {}
    margin = best
    if best.broken and best.evaluated is not None:
        margins.which = best.evaluated.number  # the same one stays broken
        smallest = nearest(fewest(found, margins.broken), margins.nominal, margins.broken)
        margin = margins.of([smallest], searching=False)[0]
    return Falsification(
        scenario=margins.scenario,
        nominal=margins.nominal,
        as_it_is=as_it_is,
        worst=best,
        found=found,
        smallest=smallest,
        margin=margin,
        searched=margins.done,
        first=first,
        shrunk=margins.shrinking,
        failures=margins.failures,
    )


def _search(margins: _Margins, seed: int, worst: bool) -> tuple[dict[str, Any], Margin, int | None]:
    """Settings of the run that is nearest to breaking an expectation or breaks it most, its margin, and the number of
    the first that breaks one, from 1.
    """
    varied, dimension = margins.varied, len(margins.varied.drawn)
    search, best, first, deeper = RestartedSearch(dimension, seed), Margin(), None, 0
    found = varied.settings(np.full(dimension, 0.5))
    while margins.done < margins.most and (worst or deeper <= _DEEPER):
        points = search.ask()
        before = margins.done
        settings = [varied.settings(point) for point in points]
        values = margins.of(settings[: margins.most - before], searching=True)
        for number, (margin, each) in enumerate(zip(values, settings, strict=False), start=before + 1):
            first = number if first is None and margin.broken else first
            if margin.value < best.value:
                best, found = margin, each
        deeper += first is not None
        if len(values) < len(points):
            break
        search.tell(points, np.array([margin.value for margin in values]))
    return found, best, first


def _demand_expectation(scenario: Scenario, which: int | None) -> None:
    count = len(scenario.table().expect)
    if not count:
        raise ScenarioError(f"{scenario.where} expects nothing that could be broken; give it a table [[expect]].")
    if which is not None and not 1 <= which <= count:
        raise ScenarioError(f"There is no expectation {which}; {scenario.where} has {count}, the first is 1.")


def _demand_met(as_it_is: Margin, margins: _Margins) -> None:
    """The scenario runs and breaks nothing as it is."""
    if as_it_is.value == inf:
        why = next(iter(margins.failures), "no expectation was judged")
        raise ScenarioError(f"{margins.scenario.where} cannot be searched, its run shows no expectation: {why}")
    if as_it_is.broken and as_it_is.evaluated is not None:
        shown = as_it_is.evaluated
        raise ScenarioError(
            f"{margins.scenario.where} breaks expectation {shown.number} as it is, without any change: {shown.name}: "
            f"{shown.text}. Search from a scenario that meets it, or name another one (--expectation N)."
        )


def _present(scenario: Scenario, name: str) -> float:
    """What the scenario has; NaN where it is no number."""
    try:
        value = present_value(scenario, name, name)
    except ScenarioError:
        value = getattr(scenario.table(), name, None)
    return float(value) if isinstance(value, int | float) else float("nan")

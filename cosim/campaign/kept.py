"""Whole results of some runs of a campaign, made again: failures, the worst, a sample. Writes their folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.campaign.chunk import KeptRun, campaign_measures
from cosim.campaign.store import FIXED
from cosim.errors import ScenarioError
from cosim.run.outcome import Outcome
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor

if TYPE_CHECKING:
    from cosim.campaign.campaign import Campaign
    from cosim.campaign.campaign_result import CampaignResult

_KEPT = "kept"


def keep_results(result: CampaignResult, campaign: Campaign, executor: Executor) -> CampaignResult:
    """The same result, with whole results of the runs that are to be kept; those that are there stay.

    Args:
        result: of the campaign. campaign: that it came of. executor: that makes them.

    Raises:
        KeyboardInterrupt: it was interrupted.
    """
    by_number = {run.planned.number: run.planned for run in campaign.runs}
    kept = {number: result.directory / _KEPT / f"run_{number:06d}" for number in _chosen(result)}
    lacking = [
        KeptRun(campaign.scenario, by_number[number].settings, folder)
        for number, folder in kept.items()
        if not folder.is_dir()
    ]
    for _ in run_jobs(lacking, executor):
        pass
    return replace(result, kept={number: folder for number, folder in kept.items() if folder.is_dir()})


def _chosen(result: CampaignResult) -> list[int]:
    """Numbers of the runs whose results are kept."""
    keep = result.table.keep
    worst = [number for name in result.shown for number in result.worst(name, keep.worst)]
    numbers = result.column("number")
    sample = np.random.default_rng(result.table.seed).choice(numbers, min(keep.sample, len(numbers)), replace=False)
    return sorted({*list(result.failures)[: keep.failures], *worst, *map(int, sample)})


@dataclass(frozen=True)
class RunAgain:
    """A run of a campaign that was made again.

    Args:
        number: of the run. outcome: of the new one. differs: measures that are not the same to the last bit, with both
            values, NaN where one has none.
    """

    number: int
    outcome: Outcome
    differs: dict[str, tuple[float, float]]


def run_again(result: CampaignResult, campaign: Campaign, key: str, out: Path | None, progress: Any) -> RunAgain:
    """Make a run of a campaign again, and compare its numbers with its row.

    Args:
        result: of the campaign. campaign: that it came of. key: of the run, or the first digits of it.
        out: folder for its results; None for none. progress: as for `Scenario.run`.

    Raises:
        ScenarioError: no run has this key, or several.
    """
    found = [run for run in campaign.runs if run.key.startswith(key)]
    row = next((row for row in result.rows.to_pylist() if found and row["key"] == found[0].key), None)
    if len(found) != 1 or row is None:
        count = f"{len(found)} runs have" if len(found) > 1 else "no run has"
        raise ScenarioError(f"{result.directory}: {count} a key that begins with {key!r}; the column key holds them.")
    planned = found[0].planned
    outcome = campaign.scenario.run(overrides=planned.settings, progress=progress, warn=lambda _: None)
    if out is not None:
        outcome.with_summary(sweep_settings=dict(planned.settings)).write(out)
    now, before = campaign_measures(outcome), {n: row[n] for n in _numbers(result) if row[n] is not None}
    names = dict.fromkeys([*before, *now])
    pairs = {name: (before.get(name, np.nan), now.get(name, np.nan)) for name in names}
    differs = {n: (a, b) for n, (a, b) in pairs.items() if not (a == b or (isnan(a) and isnan(b)))}
    return RunAgain(planned.number, outcome, differs)


def _numbers(result: CampaignResult) -> Sequence[str]:
    others = {*FIXED, *result.names}
    return [name for name in result.rows.column_names if name not in others]

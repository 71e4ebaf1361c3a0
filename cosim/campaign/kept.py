"""Whole results of some runs of a campaign, made again: failures, the worst, a sample. Writes their folders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cosim.campaign.campaign_result import CampaignResult
from cosim.campaign.chunk import KeptRun
from cosim.runs.engine import run_jobs
from cosim.runs.executors import Executor
from cosim.runs.runnable import RunnableScenario

_KEPT = "kept"


def keep_results(
    result: CampaignResult, scenario: RunnableScenario, settings: Mapping[int, Mapping[str, Any]], executor: Executor
) -> CampaignResult:
    """The same result, with whole results of the runs that are to be kept; those that are there stay.

    Args:
        result: of the campaign. scenario: that is varied. settings: of all runs, by their numbers. executor: that
            makes them.

    Raises:
        KeyboardInterrupt: it was interrupted.
    """
    kept = {number: result.directory / _KEPT / f"run_{number:06d}" for number in _chosen(result)}
    lacking = [KeptRun(scenario, settings[number], folder) for number, folder in kept.items() if not folder.is_dir()]
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

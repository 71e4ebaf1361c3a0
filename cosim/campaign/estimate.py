"""How long and how large a campaign will be, measured on a few of its runs. Writes nothing."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from statistics import mean
from typing import Any

from cosim.campaign.campaign import Campaign
from cosim.campaign.chunk import campaign_measures
from cosim.runs.executors import make_executor
from cosim.runs.run import Run

_RUNS = 4
_NUMBER, _TEXT = 8, 70
"""Bytes of a number, and of the key with what else a row has, before compression."""


@dataclass(frozen=True)
class CampaignEstimate:
    """What a campaign will take.

    Args:
        runs: in all. seconds: of one run, of those that were measured [s]. measured: how many that were, after a first
            one that is not counted. failed: how many of them failed. size: of the table at most [bytes].
    """

    runs: int
    seconds: float
    measured: int
    failed: int
    size: float

    def text(self, workers: int) -> str:
        """It in a sentence.

        Args:
            workers: processes at a time.
        """
        each = f"{self.seconds:.2g} s each ({self.measured} measured, {self.failed} of which failed)"
        took = _duration(self.runs * self.seconds / workers)
        return f"{self.runs} runs, {each}: about {took} with {workers} workers, {self.size / 1e6:.3g} MB at most."

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def estimated(campaign: Campaign) -> CampaignEstimate:
    """Measure a few runs of a campaign, the first of which only warms caches.

    Args:
        campaign: to be estimated.
    """
    step = max(1, len(campaign) // _RUNS)
    chosen = [campaign.runs[0], *campaign.runs[::step][:_RUNS]]
    jobs = [Run(campaign.scenario, run.planned.settings, campaign_measures) for run in chosen]
    with make_executor(apart=jobs[0].apart) as executor:
        ended = [left for _, left in executor.each(jobs)]
    known = [left for left in ended[1:] if left.seconds == left.seconds]  # a crash has no time
    columns = max((len(left.row or ()) for left in ended), default=0) + len(campaign.names)
    seconds = mean(left.seconds for left in known) if known else float("nan")
    failed = sum(left.failure is not None for left in ended[1:])
    return CampaignEstimate(
        len(campaign), seconds, len(chosen) - 1, failed, len(campaign) * float(_TEXT + _NUMBER * columns)
    )


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.2g} h"

"""One run of a campaign made again from its key, and compared with its row. Writes the folder that it is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np

from cosim.campaign.campaign import Campaign
from cosim.campaign.campaign_result import CampaignResult
from cosim.campaign.chunk import campaign_measures
from cosim.campaign.store import FIXED
from cosim.errors import ScenarioError
from cosim.run.outcome import Outcome


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

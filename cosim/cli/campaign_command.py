"""``cosim campaign``: the many runs that a scenario's table ``[campaign]`` asks for, as a table."""

from __future__ import annotations

import argparse
from pathlib import Path

from cosim.campaign.campaign import Campaign, make_campaign
from cosim.campaign.estimate import estimated
from cosim.cli.arguments import MANY_RUNS, QUIET, many_runs, positive, scenario_arguments
from cosim.cli.scenarios import load_scenario
from cosim.errors import ScenarioError
from cosim.results.results_folder import check_writable
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar

DONE, _SOME_FAILED = 0, 1
_LIMIT = 100_000
"""Runs from which on a campaign is begun with ``--yes`` only."""

GROUP = "Study"
PLACE = 2
HELP = "run thousands of disturbed runs of a scenario"
LOOKS = False
EXAMPLES = (
    "cosim campaign vendor.toml --dry-run",
    "cosim campaign vendor.toml --runs 10000 --workers 8 --out results/night --resume",
)
PARSER = {
    "description": (
        "Run what the table [campaign] of a scenario asks for: its settings drawn from distributions, thousands of "
        "times. Rows go to Parquet files; a run that fails, crashes or hangs is a row with its cause. What was stopped "
        "or killed goes on with --resume."
    ),
    "epilog": "Exit codes: 0 all runs done, 1 a run failed, 2 error or interrupted; rows of runs are in the folder.",
}
ARGUMENTS = (
    *scenario_arguments(default=None),
    argument("--runs", type=positive, metavar="N", help="number of points, in place of campaign.runs"),
    argument("--seed", type=int, metavar="N", help="of the points, in place of campaign.seed"),
    argument("--out", metavar="DIR", help="folder of the campaign (default: results/NAME_campaign)"),
    argument("--dry-run", action="store_true", help="say how many runs, how long and how large, measured on a few"),
    argument("--yes", action="store_true", help=f"begin also with more than {_LIMIT} runs"),
    *MANY_RUNS,
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Run, as the options ask."""
    campaign = _campaign(options)
    if options.dry_run:
        found = estimated(campaign)
        return Output(campaign.first_screen(), found.to_data(), verdict=found.text(options.workers))
    if len(campaign) > _LIMIT and not options.yes:
        raise ScenarioError(f"{len(campaign)} runs are more than {_LIMIT}: see --dry-run, and confirm with --yes.")
    name = f"{campaign.scenario.name}_campaign"
    directory = check_writable(Path(options.out) if options.out is not None else Path("results") / name)
    with ProgressBar("run", silent=options.quiet or options.json) as bar:
        result = campaign.run(directory, progress=bar, **many_runs(options))
    data = {"runs": len(result), "failed": len(result.failures), "causes": result.causes(), "missing": result.missing}
    failed = bool(result.failures or result.missing)
    return Output(
        result.first_screen()[1:],
        data | {"kept": {str(number): folder for number, folder in result.kept.items()}},
        {"campaign": directory},
        code=_SOME_FAILED if failed else DONE,
        verdict=result.sentence,
        role="bad" if failed else "good",
    )


def _campaign(options: argparse.Namespace) -> Campaign:
    """What is run.

    Raises:
        CosimError: the scenario has no campaign, or something in it cannot be.
    """
    scenario = load_scenario(options)
    stated = {"campaign.runs": options.runs, "campaign.seed": options.seed}
    if scenario.table().campaign is not None:
        scenario = scenario.with_settings({name: value for name, value in stated.items() if value is not None})
    return make_campaign(scenario)

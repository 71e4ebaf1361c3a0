"""``cosim rerun``: results made again from what their folder holds, and compared with those that are there."""

from __future__ import annotations

import argparse
from pathlib import Path

from cosim.campaign.again import run_again
from cosim.campaign.campaign import SCENARIO, make_campaign
from cosim.campaign.campaign_result import CampaignResult
from cosim.cli.arguments import QUIET, settings_argument
from cosim.cli.output import ignore, print_notice
from cosim.cli.scenarios import parse_setting, simulated_time_bar
from cosim.errors import ScenarioError
from cosim.provenance import rerun
from cosim.simulation.scenario import Scenario
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.cli.parsers import no_number

EQUAL, DIFFERS, ERROR = 0, 1, 2
DESCRIPTION = (
    "Run again what a results folder holds, and compare with the results in it. The folder may have been moved, and "
    "the FMUs it was made from may be gone. Exit codes: 0 bit-identical or within the tolerance, 1 differs, 2 it "
    "cannot be run again."
)


def _share(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(no_number(text)) from None
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be zero or positive (got {text})")
    return value


GROUP = "Run"
PLACE = 3
HELP = "run results again and compare"
LOOKS = False
EXAMPLES = (
    "cosim rerun results/vendor",
    "cosim rerun results/vendor --set plant.mass=82e3",
    "cosim rerun results/night --key 51957cdc --out results/worst",
)
PARSER = {"description": DESCRIPTION}
ARGUMENTS = (
    argument("directory", metavar="DIR", help="a results folder, or with --key that of a campaign"),
    argument("--key", metavar="KEY", help="of a campaign: the run whose key begins so, as `cosim campaign` says it"),
    argument("--out", metavar="OTHER", help="folder for the new results (default: only the verdict is kept)"),
    settings_argument(),
    argument(
        "--tolerance",
        type=_share,
        metavar="SHARE",
        help="how far a signal may differ, as a share of its range (default: 1e-4)",
    ),
    argument(
        "--trust",
        action="store_true",
        help="go on where files of the folder were edited since, or are code that was never run here",
    ),
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Run again and compare, as the options ask."""
    if options.key is not None:
        return _run_of_campaign(options)
    settings = dict(parse_setting(setting) for setting in options.settings)
    bar = simulated_time_bar(silent=options.quiet or options.json)
    out = None if options.out is None else Path(options.out).absolute()
    try:
        again = rerun(
            options.directory,
            out=out,
            overrides=settings,
            tolerance=options.tolerance,
            trust=options.trust,
            progress=bar,
            building=ignore if options.quiet else print_notice,
        )
    finally:
        bar.close()
    failed = again.outcome.failure is not None and again.outcome.failure != again.stored_failure
    return Output(
        again.details(options.verbose),
        again.to_dict(),
        again.paths,
        ERROR if failed else EQUAL if again.equal else DIFFERS,
        [f"the new run ended early: {again.outcome.failure}"] if failed else [],
        verdict=again.verdict_line,
        role="good" if again.equal else "bad",
    )


def _run_of_campaign(options: argparse.Namespace) -> Output:
    """Make a run of a campaign again: its numbers are to be those of its row to the last bit."""
    if options.settings or options.tolerance is not None:
        raise ScenarioError("--key: a run of a campaign is made again as it was, without --set and --tolerance.")
    folder, out = Path(options.directory), None if options.out is None else Path(options.out).absolute()
    campaign = make_campaign(Scenario.load(folder / SCENARIO))
    result = CampaignResult.read(folder, campaign.table, campaign.names)
    bar = simulated_time_bar(silent=options.quiet or options.json)
    try:
        again = run_again(result, campaign, options.key, out, bar)
    finally:
        bar.close()
    told = [f"{name}: {before!r} in the row, {now!r} now" for name, (before, now) in again.differs.items()]
    verdict = f"run {again.number}: " + (f"{len(told)} numbers differ" if told else "bit-identical with its row")
    return Output(
        again.outcome.first_screen(),
        {"run": again.number, "equal": not told, "differs": again.differs},
        {} if out is None else {"results": out},
        DIFFERS if told else EQUAL,
        told,
        verdict=verdict,
        role="bad" if told else "good",
    )

"""``cosim falsify``: a search for a run that breaks an expectation, made small and written as a scenario that fails."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.campaign.plan import campaign_variables
from cosim.campaign.variables import VariedSettings
from cosim.cli.arguments import MANY_RUNS, QUIET, many_runs, positive, scenario_arguments
from cosim.cli.scenarios import load_scenario
from cosim.cli.sweep_command import varied_values
from cosim.errors import ScenarioError
from cosim.falsification.falsify import falsify
from cosim.results.results_folder import check_writable
from cosim.simulation.scenario import Scenario
from cosim.studies.fault_draws import fault_ranges
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar

_MET, _BROKEN = 0, 1

GROUP = "Study"
PLACE = 5
HELP = "search for a run that breaks an expectation"
LOOKS = False
EXAMPLES = (
    "cosim falsify vendor.toml --vary balises.spacing=200..900 --vary plant.mass=60e3..120e3",
    "cosim falsify vendor.toml --faults --expectation 2 --runs 500 --workers 4",
)
PARSER = {
    "description": (
        "Search, over what varies, for a run that breaks an expectation of the scenario (CMA-ES, started again and "
        "again from random points). What is found is made small: changes are taken back, and numbers brought towards "
        "what the scenario has. It is written as a scenario that fails now, ready as a regression test."
    ),
    "epilog": "Exit codes: 0 nothing was found, 1 an expectation is broken, 2 error or interrupted; --resume goes on.",
}
ARGUMENTS = (
    *scenario_arguments(default=None),
    argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="what may vary, may be repeated: NAME=70e3..90e3 a range; NAME=1,2,5 a list; NAME=0:10 whole numbers",
    ),
    argument("--faults", action="store_true", help="vary the faults of the scenario as well, in their own ranges"),
    argument("--expectation", type=positive, metavar="N", help="that is to be broken, from 1 (default: any)"),
    argument("--runs", type=positive, default=200, metavar="N", help="of the search at most (default: 200)"),
    argument("--worst", action="store_true", help="go on to the last run, to what is broken most"),
    argument("--seed", type=int, default=0, help="of the search (default: 0)"),
    argument("--out", metavar="DIR", help="folder for the results (default: results/NAME_falsified)"),
    *MANY_RUNS,
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """What the search that the options ask for has found, as it is written in the folder.

    Raises:
        CosimError: there is nothing to search, or the scenario breaks an expectation as it is.
    """
    scenario = load_scenario(options)
    values = _values(scenario, options)
    folder = Path(options.out) if options.out is not None else Path("results") / f"{scenario.name}_falsified"
    directory = check_writable(folder).absolute()
    with ProgressBar("run", silent=options.quiet or options.json) as bar:
        found = falsify(
            scenario,
            values,
            expectation=options.expectation,
            runs=options.runs,
            worst=options.worst,
            seed=options.seed,
            directory=directory,
            **many_runs(options),
            progress=bar,
        )
    files = found.write(directory)
    if found.broken:
        return Output(found.details(), found.to_data(), files, code=_BROKEN, verdict=found.verdict, role="bad")
    return Output(found.details(), found.to_data(), files, code=_MET, verdict=found.verdict)


def _values(scenario: Scenario, options: argparse.Namespace) -> dict[str, Any] | VariedSettings:
    """What varies: as the options say, or else as the scenario's campaign does.

    Raises:
        CosimError: nothing does, or something in the campaign cannot be.
    """
    faults = fault_ranges(scenario) if options.faults else {}
    if options.faults and not faults:
        raise ScenarioError("--faults: the scenario has no fault; give it a component such as wheel_fault.")
    values = {**faults, **varied_values(options.vary)}
    campaign = scenario.table().campaign
    if not values and campaign is not None:
        return campaign_variables(scenario, campaign)
    if not values:
        raise ScenarioError(
            "Nothing is varied: give --vary NAME=LOW..HIGH, --faults for a scenario with faults, or a table [campaign]."
        )
    return values

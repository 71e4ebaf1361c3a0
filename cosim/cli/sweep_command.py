"""``cosim sweep``: one scenario run many times with some values changed; a folder for each run, a table of all."""

from __future__ import annotations

import argparse
import json
import logging
import re
import tomllib
from pathlib import Path
from typing import Any

from cosim import studies
from cosim.cli.arguments import FIGURE_FILES, MANY_RUNS, QUIET, many_runs, positive, scenario_arguments
from cosim.cli.scenarios import load_scenario, parse_setting
from cosim.errors import ScenarioError, nearest
from cosim.results.results_folder import FIGURES, check_writable
from cosim.scenario.override import CASE
from cosim.simulation.scenario import Scenario
from cosim.studies.distributions import Range, uniform
from cosim.studies.sampling_plans import MOST
from cosim.studies.sweep import Sweep
from cosim.studies.sweep_files import write_figures
from cosim.studies.warnings_of_runs import PAGE, counted, warning_lines
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar

LOG = logging.getLogger(__name__)
DONE, _SOME_FAILED = 0, 1
RANGE = re.compile(r"(-?\d+):(-?\d+)(?::(-?\d+))?")
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
SPAN = re.compile(rf"({NUMBER})\.\.({NUMBER})")
_WITH_COMMA = re.compile(r"(?<![\d.])(-?\d+),(0\d+)")
"""A decimal comma: no number begins with a zero and another digit."""
_VARY = """values to vary, may be repeated: NAME=70e3,80e3 a list; NAME=0:10 the whole numbers from 0 to 9; NAME=70e3..90e3
a range, with --samples"""  # noqa: E501

GROUP = "Study"
PLACE = 1
HELP = "run a scenario with varied values"
LOOKS = False
EXAMPLES = (
    "cosim sweep vendor.toml --vary plant.mass=70e3,80e3,90e3",
    "cosim sweep vendor.toml --vary seed=0:20 --workers 4 --out results/seeds",
)
PARSER = {
    "description": (
        "Run a scenario once for each combination of some values. A run that fails does not stop the others."
    ),
    "epilog": (
        "Exit codes: 0 all runs done, 1 a run failed, 2 error or interrupted; runs that were done are in the folder."
    ),
}
ARGUMENTS = (
    *scenario_arguments(default=None),
    argument("--vary", action="append", default=[], metavar="NAME=VALUES", help=_VARY),
    argument("--cases", action="store_true", help="run all cases of the scenario, each with all --vary"),
    argument("--by", metavar="NAME", help="one line for each value of NAME, such as case: means of its runs"),
    argument(
        "--zip", action="store_true", help="first values together, then second ones, ... instead of all combinations"
    ),
    argument("--samples", type=positive, metavar="N", help="N points of a Latin hypercube over ranges and lists"),
    argument("--seed", type=int, default=0, help="of the points (default: 0)"),
    argument("--out", metavar="DIR", help="folder for the results (default: results/NAME_sweep)"),
    argument("--table-only", action="store_true", help="keep the table, and no results folder for each run"),
    *MANY_RUNS,
    FIGURE_FILES,
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Run, and write each run as soon as it is done, as the options ask."""
    scenario = load_scenario(options)
    sweep = _sweep(scenario, options)
    directory = check_writable(
        Path(options.out) if options.out is not None else Path("results") / f"{scenario.name}_sweep"
    )
    with ProgressBar("run", silent=options.quiet or options.json) as bar:
        result = sweep.run(
            progress=bar,
            keep=False,
            directory=directory.absolute(),
            folders=not options.table_only,
            **many_runs(options),
        )
    if options.by is not None:
        studies.write_groups(result, options.by, directory)
    table = result.shown() if options.by is None else studies.groups_table(result, options.by)
    warnings = result.warnings
    for line in warning_lines(warnings, str(directory / PAGE)):
        LOG.warning("%s", line)
    doubts = [text for text in (result.unmet, counted(len(warnings)) if warnings else "") if text]
    done = f"{len(result) - len(result.failed)} of {len(result)} runs done"
    ending = f"{', '.join([done, *doubts])}: {directory}"
    data = json.loads((directory / "index.json").read_text(encoding="utf-8"))
    drawn = write_figures(result, directory, options.figures)
    files = {"page": directory / PAGE} | ({"figures": directory / FIGURES} if drawn else {})
    if result.failed:
        return Output([table], data, files, code=_SOME_FAILED, verdict=ending, role="bad")
    return Output([table], data, files, verdict=ending, role="doubtful" if doubts else "good")


def _sweep(scenario: Scenario, options: argparse.Namespace) -> Sweep:
    """What is run.

    Raises:
        ScenarioError: options exclude one another, or nothing is varied.
    """
    if options.zip and options.samples is not None:
        raise ScenarioError("--zip and --samples exclude each other.")
    mode: Any = "latin" if options.samples is not None else "zip" if options.zip else "grid"
    values = (_cases(scenario, options.settings, options.zip) if options.cases else {}) | varied_values(options.vary)
    if not values:
        raise ScenarioError("Nothing is varied: give --vary NAME=VALUES, or --cases for a scenario with cases.")
    if options.cases and not scenario.cases:
        raise ScenarioError(f"--cases: {scenario.name} has no cases; expected tables [cases.NAME] in it.")
    if options.by is not None and options.by not in values:
        raise ScenarioError(f"--by {options.by}: this is not varied; {nearest(options.by, list(values))}")
    if options.samples is None and (ranges := [name for name, stated in values.items() if isinstance(stated, Range)]):
        raise ScenarioError(
            f"--vary {ranges[0]}: a range is sampled; say with --samples N at how many points, or list values: a,b."
        )
    return scenario.vary(values, mode, count=options.samples, seed=options.seed)


def _cases(scenario: Scenario, settings: list[str], zipped: bool) -> dict[str, list[Any]]:
    """All cases, and what ``--set`` says of values that a case sets too: that wins, as it does for one run."""
    set_by_cases = {name for values in scenario.cases.values() for name in values}
    stated = dict(parse_setting(text) for text in settings)
    times = len(scenario.cases) if zipped else 1
    return {CASE: list(scenario.cases)} | {
        name: [value] * times for name, value in stated.items() if name in set_by_cases
    }


def varied_values(stated: list[str]) -> dict[str, Any]:
    """Names and values of all ``--vary``.

    Args:
        stated: words behind each.

    Raises:
        ScenarioError: one is not ``NAME=VALUES``, or a name is given twice.
    """
    values: dict[str, Any] = {}
    for text in stated:
        name, sign, listed = (part.strip() for part in text.partition("="))
        if not (name and sign and listed):
            raise ScenarioError(
                f"--vary {text!r}: expected NAME=VALUES, for instance --vary locomotive.mass=70e3,80e3."
            )
        if name in values:
            raise ScenarioError(f"--vary {name} is given twice; write all values in one list.")
        values[name] = parse_values(listed)
    return values


def parse_values(text: str) -> Any:
    """``70e3,80e3``, ``0:10``, ``0:10:2`` or ``70e3..90e3`` as a list or a range; each value TOML where it is that,
    else text.

    Raises:
        ScenarioError: a range without numbers in it.
    """
    if (match := RANGE.fullmatch(text)) is not None:
        numbers = range(int(match[1]), int(match[2]), int(match[3] or 1) or 1)
        if not numbers:
            raise ScenarioError(f"--vary: {text} holds no numbers; 0:10 are those from 0 to 9.")
        return list(numbers) if len(numbers) <= MOST else numbers  # too many are refused by their number, not listed
    if (match := SPAN.fullmatch(text)) is not None:
        try:
            return uniform(float(match[1]), float(match[2]))
        except ScenarioError as error:
            raise ScenarioError(f"--vary: {text}: {error}") from error
    if ".." in text:
        raise ScenarioError(f"--vary: {text}: expected a range of two numbers, such as 70e3..90e3, with points.")
    try:
        return list(tomllib.loads(f"value = [{text}]")["value"])
    except tomllib.TOMLDecodeError:
        if (found := _WITH_COMMA.search(text)) is not None:
            meant = f"{found[1]}.{found[2]}"
            raise ScenarioError(f"--vary: {text}: a comma stands between values; write {meant} with a point.") from None
        return [parse_setting(f"value={part}")[1] for part in text.split(",")]

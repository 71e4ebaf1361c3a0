"""``cosim choose``: which observer to use beside a train, how good it is, and why not the others."""

from __future__ import annotations

import argparse
import logging
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cosim.choice.allowance import Allowance
from cosim.choice.choice import INTERRUPTED, Choice
from cosim.choice.choose import FURTHER, SEEDS, choose, scenario_for_fmu
from cosim.choice.replayed_run import replayed
from cosim.choice.trial import Trial
from cosim.cli.arguments import FIGURE_FILES, QUIET, TRUST_RESULTS, positive, settings_argument
from cosim.cli.output import ignore, print_notice
from cosim.cli.scenarios import load_scenario
from cosim.cli.stated_units import ASSUME
from cosim.errors import OutputError, RunError, ScenarioError
from cosim.results.results_folder import check_writable
from cosim.simulation.scenario import Scenario
from fmus.cli.commands import argument, one_of
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar
from plant_models.hybrid.casadi_package import demand_casadi

_DONE, _NOTHING_SAFE = 0, 1
_SCENARIOS = (".toml", ".ssp")


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise argparse.ArgumentTypeError("expected names separated by commas")
    return names


GROUP = "Observers"
PLACE = 1
HELP = "which observer to use beside a train, how good it is, and why not the others"
LOOKS = False
FORMER = {"benchmark-observers": "cosim choose SCENARIO"}
EXAMPLES = (
    "cosim choose vendor.fmu",
    "cosim choose vendor.toml --write chosen.toml",
    "cosim choose vendor.toml --observers odometer_reset --replay 3 --write third.toml",
)
PARSER = {
    "description": (
        "Run the train of a scenario, or a plant FMU, and play it back to every preset of all train observers side by "
        "side: as it is, and disturbed with errors of both signs (mass, resistance, slopes, noise, wear, losses, jams "
        "and skids). First comes what stays within the allowance in all runs, then the smallest position error."
    ),
    "epilog": (
        "Exit codes: 0 an observer is safe, 1 none is (--allowance grants more), 2 error or interrupted: what was "
        "evaluated is printed alone."
    ),
}
ARGUMENTS = (
    argument("scenario", metavar="SCENARIO|FMU", help="a shipped scenario, a file (.toml or .ssp), or a plant (.fmu)"),
    settings_argument(),
    TRUST_RESULTS,
    ASSUME,
    argument(
        "--observers",
        type=_names,
        metavar="A,B,...",
        help="components of the scenario, shipped observers, NAME:PRESET or file.py:Class (default: the scenario's "
        "own, and every preset of all train observers)",
    ),
    argument("--seeds", type=int, default=SEEDS, metavar="N", help=f"disturbed runs of all (default: {SEEDS})"),
    argument(
        "--further",
        type=int,
        default=FURTHER,
        metavar="N",
        help=f"disturbed runs that the best get besides, to see what fails rarely (default: {FURTHER})",
    ),
    argument(
        "--allowance",
        default=None,
        metavar="M+PERCENT%",
        help="what a position may be off: metres, plus per cent of the distance since the last balise (default: 5+5%%, "
        "SUBSET-041)",
    ),
    one_of(
        argument("--record", metavar="DIR", help="keep the nominal run as a results folder"),
        argument("--from", metavar="DIR", dest="recorded", help="play back this results folder instead of new runs"),
    ),
    argument(
        "--replay",
        metavar="RUN",
        help="one run again, of the one observer of --observers: the number of a seed, harder:NUMBER or nominal; "
        "--write then writes the scenario that plays it, in which cosim run shows the same error",
    ),
    argument("--workers", type=positive, default=1, metavar="N", help="processes at a time (default: 1)"),
    argument("--write", type=Path, metavar="FILE", help="write the scenario with the observer in it"),
    argument("--force", action="store_true", help="replace the file of --write where it exists"),
    argument("--out", metavar="DIR", help="also write page and data to this folder"),
    FIGURE_FILES,
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Choose, and write where the options ask for it."""
    if options.seeds == 0:
        raise ScenarioError("--seeds 0: the nominal run alone says nothing of what may go wrong; 1 at least.")
    demand_casadi()  # hundreds of runs in plain NumPy would take hours
    if options.write is not None and options.write.exists() and not options.force:
        raise OutputError(f"{options.write} exists already; choose another name, or replace it with --force.")
    if options.figures and options.out is None:
        raise OutputError("--figures draws beside the page: say with --out DIR where that is to go.")
    for folder in (options.out, options.record):
        if folder is not None:
            check_writable(folder)
    with ProgressBar("run", silent=options.quiet or options.json, lines_after=0.0) as bar:
        if options.replay is not None:
            return _replayed(options, bar)
        choice = _chosen(options, bar)
    files: dict[str, Path] = {}
    if options.write is not None and choice.found and not choice.stopped:
        files["scenario"] = choice.with_best().save(options.write)
    if options.out is not None:
        files |= choice.write(options.out, figures=options.figures)
    verdict = choice.answer if choice.found else ""
    safe = choice.found and choice.best.safe
    return Output(
        [*choice.parts(), _again(choice)],
        choice.to_data(),
        files,
        code=_DONE if safe else _NOTHING_SAFE,
        error=_error(choice),
        verdict=verdict,
        role="good" if safe else "bad",
    )


def _again(choice: Choice) -> str:
    """How the worst run of the best observer is done again, in a line; empty where there is none."""
    if not choice.found:
        return ""
    run, name = choice.best.worst[0].removeprefix("seed "), choice.best.candidate.asked
    return f"Its worst run as a scenario: the same command with --observers {name} --replay {run} --write worst.toml"


def _replayed(options: argparse.Namespace, bar: ProgressBar) -> Output:
    """One run again, and the scenario of it.

    Raises:
        CosimError: there is no such run, or not one observer is named.
    """
    if len(options.observers or ()) != 1:
        raise ScenarioError("--replay does a run of one observer again: say which with --observers NAME.")
    if options.out is not None:
        raise OutputError("--replay makes no page: write its scenario by --write FILE.toml, and cosim run makes one.")
    allowance = Allowance() if options.allowance is None else Allowance.of(options.allowance)
    trial = Trial(_scenario(options), options.observers, allowance, recorded=options.recorded)
    with tempfile.TemporaryDirectory() as scratch:
        beside = scratch if options.write is None else options.write.with_suffix("").as_posix() + "_recording"
        folder = Path(options.record or beside)
        found = replayed(trial, options.replay, folder, building=_building(options, bar))
        files = {} if options.write is None else {"scenario": found.scenario.save(options.write)}
    return Output(found.parts(), found.to_data(), files, verdict=found.answer, role="good" if found.safe else "bad")


def _error(choice: Choice) -> BaseException | None:
    """Why there is no whole answer."""
    if choice.stopped == INTERRUPTED:
        return KeyboardInterrupt()
    if choice.stopped:
        return RunError(choice.stopped)
    return None if choice.found else RunError(choice.answer)


def _building(options: argparse.Namespace, bar: ProgressBar) -> Callable[[str], None]:
    """Prints which observers are compiled."""

    def notice(text: str) -> None:
        bar.clear()
        print_notice(text)

    return ignore if options.quiet else notice


def _chosen(options: argparse.Namespace, bar: ProgressBar) -> Choice:
    more: dict[str, Any] = {
        "seeds": options.seeds,
        "further": options.further,
        "allowance": None if options.allowance is None else Allowance.of(options.allowance),
        "record": options.record,
        "recorded": options.recorded,
        "workers": options.workers,
        "progress": lambda what, done, total: bar(done, total, what),
        "warn": logging.getLogger("cosim").warning,
        "building": _building(options, bar),
    }
    return choose(_scenario(options), options.observers, **more)


def _scenario(options: argparse.Namespace) -> Scenario:
    """The scenario that is named, or that of a starter for the FMU that is.

    Raises:
        ScenarioError: the file is neither.
    """
    file = Path(options.scenario)
    if file.suffix.lower() == ".fmu":
        return load_scenario(options, scenario_for_fmu(options.scenario, options.assume))
    if options.assume:
        raise ScenarioError(
            f"--assume belongs to an FMU; what is known of those in {file} stands in their tables "
            "[components.NAME.units]."
        )
    if file.is_file() and file.suffix.lower() not in _SCENARIOS:
        raise ScenarioError(f"{file} is no scenario (.toml or .ssp) and no train (.fmu).")
    return load_scenario(options)

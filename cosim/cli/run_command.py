"""``cosim run``: one scenario, result files, report, table."""

from __future__ import annotations

import argparse
import json
import logging
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from cosim import studies
from cosim.cli.arguments import FIGURE_FILES, MANY_RUNS, QUIET, many_runs, positive, scenario_arguments
from cosim.cli.output import ignore, print_notice
from cosim.cli.scenarios import load_scenario, simulated_time_bar
from cosim.errors import OutputError, ScenarioError
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.consistency_table import consistency_table
from cosim.evaluation.cost import cost_table
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.fault_table import fault_table
from cosim.expectations.evaluated import evaluated_table
from cosim.process.last_call import LAST_CALL
from cosim.results.results_folder import check_writable
from cosim.results.salvage import left_rows, rescue
from cosim.results.unfinished import UNFINISHED, only_run
from cosim.run.outcome import Outcome
from cosim.simulation.scenario import Scenario
from cosim.studies.warnings_of_runs import PAGE, warning_lines
from fmus.cli.colour import Role
from fmus.cli.commands import Argument, argument
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar
from fmus.tables.table import Table

LOG = logging.getLogger(__name__)
DONE, NOT_AS_ASKED, ERROR = 0, 1, 2
_LONG = 2.0
"""A run at least this long says where its time went [s]."""
_ROLES: dict[str, Role] = {"good": "good", "doubt": "doubtful", "bad": "bad"}
CALL_LOG = "calls.log"
SEEDS = "seeds"
"""Folder of the sweep over seeds, among the results."""

GROUP = "Run"
PLACE = 1
HELP = "run a scenario"
LOOKS = False
EXAMPLES = (
    "cosim run freight_profile_d",
    "cosim run vendor.toml --out results/today",
    "cosim run vendor.toml --set plant.mass=82e3 --seed 7",
    "cosim run vendor.toml --seeds 20 --workers 4",
)
PARSER = {
    "description": "Run a scenario: shipped, from a TOML file, or from a system structure package (SSP).",
    "epilog": (
        "Exit codes: 0 done, 1 an expectation of the scenario is not met (or --strict), 2 the run failed or could "
        "not begin."
    ),
}


def _setting(option: str, key: str, metavar: str, text: str) -> Argument:
    """An option that stands for ``--set KEY=``."""
    return argument(option, action="append", type=f"{key}={{}}".format, dest="settings", metavar=metavar, help=text)


ARGUMENTS = (
    *scenario_arguments(),
    argument("--out", metavar="DIR", default=None, help="folder for results and report (default: results/NAME)"),
    _setting("--seed", "seed", "N", "seed of the run: all chance"),
    _setting(
        "--isolate",
        "master.isolate",
        "WHAT",
        "component: each FMU by path gets a process of its own, which a crash takes along; no: none does",
    ),
    argument(
        "--seeds",
        type=positive,
        metavar="N",
        help="also run the seeds 0 to N - 1, a sweep in the folder seeds, and report medians and quartiles",
    ),
    *MANY_RUNS,
    argument("--no-report", action="store_true", help="write result files only"),
    FIGURE_FILES,
    argument(
        "--strict", action="store_true", help="refuse an SSP of wrong form; exit with 1 when the run gave warnings"
    ),
    argument(
        "--log-calls",
        nargs="?",
        const="",
        metavar="FILE",
        help="log every call of every component to FILE (default: calls.log among the results)",
    ),
    argument(
        "--stream",
        action="store_true",
        help="write results while the run goes on, as table.npy, so that they survive a crash",
    ),
    argument(
        "--verbose", action="store_true", help="warnings whole, calls of the components, expectations that are met"
    ),
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Run and write, as the options ask; everything computed is written also when the run fails."""
    _demand_seeds(options)
    scenario = load_scenario(options)
    directory = (Path(options.out) if options.out is not None else Path("results") / scenario.name).absolute()
    check_writable(directory, scenario.table().report.tables)
    call_log = _call_log(options, scenario, directory)
    results = _Results(directory, options)
    try:
        _run(scenario, options, results, call_log)
    except OutputError as error:  # what the disk did not take is at least on the screen
        if results.outcome is None:
            raise
        if not left_rows(directory) and (place := _elsewhere(results.outcome)) is not None:
            error = OutputError(f"{error} What was computed stands in {place} instead.")
        return replace(_output(results.outcome, None, {}, options), error=error)
    assert results.outcome is not None
    outcome, paths = results.outcome, results.paths
    study = None
    if options.seeds and outcome.failure is None:
        study = _study(scenario, options, directory / SEEDS)
        for line in warning_lines(study.warnings, str(directory / SEEDS / PAGE), "seed"):
            LOG.warning("%s", line)
        outcome = outcome.with_summary(seed_study=study.to_data())
        paths = _written(outcome, directory, options) | {"seeds": directory / SEEDS / "index.csv"}
    return _output(outcome, study, paths | ({"calls": call_log} if call_log is not None else {}), options)


def _demand_seeds(options: argparse.Namespace) -> None:
    """Refuse what is about several runs where there is one."""
    asked = many_runs(options) | {"workers": options.workers > 1}
    of_many = [f"--{key}" for key, value in asked.items() if value]
    if of_many and not options.seeds:
        raise ScenarioError(
            f"{', '.join(of_many)}: only for several runs; say how many with --seeds N, or leave "
            f"{'it' if len(of_many) == 1 else 'them'} out."
        )


class _Results:
    """What a run leaves, written as soon as it is there."""

    def __init__(self, directory: Path, options: argparse.Namespace) -> None:
        self.directory, self.options = directory, options
        self.outcome: Outcome | None = None
        self.paths: dict[str, Path] = {}

    def write(self, outcome: Outcome) -> None:
        """Take the outcome and write it."""
        self.outcome = outcome.asked_by(self.options.command_line)
        self.paths = _written(self.outcome, self.directory, self.options)
        LAST_CALL.note(json.dumps({"written": str(self.directory)}))
        shutil.rmtree(self.directory / UNFINISHED, ignore_errors=True)


def _written(outcome: Outcome, directory: Path, options: argparse.Namespace) -> dict[str, Path]:
    """Write results and report, as the options ask; paths by kind."""
    return outcome.write(directory, report=not options.no_report, figures=options.figures)


def _run(scenario: Scenario, options: argparse.Namespace, results: _Results, call_log: Path | None) -> None:
    """Run, with a bar."""
    directory = results.directory
    bar = simulated_time_bar(silent=options.quiet or options.json)
    try:
        with only_run(directory), _kept(results, options.stream, scenario.table().report.tables) as fallback:
            scenario.run(
                progress=bar,
                call_log=call_log,
                building=ignore if options.quiet else print_notice,
                stream=directory if options.stream else None,
                fallback=fallback,
                finished=results.write,
            )
    finally:
        bar.close()


@contextmanager
def _kept(results: _Results, streamed: bool, formats: Sequence[str]) -> Iterator[Path | None]:
    """Who watches this process learns what to keep should it die; yields the folder to stream to for that, if one is
    needed. It goes when the results stand, and not before.
    """
    directory = results.directory
    if words := rescue(directory):
        LOG.warning("%s", words)
    if not LAST_CALL.watched:
        yield None
        return
    fallback = directory if streamed else directory / UNFINISHED
    LAST_CALL.note(json.dumps({"fallback": str(fallback), "out": str(directory), "formats": list(formats)}))
    try:
        yield None if streamed else fallback
    except OutputError as error:
        if rows := left_rows(directory):
            where = f"{rows} rows are kept in {fallback}; to see them: cosim report {directory}"
            raise OutputError(f"{error} {where}") from error
        raise
    finally:
        if results.paths:
            shutil.rmtree(directory / UNFINISHED, ignore_errors=True)
        LAST_CALL.note("")


def _elsewhere(outcome: Outcome) -> Path | None:
    """A folder for temporary files with the results that the disk of the other one did not take; None if it neither."""
    folder = Path(mkdtemp(prefix="cosim_results_"))
    try:
        outcome.write(folder, report=False)
    except OutputError:
        shutil.rmtree(folder, ignore_errors=True)
        return None
    return folder


def _call_log(options: argparse.Namespace, scenario: Scenario, directory: Path) -> Path | None:
    """Where calls are logged, if they are; a log that an earlier run left there would not belong to these results."""
    if options.log_calls:
        return Path(options.log_calls).absolute()
    if options.log_calls is None and not scenario.table().master.log_calls:
        (directory / CALL_LOG).unlink(missing_ok=True)
        return None
    return directory / CALL_LOG


def _study(scenario: Scenario, options: argparse.Namespace, directory: Path) -> Any:
    with ProgressBar("seed", silent=options.quiet or options.json) as bar:
        return studies.seed_study(
            scenario.copy().master(log_calls=False),
            range(options.seeds),
            bar,
            directory=directory,
            **many_runs(options),
        )


def _output(outcome: Outcome, study: Any, paths: dict[str, Path], options: argparse.Namespace) -> Output:
    """What was found, and the exit code that follows from it."""
    summary, failure = outcome.result.summary, outcome.failure
    data = dict(summary) | {"failure": failure}
    if failure is not None and summary["reached"] <= summary["start"]:
        # figures of a run that did not take a step would hide why
        return Output([], data, paths, ERROR, [f"the run could not begin: {failure}"])
    failed_seeds = study is not None and study.failures
    unmet = outcome.unmet or failed_seeds or (options.strict and outcome.warnings)
    code = ERROR if failure is not None else NOT_AS_ASKED if unmet else DONE
    verbose = options.verbose or options.json
    expectations = evaluated_table(outcome.expectations)
    parts = [
        _headline(summary),
        *(_tables(outcome) if outcome.result.table.size else []),
        cost_table(outcome.result) if verbose else "",
        "" if study is None else study.table(),
        expectations if verbose else _unmet(expectations),
    ]
    if failure is not None:
        return Output(parts, data, paths, code, [f"the run ended early: {failure}"])
    return Output(parts, data, paths, code, verdict=outcome.verdict.text, role=_ROLES[outcome.verdict.mood])


def _unmet(expectations: Table) -> Table:
    """The rows of what is not met; the verdict says whether all are."""
    return replace(expectations, rows=[row for row in expectations.rows if row[0] != "met"])


def _tables(outcome: Outcome) -> list[Table]:
    """Errors, detected faults and consistency of filters, as far as there are any."""
    result, spec = outcome.result, outcome.spec
    return [
        outcome.errors(),
        fault_table(fault_detection(result, spec), spec),
        consistency_table(filter_consistency(result, spec), spec),
    ]


def _headline(summary: Any) -> str:
    factor = summary.get("real_time_factor") or float("nan")
    localisation = summary.get("localisation")
    how = "" if not localisation else f" Balises localised by '{localisation['method']}'."
    return (
        f"{summary['title']}: {summary['reached'] - summary['start']:g} s simulated in {summary['wall_seconds']:.2f} s "
        f"({factor:.0f} times real time) at {summary['step']:g} s steps.{_slowest(summary)}{how}"
    )


def _slowest(summary: Any) -> str:
    """Which component most of a long run was spent in; empty where none was."""
    spent = {part["name"]: part["seconds"] for part in summary["components"]}
    name = max(spent, key=spent.__getitem__, default="")
    if not name or spent[name] < max(_LONG, 0.5 * summary["wall_seconds"]):
        return ""
    return f" {100.0 * spent[name] / summary['wall_seconds']:.0f} % of the time were steps of {name}."

"""``cosim run``: one scenario, result files, report, table."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cosim import studies
from cosim.cli.arguments import MANY_RUNS, QUIET, positive, scenario_arguments
from cosim.cli.output import ignore, print_json, print_notice, print_paths, print_warning, texts_of
from cosim.cli.scenarios import load_scenario, simulated_time_bar
from cosim.errors import OutputError
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.consistency_table import consistency_table
from cosim.evaluation.cost import cost_table
from cosim.evaluation.error_table import error_table
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.fault_table import fault_table
from cosim.evaluation.metrics import phase_metrics
from cosim.process.last_call import LAST_CALL
from cosim.results.results_folder import check_writable
from cosim.results.unfinished import SPARE
from cosim.run.outcome import Outcome
from cosim.simulation.scenario import Scenario
from fmus.cli.commands import argument
from fmus.plain import plain

DONE, NOT_AS_ASKED, ERROR = 0, 1, 2
CALL_LOG = "calls.log"
SEEDS = "seeds"
"""Folder of the sweep over seeds, among the results."""

PARSER = {
    "description": "Run a scenario: shipped, from a TOML file, or from a system structure package (SSP).",
    "epilog": (
        "Exit codes: 0 done, 1 an expectation of the scenario is not met (or --strict), 2 the run failed or could "
        "not begin."
    ),
}
ARGUMENTS = (
    *scenario_arguments(),
    argument("--out", metavar="DIR", default=None, help="folder for results and report (default: results/NAME)"),
    argument(
        "--seed",
        action="append",
        type="seed={}".format,
        dest="settings",
        metavar="N",
        help="seed of the run: all chance",
    ),
    argument(
        "--seeds",
        type=positive,
        metavar="N",
        help="also run the seeds 0 to N - 1, a sweep in the folder seeds, and report medians and quartiles",
    ),
    *MANY_RUNS,
    argument("--json", action="store_true", help="print the summary as JSON instead of the table"),
    argument("--no-report", action="store_true", help="write result files only"),
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
    QUIET,
)


def execute(options: argparse.Namespace) -> int:
    """Run and write; everything computed is written also when the run fails.

    Args:
        options: of the command line.
    """
    scenario = load_scenario(options)
    directory = (Path(options.out) if options.out is not None else Path("results") / scenario.name).absolute()
    check_writable(directory, scenario.table().report.tables)
    call_log = _call_log(options, scenario, directory)
    results = _Results(directory, options)
    _run(scenario, options, results, call_log)
    assert results.outcome is not None
    outcome, paths = results.outcome, results.paths
    study = None
    if options.seeds and outcome.failure is None:
        study = _study(scenario, options, directory / SEEDS)
        outcome = outcome.with_summary(seed_study=study.to_data())
        paths = outcome.write(directory, report=not options.no_report) | {"seeds": directory / SEEDS / "index.csv"}
    _print(outcome, study, paths | ({"calls": call_log} if call_log is not None else {}), options)
    if outcome.failure is not None:
        return ERROR
    if study is not None and study.failures:
        return NOT_AS_ASKED
    return NOT_AS_ASKED if outcome.unmet or (options.strict and outcome.warnings) else DONE


class _Results:
    """What a run leaves, written as soon as it is there."""

    def __init__(self, directory: Path, options: argparse.Namespace) -> None:
        self.directory, self.options = directory, options
        self.outcome: Outcome | None = None
        self.paths: dict[str, Path] = {}

    def write(self, outcome: Outcome) -> None:
        """Take the outcome and write it."""
        self.outcome = outcome.asked_by(self.options.command_line)
        self.paths = self.outcome.write(self.directory, report=not self.options.no_report)
        LAST_CALL.note(json.dumps({"written": str(self.directory)}))
        shutil.rmtree(self.directory / SPARE, ignore_errors=True)


def _run(scenario: Scenario, options: argparse.Namespace, results: _Results, call_log: Path | None) -> None:
    """Run; what the disk did not take is at least on the screen."""
    directory = results.directory
    bar = simulated_time_bar(silent=options.quiet or options.json)
    try:
        with _kept(directory, options.stream, scenario.table().report.tables) as spare:
            scenario.run(
                progress=bar,
                warn=print_warning,
                call_log=call_log,
                building=ignore if options.quiet else print_notice,
                stream=directory if options.stream else None,
                spare=spare,
                finished=results.write,
            )
    except OutputError:
        if results.outcome is not None:
            _print(results.outcome, None, {}, options)
        raise
    finally:
        bar.close()


@contextmanager
def _kept(directory: Path, streamed: bool, formats: Sequence[str]) -> Iterator[Path | None]:
    """Who watches this process learns what to keep should it die; yields the folder to stream to for that, if one is
    needed.
    """
    if not LAST_CALL.watched:
        yield None
        return
    spare = directory if streamed else directory / SPARE
    LAST_CALL.note(json.dumps({"spare": str(spare), "out": str(directory), "formats": list(formats)}))
    try:
        yield None if streamed else spare
    finally:
        if not streamed:
            shutil.rmtree(spare, ignore_errors=True)
        LAST_CALL.note("")


def _call_log(options: argparse.Namespace, scenario: Scenario, directory: Path) -> Path | None:
    """Where calls are logged, if they are; a log that an earlier run left there would not belong to these results."""
    if options.log_calls:
        return Path(options.log_calls).absolute()
    if options.log_calls is None and not scenario.table().master.log_calls:
        (directory / CALL_LOG).unlink(missing_ok=True)
        return None
    return directory / CALL_LOG


def _study(scenario: Scenario, options: argparse.Namespace, directory: Path) -> Any:
    def report(done: int, count: int) -> None:
        if not (options.quiet or options.json) and sys.stderr.isatty():
            print(f"\rseed {done} of {count}", end="" if done < count else "\n", file=sys.stderr)

    return studies.seed_study(
        scenario.copy().master(log_calls=False),
        range(options.seeds),
        report,
        workers=options.workers,
        directory=directory,
        resume=options.resume,
        retry=options.retry,
        scheduler=options.scheduler,
    )


def _print(outcome: Outcome, study: Any, paths: dict[str, Path], options: argparse.Namespace) -> None:
    summary = outcome.result.summary
    if options.json:
        print_json(dict(summary) | {"failure": outcome.failure, "files": texts_of(paths)})
        return
    if outcome.failure is not None and summary["reached"] <= summary["start"]:
        print(f"cosim: the run could not begin: {plain(outcome.failure)}", file=sys.stderr)
        print_paths(paths)  # figures of a run that did not take a step would hide why
        return
    print(_headline(summary))
    if outcome.result.table.size:
        _print_tables(outcome)
    print(cost_table(outcome.result).text(), end="\n\n")
    if study is not None:
        print(study.text())
    if outcome.expectations:
        print(outcome.expectations_text(), end="\n\n")
    print_paths(paths)
    if outcome.failure is not None:
        print(f"cosim: the run ended early: {plain(outcome.failure)}", file=sys.stderr)


def _print_tables(outcome: Outcome) -> None:
    """Errors, detected faults and consistency of filters, as far as there are any."""
    metrics = [m for m in phase_metrics(outcome.result, outcome.spec) if m.speed or m.position]
    if metrics:
        print(error_table(metrics, outcome.spec).text())
    for table in (
        fault_table(fault_detection(outcome.result, outcome.spec), outcome.spec),
        consistency_table(filter_consistency(outcome.result, outcome.spec), outcome.spec),
    ):
        if table:
            print("\n" + table.text())


def _headline(summary: Any) -> str:
    factor = summary.get("real_time_factor") or float("nan")
    localisation = summary.get("localisation")
    how = "" if not localisation else f" Balises localised by '{localisation['method']}'."
    return (
        f"{summary['title']}: {summary['reached'] - summary['start']:g} s simulated in {summary['wall_seconds']:.2f} s "
        f"({factor:.0f} times real time) at {summary['step']:g} s steps.{how}"
    )

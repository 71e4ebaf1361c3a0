"""``cosim report``: the page of a results folder made again, or several results laid over each other."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from cosim.cli.arguments import FIGURE_FILES
from cosim.errors import ComparisonError, nearest
from cosim.evaluation.stored_spec import is_guessed, spec_of
from cosim.report.overlay.overlaid_runs import make_runs
from cosim.report.page.overlay import write_overlay_page
from cosim.report.page.run_page import write_report, write_report_page
from cosim.results.declared_units import in_si_only
from cosim.results.load_result import load_result
from fmus.cli.commands import argument, repeated
from fmus.cli.output import Output

if TYPE_CHECKING:
    from cosim.evaluation.spec import ReportSpec
    from cosim.results.result import Result

LOG = logging.getLogger("cosim")
OVERLAY = "overlay.html"
MOST_SIGNALS = 16  # panels that a page opens with

GROUP = "Compare"
PLACE = 2
HELP = "report of results, or of several laid over each other"
LOOKS = True
EXAMPLES = (
    "cosim report results/vendor",
    "cosim report results/dry results/wet",
)
PARSER = {
    "description": (
        "Make the report of a results folder again, or lay several results over each other on one page: the first "
        "is what the others are compared with."
    ),
    "epilog": "Exit codes: 0 written, 2 error.",
}
ARGUMENTS = (
    argument("results", nargs="+", metavar="DIR", help="results folders, or tables in any format that can be read"),
    argument("--out", metavar="FILE.html", help=f"the page (default: report.html in DIR, or {OVERLAY} for several)"),
    argument("--labels", metavar="A,B", help="texts for the runs, separated by commas (default: names of the folders)"),
    repeated("--signals", "PATTERN", "for several runs: recorded signals to draw as well, e.g. 'train.*'"),
    argument("--si", action="store_true", help="signals in SI also where FMUs want other units"),
    FIGURE_FILES,
)


def execute(options: argparse.Namespace) -> Output:
    """Read, draw and write, as the options ask; nothing in the results is changed."""
    paths = [Path(text) for text in options.results]
    labels = _labels(options.labels, paths)
    results = [load_result(path) for path in paths]
    if options.si:
        results = [replace(result, signals=in_si_only(result.signals)) for result in results]
    specs = [spec_of(result, label) for result, label in zip(results, labels, strict=True)]
    for path, result, spec in zip(paths, results, specs, strict=True):
        if is_guessed(result):
            LOG.warning("%s does not say which signals play which role: %s", path, _guess(spec))
    page = (
        _one(options, paths[0], results[0], specs[0]) if len(paths) == 1 else _several(options, results, specs, labels)
    )
    return Output(data={}, files={"report": page})


def _one(options: argparse.Namespace, path: Path, result: Result, spec: ReportSpec) -> Path:
    """The report of one run: beside its results, or where it is asked for."""
    if options.signals:
        raise ComparisonError("--signals is for several runs; one run's page offers all of them.")
    if options.out is not None:
        return write_report_page(result, spec, options.out, figures=options.figures)
    if not path.is_dir():
        raise ComparisonError(f"{path} is no results folder: say with --out FILE.html where its report is to go.")
    return write_report(result, spec, path, figures=options.figures)


def _several(
    options: argparse.Namespace, results: Sequence[Result], specs: Sequence[ReportSpec], labels: Sequence[str]
) -> Path:
    names = list(dict.fromkeys(name for result in results for name in (result.table.dtype.names or ())[1:]))
    signals = _matching(options.signals, names)
    runs = make_runs(results, specs, labels)
    return write_overlay_page(runs, options.out or OVERLAY, signals, figures=options.figures)


def _labels(text: str | None, paths: Sequence[Path]) -> list[str]:
    """The labels of the user, or the shortest ends of the paths by which they differ."""
    if text is not None:
        labels = [label.strip() for label in text.split(",")]
        if len(labels) != len(paths) or not all(labels):
            raise ComparisonError(
                f"--labels {text!r}: expected {len(paths)} texts separated by commas (got {len(labels)})."
            )
        return labels
    parts = [path.resolve().parts for path in paths]
    for length in range(1, max(map(len, parts)) + 1):
        labels = ["/".join(part[-length:]) for part in parts]
        if len(set(labels)) == len(labels):
            return labels
    return [f"{path} ({i})" for i, path in enumerate(paths, 1)]  # a folder beside itself


def _matching(patterns: Sequence[str], names: Sequence[str]) -> list[str]:
    """Names that match a pattern, in their order.

    Raises:
        ComparisonError: a pattern matches nothing, or too many names match.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise ComparisonError(f"--signals {pattern!r}: no such signal in any run; {nearest(pattern, names)}")
    chosen = [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
    if len(chosen) > MOST_SIGNALS:
        raise ComparisonError(
            f"--signals: {len(chosen)} signals match; a page opens with {MOST_SIGNALS} of them. Choose some."
        )
    return chosen


def _guess(spec: ReportSpec) -> str:
    """What was guessed, in words."""
    roles = [
        f"{role} = {name}" for role in ("true_position", "true_speed") if (name := getattr(spec, role)) is not None
    ]
    observers = [f"observers = {', '.join(spec.observers)}"] if spec.observers else []
    return (
        f"guessed from their names: {', '.join([*roles, *observers])}."
        if roles or observers
        else "their names give no hint."
    )

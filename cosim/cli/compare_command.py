"""``cosim compare``: a result against a reference, as text, JSON, page, pictures. Exit codes: 0 equal, 1 different, 2
error.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from cosim.baselines import check, is_baseline, read_baseline
from cosim.cli.arguments import FIGURE_FILES
from cosim.cli.tolerances import TOLERANCES, Asked, asked_tolerances, chosen_tolerances
from cosim.comparison.compare import compare_results
from cosim.comparison.comparison_text import comparison_verdict, difference_parts
from cosim.comparison.tolerance import Tolerances
from cosim.errors import ComparisonError, OutputError, nearest
from cosim.report.page.picture_files import picture_kind, write_numbered
from cosim.results.load_result import load_result
from cosim.results.results_folder import FIGURES
from fmus.cli.commands import ArgumentGroup, argument, one_of
from fmus.cli.output import Output

if TYPE_CHECKING:
    from cosim.baselines import Baseline
    from cosim.comparison.comparison import Comparison
    from cosim.results.result import Result

_DIFFERENT = 1
_NO_TELEGRAMS = "Telegrams and packets were not compared (--no-telegrams)."
EPILOG = (
    'A tolerance file is TOML: [default] with absolute, relative, time and time_relative; [signals."train.*"] with the '
    "same "
    'keys for the signals that fit; ignore = ["driver.*"]. A value may differ by absolute + relative * range of the '
    "reference, "
    "an instant by time + time_relative * length. Exit codes: 0 equal within tolerance, 1 different, 2 error."
)

KINDS = "a results folder, a table (CSV, MAT, ...) or a baseline (JSON)"
GROUP = "Compare"
PLACE = 1
HELP = "compare a result with a reference"
LOOKS = True
EXAMPLES = (
    "cosim compare results/old results/new",
    "cosim compare baseline.json results/new --html difference.html",
)
PARSER = {
    "description": "Compare a result with a reference: signals in tolerance tubes, telegrams as events.",
    "epilog": EPILOG,
}
ARGUMENTS = (
    argument("reference", metavar="A", help=f"what is right: {KINDS}"),
    argument("result", metavar="B", help=f"what is compared with it: {KINDS}"),
    ArgumentGroup(
        (
            *TOLERANCES,
            argument(
                "--signals", action="append", metavar="PATTERN", help="compare these signals only; may be repeated"
            ),
            argument(
                "--no-telegrams", action="store_true", help="do not compare balise telegrams and packets of a network"
            ),
            argument("--extra-fails", action="store_true", help="signals that only B has are a difference"),
        ),
        "what is compared, and how closely",
        "tolerances that are not given are those of a baseline A, or else the usual ones",
    ),
    ArgumentGroup(
        (
            argument(
                "--html", metavar="FILE", help="write a page to explore both sides, the tolerance and what differs"
            ),
            argument("--plots", metavar="DIR", help="draw the signals that differ to this folder"),
            FIGURE_FILES,
            one_of(
                argument("--quiet", action="store_true", help="print the verdict only"),
                argument("--verbose", action="store_true", help="print all signals and everything that was found"),
            ),
        ),
        "output",
    ),
)


def execute(options: argparse.Namespace) -> Output:
    """Compare, and write what the options ask for."""
    asked = asked_tolerances(options)  # before anything is read: a mistake in them is named at once
    comparison = replace(_compare(options, asked), extra_fails=options.extra_fails)
    parts = [] if options.quiet else difference_parts(comparison, verbose=options.verbose)
    found = Output(parts, comparison.to_dict(), verdict=comparison_verdict(comparison))
    found = found if comparison.equal else replace(found, code=_DIFFERENT, role="bad")
    return _drawn(found, comparison, options) if options.html or _pictures(options) else found


def _pictures(options: argparse.Namespace) -> Path | None:
    """Folder for pictures, where they are asked for: that of ``--plots``, or ``figures`` beside the page."""
    if options.plots:
        return Path(options.plots)
    return Path(options.html or "").parent / FIGURES if options.figures else None


def _compare(options: argparse.Namespace, asked: Asked) -> Comparison:
    """The comparison; against a baseline it is that of the baseline, which knows its models and its tolerances."""
    reference, baseline = _load(options.reference)
    result, other = _load(options.result)
    tolerances = chosen_tolerances(options, asked, baseline.tolerances if baseline is not None else Tolerances())
    if options.signals:
        reference, result = _chosen(reference, result, options.signals)
    odd = list(other.notes) if other is not None else []
    if options.no_telegrams:
        reference, result = (replace(side, events=(), packets=()) for side in (reference, result))
        odd = [*odd, _NO_TELEGRAMS]
    if baseline is not None:
        regression = check(result, replace(baseline, result=reference), tolerances, label=options.result)
        return replace(regression, reference=options.reference, notes=[*regression.notes, *odd])
    drawn = bool(options.html or _pictures(options))
    found = compare_results(reference, result, tolerances, labels=(options.reference, options.result), curves=drawn)
    return replace(found, notes=[*odd, *found.notes])


def _load(path: str) -> tuple[Result, Baseline | None]:
    """A result, and the baseline where it is of one."""
    if not is_baseline(path):
        return load_result(path), None
    baseline = read_baseline(path)
    return baseline.result, baseline


# -- signals ----------------------------------------------------------------------------------------------------------


def _chosen(reference: Result, result: Result, patterns: Sequence[str]) -> tuple[Result, Result]:
    """Both sides with the signals that fit a pattern only."""
    both = [list(side.table.dtype.names or ())[1:] for side in (reference, result)]
    known = list(dict.fromkeys([*both[0], *both[1]]))
    for pattern in patterns:
        if not any(_fits(name, pattern) for name in known):
            raise ComparisonError(f"--signals {pattern!r}: fits no signal of either side; {nearest(pattern, known)}")
    first, second = ([n for n in names if any(_fits(n, p) for p in patterns)] for names in both)
    return _columns(reference, first), _columns(result, second)


def _fits(name: str, pattern: str) -> bool:
    return name == pattern or fnmatchcase(name, pattern)


def _columns(side: Result, names: Sequence[str]) -> Result:
    return replace(
        side, table=side.table[["time", *names]], signals=[info for info in side.signals if info.name in names]
    )


def _drawn(found: Output, comparison: Comparison, options: argparse.Namespace) -> Output:
    """The same with page and pictures, as they were asked for; what was found is kept where one cannot be written."""
    from cosim.report.page.comparison import draw_pictures, write_page  # noqa: PLC0415 - only for those who write

    try:
        files = {"page": write_page(comparison, options.html)} if options.html else {}
        folder, kind = _pictures(options), picture_kind(options.figures or True)
        drawn = write_numbered(draw_pictures(comparison, kind), folder, kind) if folder is not None else {}
    except OutputError as error:
        return replace(found, error=error)
    none = ["no pictures: nothing that differs can be drawn"] if _pictures(options) and not drawn else []
    if options.quiet:
        return found
    files |= {f"picture of {name}": path for name, path in drawn.items()}
    return replace(found, parts=[*found.parts, *none], files=files)

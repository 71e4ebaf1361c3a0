"""``cosim convert``: a result in another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from cosim.errors import OutputError
from cosim.results.formats.known_formats import format_of
from cosim.results.load_result import load_result
from cosim.results.save import save_result
from cosim.results.selection import selected
from fmus.cli.commands import argument

DONE = 0

PARSER = {
    "description": (
        "Write a result in another format: the ending of TARGET says which, such as .csv, .mat (MATLAB), .modelica.mat "
        "(Dymola, OpenModelica), .npy, .parquet, .h5. SOURCE is a results folder, or a table of any tool."
    ),
    "epilog": "Exit codes: 0 written, 2 error.",
}
ARGUMENTS = (
    argument("source", metavar="SOURCE", help="results folder or file"),
    argument("target", metavar="TARGET", help="file to write"),
    argument("--signals", nargs="+", action="extend", metavar="PATTERN", help="only these signals, e.g. 'train.*'"),
    argument("--no-units", action="store_true", help="CSV headings without units"),
)


def execute(options: argparse.Namespace) -> int:
    """Read, choose, write; say what was written and what the format does not keep.

    Args:
        options: of the command line.
    """
    target = Path(options.target)
    wanted = format_of(target)
    if target.exists() and Path(options.source).exists() and target.samefile(options.source):
        raise OutputError(f"{target} is the source itself. Choose another name.")
    result = load_result(options.source)
    if options.signals:
        result = selected(result, options.signals)
    written = save_result(result, target, units=not options.no_units)
    print(
        f"{len(result.table)} rows, {len(result.signals)} signals, {len(result.events)} telegrams: "
        f"{', '.join(map(str, written))}"
    )
    if wanted.name == "npy" and any(signal.unit != "1" for signal in result.signals):
        print("A NumPy file keeps no units; .parquet, .h5, .mat and .csv do.")
    return DONE

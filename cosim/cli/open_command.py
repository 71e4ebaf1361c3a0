"""``cosim open``: the page of results in a browser; it is made where there is none yet."""

from __future__ import annotations

import argparse
import tempfile
import webbrowser
from pathlib import Path

from cosim.errors import CosimError, OutputError
from cosim.evaluation.stored_spec import spec_of
from cosim.report.page.run_page import is_page_of, write_report, write_report_page
from cosim.results.load_result import load_result
from cosim.results.results_folder import REPORT, SUMMARY
from fmus.cli.commands import argument
from fmus.cli.output import Output

PAGES = (REPORT, "index.html", "tuning.html", "comparison.html", "observers.html", "overlay.html")
"""Pages that a folder may hold, the one that is opened first."""

GROUP = "Compare"
PLACE = 3
HELP = "open the page of results in a browser"
LOOKS = True
EXAMPLES = (
    "cosim open results/vendor",
    "cosim open measured.csv",
)
PARSER = {
    "description": (
        "Open the page of a results folder, of a sweep, a tuning or a comparison in the browser; of a run it is made "
        "where there is none yet, or where it was made of other results than are there now. A table in any format that "
        "can be read gets a page of its own."
    ),
    "epilog": "Exit codes: 0 opened, 1 written, but no browser opens it, 2 error.",
}
ARGUMENTS = (
    argument("results", metavar="RESULTS", help="a results folder, a page, or a table in any format that can be read"),
    argument("--out", metavar="FILE.html", help="where the page is written, if it is made (default: in the folder)"),
    argument("--no-browser", action="store_true", help="write the page and say where it is, no more"),
)


def execute(options: argparse.Namespace) -> Output:
    """Find the page or make it, and show it, as the options ask."""
    page = _page(Path(options.results), options.out)
    if options.no_browser:
        return Output([], {"page": str(page)}, {"page": page}, verdict="The page is written.")
    opened = webbrowser.open(page.resolve().as_uri())
    data = {"page": str(page), "opened": opened}
    if not opened:
        verdict = "No browser could be opened here: open the page yourself."
        return Output([], data, {"page": page}, code=1, verdict=verdict, role="bad")
    return Output([], data, {"page": page}, verdict="The page is opened.")


def _page(path: Path, out: str | None) -> Path:
    """The page of what is at a path, made where it has to be."""
    if path.suffix.lower() in (".html", ".htm") and path.is_file():
        return path
    if path.is_dir() and out is None:
        found = next((path / name for name in PAGES if (path / name).is_file()), None)
        if found is not None and not _is_of_others(found, path):
            return found
    result = load_result(path)
    spec = spec_of(result, path.stem)
    if out is not None:
        return write_report_page(result, spec, out)
    if path.is_dir():
        try:
            return write_report(result, spec, path)
        except OutputError:  # a folder that may be read only: the page is of use all the same
            pass
    return write_report_page(result, spec, Path(tempfile.mkdtemp(prefix="cosim-")) / f"{path.stem}.html")


def _is_of_others(page: Path, folder: Path) -> bool:
    """Whether the page of a run was made of other results than those in its folder now."""
    if page.name != REPORT or not (folder / SUMMARY).is_file():
        return False
    try:
        return not is_page_of(page, folder)
    except OSError as error:
        raise CosimError(f"{error.filename or folder} cannot be read: {error.strerror or error}.") from error

"""The page of a run: one HTML file that needs nothing else; and its figures as files, where they are asked for. Touches
only the folder it is given.
"""

from __future__ import annotations

from pathlib import Path

from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry
from cosim.expectations.evaluated import Evaluated
from cosim.report.live.live_page import LivePage
from cosim.report.live.render import live_page
from cosim.report.page.derived_curves import derived_curves
from cosim.report.page.page_files import explained, page_bytes, write_file, write_page
from cosim.report.page.picture_files import PictureKind, Pictures, picture_kind, write_pictures
from cosim.report.page.run_curves import run_panels, run_recording
from cosim.report.page.run_marks import run_marks
from cosim.report.page.run_sections import run_sections
from cosim.report.page.run_statements import run_statements
from cosim.report.page.run_verdict import largest_finding, observer_statuses, run_verdict
from cosim.results.result import Result
from cosim.results.results_folder import FIGURES, REPORT, remove_report, results_digest


def write_report(result: Result, spec: ReportSpec, directory: str | Path, *, figures: Pictures = False) -> Path:
    """Write ``report.html``, and where they are asked for its figures as files in ``figures/``. The page notes of which
    results in the folder it was made, see `is_page_of`.

    Args:
        result: the run; a failed one is reported as far as it came.
        spec: roles of the signals, phases, published numbers.
        directory: the folder; created where it does not exist.
        figures: whether figures are drawn as well, see `Pictures`.

    Returns:
        Path of the page.

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = Path(directory)
    text = live_page(run_page(result, spec))
    kind = picture_kind(figures)
    files = _drawn(result, spec, kind) if figures else {}
    with explained(f"The report cannot be written to {folder}", "Choose another output folder."):
        remove_report(folder, keep=write_pictures(files, folder / FIGURES, kind).values())
        write_file(folder / REPORT, page_bytes(text) + _made_of(folder))
    return folder / REPORT


def is_page_of(page: Path, directory: Path) -> bool:
    """Whether a page was made of the very results in a folder.

    Args:
        page: the file. directory: the results folder.

    Raises:
        OSError: a file cannot be read.
    """
    return page.read_bytes().endswith(_made_of(directory))


def _made_of(directory: Path) -> bytes:
    """The end of the page of these results: a comment, which shows nowhere."""
    return f"\n<!-- made of results with SHA-256 {results_digest(directory)} -->\n".encode()


def _drawn(result: Result, spec: ReportSpec, kind: PictureKind) -> dict[str, bytes]:
    """All pictures of a run by name."""
    from cosim.report.figures.panels import draw_all  # noqa: PLC0415 - matplotlib only for those who draw

    return {panel.name: data for panel, data in draw_all(result, spec, kind).items()}


def write_report_page(result: Result, spec: ReportSpec, path: str | Path, *, figures: Pictures = False) -> Path:
    """Write the page alone; it needs no other file.

    Args:
        result: the run.
        spec: roles of the signals, phases, published numbers.
        path: the file; its folder is created.
        figures: whether figures are drawn as well, in ``figures/`` beside the page, see `Pictures`.

    Returns:
        Path of the page.

    Raises:
        OutputError: a file cannot be written.
    """
    page = write_page(path, live_page(run_page(result, spec)))
    if figures:
        kind = picture_kind(figures)
        write_pictures(_drawn(result, spec, kind), page.parent / FIGURES, kind)
    return page


def run_page(result: Result, spec: ReportSpec) -> LivePage:
    """What the page of a run shows.

    Args:
        result: the run. spec: roles of the signals, phases, published numbers.
    """
    rows = len(result.time)
    derived = derived_curves(result, spec) if rows else []
    evaluated = [Evaluated.from_data(data) for data in list_entry(result, "expectations")]
    statuses = observer_statuses(result, spec) if rows else []
    marks = run_marks(result, spec) if rows else []
    description = result.summary.get("description")
    return LivePage(
        title=spec.title,
        verdict=run_verdict(result, spec, evaluated, statuses),
        cards=run_statements(result, spec, statuses),
        finding=largest_finding(result, spec, statuses, marks),
        lead=description if isinstance(description, str) else "",
        recordings=[run_recording(result, spec), *(r for found, _ in derived for r in found)] if rows else [],
        panels=[*run_panels(result, spec), *(panel for _, panel in derived)],
        marks=marks,
        settled=spec.evaluate_after,
        sections=run_sections(result, spec, evaluated),
    )

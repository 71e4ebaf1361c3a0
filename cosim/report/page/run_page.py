"""The report of a run: one HTML page that needs nothing else, and its figures as files. Touches only the folder it is
given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cosim.evaluation.balise_gaps import ENVELOPE
from cosim.evaluation.cost import was_compiled
from cosim.evaluation.error_table import error_table
from cosim.evaluation.event_counts import count_events
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, statement
from cosim.expectations.judged import Judged
from cosim.report.figures.panel import Panel
from cosim.report.figures.panels import draw_all
from cosim.report.figures.zooms import Zoom, draw_zooms
from cosim.report.page.page_files import explained, page_bytes, write_file, write_page
from cosim.report.page.render import render
from cosim.report.page.run_statements import run_statements
from cosim.report.page.run_tables import run_tables
from cosim.results.result import Result
from cosim.results.results_folder import FIGURES, REPORT, remove_report


def write_report(result: Result, spec: ReportSpec, directory: str | Path) -> Path:
    """Write ``report.html``, with the figures inside, and the same figures as PNG files in ``figures/``.

    Args:
        result: the run; a failed one is reported as far as it came.
        spec: roles of the signals, phases, published numbers.
        directory: the folder; created where it does not exist.

    Returns:
        Path of the page.

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = Path(directory)
    figures, zooms = draw_all(result, spec), draw_zooms(result, spec)
    text = _report_page(result, spec, figures, zooms)
    files = {panel.name: data for panel, data in figures.items()} | {zoom.key: zoom.png for zoom in zooms}
    with explained(f"The report cannot be written to {folder}", "Choose another output folder."):
        (folder / FIGURES).mkdir(parents=True, exist_ok=True)
        for key, data in files.items():
            write_file(folder / FIGURES / f"{key}.png", data)
        remove_report(folder, keep=files)
        write_file(folder / REPORT, page_bytes(text))
    return folder / REPORT


def write_report_page(result: Result, spec: ReportSpec, path: str | Path) -> Path:
    """Write the page alone; it needs no other file.

    Args:
        result: the run.
        spec: roles of the signals, phases, published numbers.
        path: the file; its folder is created.

    Returns:
        Path of the page.

    Raises:
        OutputError: the file cannot be written.
    """
    return write_page(path, _report_page(result, spec, draw_all(result, spec), draw_zooms(result, spec)))


def _report_page(
    result: Result, spec: ReportSpec, figures: Mapping[type[Panel], bytes], zooms: Sequence[Zoom] = ()
) -> str:
    """The page as text."""
    metrics, counts = phase_metrics(result, spec), count_events(result.events)
    shown = metrics if spec.true_speed or spec.true_position else []  # a turbine has no errors of speed
    judged = [Judged.from_data(data) for data in list_entry(result, "expectations")]
    return render(
        "report.html.j2",
        spec.title,
        result=result,
        spec=spec,
        description=result.summary.get("description"),
        facts=run_statements(result, spec),
        statement=statement(result),
        judged=judged,
        warnings=all_warnings(result, spec),
        metrics=shown,
        errors=error_table(shown, spec),
        seed_count=len(mapping_entry(result, "seed_study").get("seeds", [])),
        envelope=ENVELOPE,
        compiled=was_compiled(result),
        notes=list(dict.fromkeys(map(str, [*spec.notes, *list_entry(result, "notes")]))),
        zooms=zooms,
        figures=figures,
        counts=counts,
        **run_tables(result, spec, judged),
    )

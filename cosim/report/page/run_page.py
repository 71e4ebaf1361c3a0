"""The report of a run: one HTML page that needs nothing else, and its figures as files. Touches only the folder it is
given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cosim.evaluation.balise_gaps import ENVELOPE, GapErrors, gap_errors, largest
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.consistency_table import consistency_table
from cosim.evaluation.cost import cost_table, was_compiled
from cosim.evaluation.error_table import error_table
from cosim.evaluation.event_counts import count_events
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.fault_table import fault_table
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, statement
from cosim.expectations.judged import Judged
from cosim.report.figures.panel import Panel
from cosim.report.figures.panels import draw_all
from cosim.report.figures.zooms import Zoom, draw_zooms
from cosim.report.page import run_tables
from cosim.report.page.page_files import explained, page_bytes, write_file, write_page
from cosim.report.page.phases import phases_table
from cosim.report.page.render import render
from cosim.report.page.run_statements import run_statements
from cosim.results.result import Result
from cosim.results.results_folder import FIGURES, REPORT, remove_report
from fmus.tables.numbers import error_number, number
from fmus.tables.table import Column, Table, name_column

_COLUMNS = (
    Column("length", "Way", "m"),
    Column("seconds", "Time", "s"),
    Column("speed", "Speed at its end", "km/h", factor=3.6),
    Column("envelope", "SUBSET-041", "m", "What is allowed to an odometer after this way"),
)
_ERROR = "Estimated minus true position in the last row before the telegram is used"


def gaps_table(found: GapErrors) -> Table:
    """Position errors at the end of the longest gaps, in metres and in seconds of running time; last row: the largest
    of all gaps, and how many of them ended within the envelope.

    Args:
        found: from `gap_errors`.

    Returns:
        The table; without rows where there are no gaps.
    """
    columns = [name_column("gap", "Gap"), *_COLUMNS]
    columns += [
        Column(name, f"{found.labels[name]} [m]\nrunning time [s]", "", _ERROR, write=_written) for name in found.errors
    ]
    seconds = {name: found.running_time(name) for name in found.errors}
    rows: list[list[Any]] = []
    for i in found.longest():
        gap = found.gaps[i]
        errors = [{"error": float(found.errors[n][i]), "running_time": float(seconds[n][i])} for n in found.errors]
        rows.append([f"{gap.origin} to {gap.target}", gap.length, gap.seconds, gap.speed, gap.envelope, *errors])
    if rows:
        name = f"all {len(found.gaps)}: largest\nand share within SUBSET-041"
        worst = [{"largest": largest(e), "within": found.within_envelope(n)} for n, e in found.errors.items()]
        rows.append([name, *[""] * len(_COLUMNS), *worst])
    return Table("gaps", columns, rows)


def _written(value: dict[str, float]) -> str:
    """An error [m] above its running time [s]; of all gaps the largest [m] above the share that was within [1]."""
    if "error" in value:
        return f"{error_number(value['error'])}\n{error_number(value['running_time'])}"
    return f"{error_number(value['largest'])} m\n{number(100.0 * value['within'])} %"


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
    text = report_page(result, spec, figures, zooms)
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
    return write_page(path, report_page(result, spec, draw_all(result, spec), draw_zooms(result, spec)))


def report_page(
    result: Result, spec: ReportSpec, figures: Mapping[type[Panel], bytes], zooms: Sequence[Zoom] = ()
) -> str:
    """The page as text.

    Args:
        result: the run.
        spec: roles of the signals, phases, published numbers.
        figures: PNG by panel, from `draw_all`.
        zooms: from `draw_zooms`.

    Returns:
        The page.
    """
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
        expectations=run_tables.expectations_table(sorted(judged, key=lambda j: j.passed)),
        warnings=all_warnings(result, spec),
        metrics=shown,
        errors=error_table(shown, spec),
        zooms=zooms,
        figures=figures,
        counts=counts,
        telegrams=run_tables.telegrams_table(counts.outcomes, spec.labels),
        **_run_tables(result, spec),
    )


def _run_tables(result: Result, spec: ReportSpec) -> dict[str, Any]:
    """Tables that follow from result and roles alone, by their names in the template."""
    certificates, explained = run_tables.certificates(result, spec)
    return {
        "seed_count": len(mapping_entry(result, "seed_study").get("seeds", [])),
        "seeds": run_tables.seeds_table(result),
        "phases": phases_table(phase_details(result, spec), spec),
        "gaps": gaps_table(gap_errors(result, spec)),
        "envelope": ENVELOPE,
        "compiled": was_compiled(result),
        "notes": list(dict.fromkeys(map(str, [*spec.notes, *list_entry(result, "notes")]))),
        "certificates": certificates,
        "explained": explained,
        "packets": run_tables.packets_table(result),
        "indicators": run_tables.indicators_table(result, spec),
        "faults": fault_table(fault_detection(result, spec), spec),
        "consistency": consistency_table(filter_consistency(result, spec), spec),
        "components": run_tables.components_table(result),
        "calls": cost_table(result),
        "messages": run_tables.messages_table(result),
        "versions": run_tables.versions_table(result),
    }

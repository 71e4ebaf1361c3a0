"""The report of a run: one HTML page that needs nothing else, and its figures as files. Touches only the folder it is
given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from cosim.errors import OutputError
from cosim.evaluation.event_counts import count_events, outcome_columns
from cosim.evaluation.facts import list_entry, mapping_entry, statement
from cosim.evaluation.indicators import indicator_statistics
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.numbers import DASH, number
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.result_warnings import all_warnings
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.report.cost import cost_html, messages_html
from cosim.report.error_table import html_table
from cosim.report.figures.panels import PANELS, Panel, draw_all
from cosim.report.figures.zooms import ZOOM_KEYS, Zoom, draw_zooms
from cosim.report.page.expectations import expectations_table, unmet_box
from cosim.report.page.files import write_file, write_page
from cosim.report.page.parts import (
    box,
    bullets,
    chapters,
    details,
    facts,
    folded,
    page,
    paragraph,
    picture,
    side_by_side,
    simple_table,
)
from cosim.report.page.phases import phases_html
from cosim.report.page.verdict import verdict_facts
from cosim.results.result import Result

PAGE, FIGURES = "report.html", "figures"
CERTIFICATE_COLUMNS = {
    "aperiodic_limit": "Limit, varying gaps [s]",
    "constant_limit": "Limit, constant gap [s]",
    "max_gap": "Largest gap expected [s]",
    "largest_gap_seen": "Largest gap seen [s]",
}
SEED_COLUMNS = ("lower quartile", "median", "upper quartile", "independent", "published")
COMPONENT_COLUMNS = {"name": "Name", "kind": "Kind", "fmi_version": "FMI", "model": "Model", "source": "Source"}


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
    files = {panel.key: data for panel, data in figures.items()} | {zoom.key: zoom.png for zoom in zooms}
    stale = ({panel.key for panel in PANELS} | set(ZOOM_KEYS)) - set(files)  # of an earlier run
    try:
        (folder / FIGURES).mkdir(parents=True, exist_ok=True)
        for key, data in files.items():
            write_file(folder / FIGURES / f"{key}.png", data)
        for key in stale:
            (folder / FIGURES / f"{key}.png").unlink(missing_ok=True)
        write_file(folder / PAGE, text.encode("utf-8", "backslashreplace"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"The report cannot be written to {folder}: {reason}. Choose another output folder."
        ) from error
    return folder / PAGE


def write_report_page(result: Result, spec: ReportSpec, path: str | Path) -> Path:
    """Write the page alone; it needs no other file.

    Args:
        result: the run. spec: roles. path: the file; its folder is created.

    Raises:
        OutputError: the file cannot be written.
    """
    return write_page(path, report_page(result, spec, draw_all(result, spec), draw_zooms(result, spec)))


def report_page(result: Result, spec: ReportSpec, figures: Mapping[Panel, bytes], zooms: Sequence[Zoom] = ()) -> str:
    """The page as text.

    Args:
        result: the run. spec: roles. figures: PNG by panel, from `draw_all`. zooms: from `draw_zooms`.
    """
    warnings = all_warnings(result, spec)
    return page(
        spec.title,
        [
            _head(result, spec),
            box("failure", "The run ended early", paragraph(result.failure)) if result.failure else "",
            unmet_box(result),
            box("warning", "Warnings", "\n".join(map(folded, warnings))) if warnings else "",
            chapters(
                {
                    "Expectations": expectations_table(result),
                    "Errors of the observers": _errors(result, spec),
                    "Over several balise seeds": _seed_study(result),
                    "Where it matters": _zooms(zooms),
                    "Figures": [picture(data, panel.title, panel.caption) for panel, data in figures.items()],
                    "Phase by phase": phases_html(phase_details(result, spec), spec),
                    "Certificates": _certificates(result, spec),
                    "Balise telegrams": _events(result, spec),
                    "Slip indicators": [_indicators(result, spec)],
                    "Components": [_components(result)],
                    "Calls": _unfolding("Calls of each component, and what they took", cost_html(result)),
                    "Messages of the components": _unfolding("What the components logged", messages_html(result)),
                    "Notes": [bullets(dict.fromkeys(map(str, [*spec.notes, *list_entry(result, "notes")])))],
                    "Versions": [_versions(result)],
                }
            ),
        ],
    )


def _zooms(zooms: Sequence[Zoom]) -> list[str]:
    if not zooms:
        return []
    text = (
        "Windows of time around the largest errors, telegrams gone wrong, low-adhesion zones and indicators. Marks: "
        "the last row "
        "before (hollow) and the first row after an event (filled)."
    )
    return [paragraph(text), side_by_side(picture(zoom.png, zoom.title, zoom.caption) for zoom in zooms)]


def _unfolding(summary: str, content: Sequence[str]) -> list[str]:
    """Long content behind a line of text."""
    return [details(summary, "\n".join(content))] if content else []


def _head(result: Result, spec: ReportSpec) -> str:
    parts = [
        f"<h1>{escape(spec.title)}</h1>",
        _description(result),
        facts(verdict_facts(result, spec)),
        paragraph(statement(result)),
    ]
    return "<header>\n" + "\n".join(part for part in parts if part) + "\n</header>"


def _description(result: Result) -> str:
    description = result.summary.get("description")
    return paragraph(description) if isinstance(description, str) and description else ""


def _errors(result: Result, spec: ReportSpec) -> list[str]:
    metrics = phase_metrics(result, spec)
    if not metrics:
        return []
    text = "Estimate minus true value."
    if spec.evaluate_after > 0:
        text += f" Evaluated from {number(spec.evaluate_after)} s on, after the start-up."
    if any(m.published is not None or m.independent is not None for m in metrics):
        text += " Published numbers are those in print; independent ones were measured by a separate implementation."
    return [paragraph(text), html_table(metrics, spec)]


def _seed_study(result: Result) -> list[str]:
    study = mapping_entry(result, "seed_study")
    rows = [row for row in study.get("rows", []) if isinstance(row, Mapping)]
    if not rows:
        return []
    text = f"Maximal speed error in m/s over {len(study.get('seeds', []))} sampling patterns: quartiles and median."
    cells = [
        [str(row.get("observer")), str(row.get("phase")), *(number(row.get(k)) for k in SEED_COLUMNS)] for row in rows
    ]
    headings = ["Observer", "Phase", *(f"{column} [m/s]" for column in SEED_COLUMNS)]
    return [paragraph(text), simple_table(headings, cells, range(2, 2 + len(SEED_COLUMNS)))]


def _certificates(result: Result, spec: ReportSpec) -> list[str]:
    certificates = mapping_entry(result, "certificates")
    order = [o for o in spec.observers if o in certificates] + [o for o in certificates if o not in spec.observers]
    rows, explained = [], {}
    for observer in order:
        entry = certificates[observer]
        if isinstance(entry, Mapping):
            holds = {"True": "holds", "False": "does not hold"}.get(str(entry.get("holds")), DASH)
            sizes = [number(entry.get(key)) for key in CERTIFICATE_COLUMNS]
            rows.append([label(spec, observer), *sizes, holds])
            explained[label(spec, observer)] = str(entry.get("explanation") or "")
    table = simple_table(
        ["Observer", *CERTIFICATE_COLUMNS.values(), "Certificate"], rows, range(1, len(CERTIFICATE_COLUMNS) + 1)
    )
    marked = table.replace("<td>does not hold</td>", '<td class="bad">does not hold</td>')
    return [
        marked,
        *(details(f"{name}: what was checked", paragraph(text)) for name, text in explained.items() if text),
    ]


def _events(result: Result, spec: ReportSpec) -> list[str]:
    if not result.events:
        return []
    counts = count_events(result.events)
    text = (
        f"{counts.delivered} telegrams were delivered, {counts.missed} balises were missed; {counts.false} "
        f"telegrams were false."
    )
    text += f" {counts.undelivered} were on their way when the run ended." if counts.undelivered else ""
    chosen = outcome_columns(counts.outcomes.values())
    rows = [[label(spec, name), *(str(count[o]) for o in chosen)] for name, count in counts.outcomes.items()]
    return [paragraph(text), simple_table(["Receiver", *chosen.values()], rows, range(1, len(chosen) + 1))]


def _indicators(result: Result, spec: ReportSpec) -> str:
    headings = ["Observer", "Time on [%]", "Time on outside zones [%]"]
    headings += [f"Delay in zone {number(a)} to {number(b)} s [s]" for a, b in spec.zones]
    rows = []
    for s in indicator_statistics(result, spec):
        delays = ["not indicated" if delay is None else number(delay) for delay in s.delays]
        rows.append([label(spec, s.observer), number(100 * s.on), number(100 * s.on_outside), *delays])
    return simple_table(headings, rows, range(1, len(headings)))


def _components(result: Result) -> str:
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping)]
    rows = [
        [str(entry.get(key) if entry.get(key) is not None else DASH) for key in COMPONENT_COLUMNS] for entry in entries
    ]
    return simple_table(list(COMPONENT_COLUMNS.values()), rows)


def _versions(result: Result) -> str:
    versions = mapping_entry(result, "versions")
    return simple_table(["Package", "Version"], [[str(name), str(version)] for name, version in versions.items()])

"""The report of a run: one HTML page that needs nothing else, and its figures as files. Touches only the folder it is given."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from html import escape
from pathlib import Path

from cosim.errors import OutputError
from cosim.report.cost import cost_html, messages_html
from cosim.report.event_counts import OUTCOMES, count_events
from cosim.report.facts import list_entry, mapping_entry, statement
from cosim.report.gallery import PANELS, Panel, draw_all
from cosim.report.html_parts import box, bullets, page, paragraph, picture, scrolling, section, simple_table
from cosim.report.indicators import indicator_statistics
from cosim.report.metrics import phase_metrics
from cosim.report.numbers import DASH, number
from cosim.report.roles import label
from cosim.report.spec import ReportSpec
from cosim.report.table import html_table
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
    figures = draw_all(result, spec)
    text = report_page(result, spec, figures)
    try:
        (folder / FIGURES).mkdir(parents=True, exist_ok=True)
        for panel in PANELS:
            if panel in figures:
                _write(folder / FIGURES / f"{panel.key}.png", figures[panel])
            else:
                (folder / FIGURES / f"{panel.key}.png").unlink(missing_ok=True)  # of an earlier run
        _write(folder / PAGE, text.encode("utf-8", "backslashreplace"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"The report cannot be written to {folder}: {reason}. Choose another output folder.") from error
    return folder / PAGE


def _write(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that no half of it is ever seen."""
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as scratch:
        part = Path(scratch) / path.name
        part.write_bytes(data)
        part.replace(path)


def report_page(result: Result, spec: ReportSpec, figures: Mapping[Panel, bytes]) -> str:
    """The page as text.

    Args:
        result: the run. spec: roles. figures: PNG by panel, from `draw_all`.
    """
    warnings = list_entry(result, "warnings")
    return page(
        spec.title,
        [
            f"<header>\n{_heading(spec)}\n{_description(result)}{paragraph(statement(result))}\n</header>",
            box("failure", "The run ended early", paragraph(result.failure)) if result.failure else "",
            box("warning", "Warnings", bullets(warnings)) if warnings else "",
            section("Errors of the observers", *_errors(result, spec)),
            section("Over several balise seeds", *_seed_study(result)),
            section("Figures", *(picture(data, panel.title, panel.caption) for panel, data in figures.items())),
            section("Certificates", _certificates(result, spec)),
            section("Balise telegrams", *_events(result, spec)),
            section("Slip indicators", _indicators(result, spec)),
            section("Components", _components(result)),
            section("Calls", *cost_html(result)),
            section("Messages of the components", *messages_html(result)),
            section("Notes", bullets(dict.fromkeys(map(str, [*spec.notes, *list_entry(result, "notes")])))),
            section("Versions", _versions(result)),
        ],
    )


def _heading(spec: ReportSpec) -> str:
    return f"<h1>{escape(spec.title)}</h1>"


def _description(result: Result) -> str:
    description = result.summary.get("description")
    return paragraph(description) + "\n" if isinstance(description, str) and description else ""


def _errors(result: Result, spec: ReportSpec) -> list[str]:
    metrics = phase_metrics(result, spec)
    if not metrics:
        return []
    text = "Estimate minus true value."
    if spec.evaluate_after > 0:
        text += f" Evaluated from {number(spec.evaluate_after)} s on, after the start-up."
    if any(m.published is not None or m.independent is not None for m in metrics):
        text += " Published numbers are those in print; independent ones were measured by a separate implementation."
    return [paragraph(text), scrolling(html_table(metrics, spec))]


def _seed_study(result: Result) -> list[str]:
    study = mapping_entry(result, "seed_study")
    rows = [row for row in study.get("rows", []) if isinstance(row, Mapping)]
    if not rows:
        return []
    text = f"Maximal speed error in m/s over {len(study.get('seeds', []))} sampling patterns: quartiles and median."
    cells = [[str(row.get("observer")), str(row.get("phase")), *(number(row.get(k)) for k in SEED_COLUMNS)] for row in rows]
    headings = ["Observer", "Phase", *(f"{column} [m/s]" for column in SEED_COLUMNS)]
    return [paragraph(text), simple_table(headings, cells, range(2, 2 + len(SEED_COLUMNS)))]


def _certificates(result: Result, spec: ReportSpec) -> str:
    certificates = mapping_entry(result, "certificates")
    order = [o for o in spec.observers if o in certificates] + [o for o in certificates if o not in spec.observers]
    rows = []
    for observer in order:
        entry = certificates[observer]
        if isinstance(entry, Mapping):
            holds = {"True": "holds", "False": "does not hold"}.get(str(entry.get("holds")), DASH)
            sizes = [number(entry.get(key)) for key in CERTIFICATE_COLUMNS]
            rows.append([label(spec, observer), *sizes, holds, str(entry.get("explanation") or "")])
    headings = ["Observer", *CERTIFICATE_COLUMNS.values(), "Certificate", "Explanation"]
    return simple_table(headings, rows, range(1, len(CERTIFICATE_COLUMNS) + 1)).replace(
        "<td>does not hold</td>", '<td class="bad">does not hold</td>'
    )


def _events(result: Result, spec: ReportSpec) -> list[str]:
    if not result.events:
        return []
    counts = count_events(result.events)
    text = f"{counts.told} telegrams were told, {counts.false} of them false; {counts.missed} balises were missed."
    rows = [[label(spec, name), *(str(count[o]) for o in OUTCOMES)] for name, count in counts.outcomes.items()]
    return [paragraph(text), simple_table(["Receiver", *OUTCOMES], rows, range(1, len(OUTCOMES) + 1))]


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
    rows = [[str(entry.get(key) if entry.get(key) is not None else DASH) for key in COMPONENT_COLUMNS] for entry in entries]
    return simple_table(list(COMPONENT_COLUMNS.values()), rows)


def _versions(result: Result) -> str:
    versions = mapping_entry(result, "versions")
    return simple_table(["Package", "Version"], [[str(name), str(version)] for name, version in versions.items()])

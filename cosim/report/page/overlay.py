"""The page of several runs laid over each other, and its figures as files where they are asked for. Touches only the
folder or file it is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

from cosim.evaluation.error_table import MEASURED
from cosim.evaluation.event_counts import count_events
from cosim.evaluation.roles import phases
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, number_entry
from cosim.report.live.live_page import Card, Folded, LivePage, PagePanel, PageVerdict, Section
from cosim.report.live.render import live_page
from cosim.report.overlay.changing_signals import changing_signals, largest_change
from cosim.report.overlay.overlaid_runs import OverlayRun, make_runs
from cosim.report.overlay.overlay_measures import Measured, detailed, measured, numbers_table
from cosim.report.page.page_files import write_page
from cosim.report.page.phases import COLUMNS
from cosim.report.page.picture_files import Pictures, picture_kind, write_pictures
from cosim.report.page.run_curves import run_panels, run_recording
from cosim.report.page.run_marks import run_marks
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import DASH, error_number, number
from fmus.tables.table import Column, Table, name_column, text_column

PAGE, FIGURES = "overlay.html", "figures"
SIGNALS_SHOWN = 8  # where no signal has a role
_DIFFERENCES_SHOWN = 25  # the rest unfolds
_RMS_SPEED = 1  # column of the rms speed error


_COMPONENT_ENTRIES = {
    "kind": "kind",
    "fmi_version": "FMI version",
    "model": "model",
    "preset": "preset",
    "guid": "GUID",
}
_SETTINGS = ("scenario", "start", "stop", "step")
_VERSION = "version of "  # these stand last
_PLACE = 1e-6  # balises this close together are one [m]
INSTANT = 1e-9  # likewise, where the layout states when they are passed [s]


def differences(runs: Sequence[OverlayRun]) -> list[list[str]]:
    """Rows of a table: what, then its value in each run; only what is not the same in all.

    Args:
        runs: from `make_runs`.
    """
    known = [_properties(run) for run in runs]
    names = sorted(
        dict.fromkeys(name for properties in known for name in properties), key=lambda name: name.startswith(_VERSION)
    )
    rows = [[name, *(properties.get(name, DASH) for properties in known)] for name in names]
    return [row for row in rows if len(set(row[1:])) > 1]


def layout_note(runs: Sequence[OverlayRun]) -> str:
    """Whether the balises of all runs stand at the same places; empty where no run has any.

    Args:
        runs: from `make_runs`.
    """
    passed = [{e.identity: e for e in run.result.events if e.kind != "false"} for run in runs]
    if not any(passed):
        return ""
    other = [run.label for run, own in zip(runs[1:], passed[1:], strict=True) if not _equal_layout(passed[0], own)]
    if not other:
        return "All runs pass the same balises, at the same places or at the same instants."
    return f"{', '.join(other)} passed other balises than {runs[0].label}, or elsewhere."


def _equal_layout(a: Mapping[str, BaliseRecord], b: Mapping[str, BaliseRecord]) -> bool:
    """Whether the same balises were passed where they were (a layout by distance) or when they were (one by
    instants).
    """
    if a.keys() != b.keys():
        return False
    equal_places = all(abs(a[name].true_position - b[name].true_position) <= _PLACE for name in a)
    return equal_places or all(abs(a[name].stamp - b[name].stamp) <= INSTANT for name in a)


def _properties(run: OverlayRun) -> dict[str, str]:
    """Everything that may differ, by name."""
    result = run.result
    found = {name: _text(result.summary[name]) for name in _SETTINGS if name in result.summary}
    found |= _master(result)
    for entry in list_entry(result, "components"):
        if isinstance(entry, Mapping):
            found |= _component(entry)
    found |= {
        "connections": f"{len(list_entry(result, 'connections'))} lines, {_digest(list_entry(result, 'connections'))}"
    }
    found |= _telegrams(result)
    found |= {"evaluated from": f"{number(run.own_spec.evaluate_after)} s", "phases": _phases(run)}
    return found | {f"{_VERSION}{name}": str(version) for name, version in mapping_entry(result, "versions").items()}


def _master(result: Result) -> dict[str, str]:
    master = mapping_entry(result, "master")
    parts = {name: master.get(name) for name in ("algorithm", "control")}
    return {
        f"master: {name}": str(part["name"])
        for name, part in parts.items()
        if isinstance(part, Mapping) and "name" in part
    }


def _component(entry: Mapping[str, Any]) -> dict[str, str]:
    name = str(entry.get("name"))
    found = {
        f"{name}: {text}": _text(entry[key]) for key, text in _COMPONENT_ENTRIES.items() if entry.get(key) is not None
    }
    for group in ("options", "parameters"):
        values = entry.get(group)
        if isinstance(values, Mapping):
            found |= {f"{name}.{key}": _text(value) for key, value in values.items()}
    return found


def _telegrams(result: Result) -> dict[str, str]:
    counts = count_events(result.events)
    method = mapping_entry(result, "localisation").get("method")
    delays = [e.delivered_at - e.stamp for e in result.events if e.kind != "missed" and e.delivered_at >= e.stamp]
    return {
        "balises located by": _text(method),
        "telegrams delivered": str(counts.delivered),
        "telegrams missed": str(counts.missed),
        "telegrams false": str(counts.false),
        "longest delay of a telegram": f"{number(max(delays, default=0.0))} s",
    }


def _phases(run: OverlayRun) -> str:
    return ", ".join(f"{p.name} {number(p.start)} to {number(p.end)} s" for p in phases(run.result, run.own_spec))


def _digest(lines: Sequence[Any]) -> str:
    return sha256("\n".join(sorted(map(str, lines))).encode()).hexdigest()[:8]


def _text(value: Any) -> str:
    return DASH if value is None else f"{value:.10g}" if isinstance(value, float) else str(value)


def write_overlay(
    results: Sequence[Result],
    specs: Sequence[ReportSpec],
    labels: Sequence[str],
    directory: str | Path,
    signals: Sequence[str] = (),
) -> Path:
    """Lay several runs over each other: ``overlay.html``.

    Args:
        results: the runs; the first is what the others are compared with.
        specs: roles of the signals of each.
        labels: text for each.
        directory: the folder; created where it does not exist.
        signals: names of recorded signals to draw besides those that have a role.

    Returns:
        Path of the page.

    Raises:
        ComparisonError: the runs cannot be laid over each other. OutputError: the folder cannot be written.
    """
    return write_overlay_page(make_runs(results, specs, labels), Path(directory) / PAGE, signals)


def write_overlay_page(
    runs: Sequence[OverlayRun], path: str | Path, signals: Sequence[str] = (), *, figures: Pictures = False
) -> Path:
    """Write the page of runs laid over each other; it needs no other file.

    Args:
        runs: from `make_runs`.
        path: the file; its folder is created.
        signals: as for `write_overlay`.
        figures: whether figures are drawn as well, in ``figures/`` beside the page, see `Pictures`.

    Returns:
        Path of the page.

    Raises:
        OutputError: a file cannot be written.
    """
    page = write_page(path, live_page(overlay_page(runs, signals)))
    if figures:
        from cosim.report.figures.overlay_figures import draw_overlays  # noqa: PLC0415 - matplotlib only to draw

        kind = picture_kind(figures)
        chosen = signals or changing_signals(runs, SIGNALS_SHOWN)
        drawn = draw_overlays(runs, signals, kind) or draw_overlays(runs, chosen, kind)
        write_pictures({picture.key: picture.data for picture in drawn}, page.parent / FIGURES, kind, "overlay_*")
    return page


def overlay_page(runs: Sequence[OverlayRun], signals: Sequence[str] = ()) -> LivePage:
    """What the page of runs laid over each other shows.

    Args:
        runs: from `make_runs`. signals: as for `write_overlay`.
    """
    errors, different = measured(runs), differences(runs)
    changes = _largest_changes(runs, errors)
    return LivePage(
        title=_title(runs),
        verdict=_verdict(runs, len(different), changes),
        cards=changes,
        finding=_most_changed(runs),
        recordings=[run_recording(run.result, run.spec, run.label) for run in runs],
        panels=_panels(runs, signals),
        marks=[mark for mark in run_marks(runs[0].result, runs[0].spec) if mark.kind != "worst"],
        settled=runs[0].spec.evaluate_after,
        sections=_sections(runs, errors, different),
    )


def _panels(runs: Sequence[OverlayRun], signals: Sequence[str]) -> list[PagePanel]:
    """Those of all runs by their titles, and the signals that were asked for; where neither the signals that differ
    most.
    """
    found: dict[str, PagePanel] = {}
    for panel in (panel for run in runs for panel in run_panels(run.result, run.spec)):
        former = found.get(panel.title, panel)
        names = list(dict.fromkeys([*former.curves, *panel.curves]))
        found[panel.title] = replace(panel, curves=names)
    has_roles = any(run.spec.true_speed or run.spec.observers for run in runs)
    chosen = list(signals) or ([] if has_roles else changing_signals(runs, SIGNALS_SHOWN))
    own = [PagePanel(name, [name]) for name in chosen]
    others = found.values() if has_roles else [replace(panel, is_shown=not own) for panel in found.values()]
    return [*own, *others]


def _verdict(runs: Sequence[OverlayRun], different: int, changes: Sequence[Card]) -> PageVerdict:
    """How many runs came to their end, what differs between them, and the largest change."""
    failed = [run.label for run in runs if run.result.failure is not None]
    if failed:
        return PageVerdict(f"{', '.join(failed)} did not come to {'its' if len(failed) == 1 else 'their'} end.", "bad")
    settings = "no setting that is known differs" if not different else f"{different} settings differ"
    text = f"{len(runs)} complete runs; {'one setting differs' if different == 1 else settings}."
    text = text if len(runs) > 1 else "One complete run."
    odd = _two_units(runs)
    found = " ".join([*(f"{name}: {size} {where}." for name, size, where, _ in changes), *odd[:1]])
    if len(odd) > 1:
        found += f" So have {len(odd) - 1} more signals."
    return PageVerdict(f"{text} {found}".rstrip(), "doubt" if odd or any(c[3] == "doubt" for c in changes) else "")


def _two_units(runs: Sequence[OverlayRun]) -> list[str]:
    """What is recorded in another unit in another run, of which no difference is made."""
    units: dict[str, dict[str, str]] = {}
    for run in runs:
        for signal in run.result.signals:
            units.setdefault(signal.name, {}).setdefault(signal.unit, run.label)
    return [
        f"{name} has several units, {', '.join(f'{unit} in {label}' for unit, label in found.items())}: "
        "no difference of it is made."
        for name, found in units.items()
        if len(found) > 1
    ]


def _most_changed(runs: Sequence[OverlayRun]) -> str:
    """The signal that differs most, by the range of its values in the first run; empty where none does."""
    name = next(iter(changing_signals(runs, 1)), None)
    share = largest_change(runs, name) if name is not None else 0.0
    if not share > 0.0:
        return ""
    return f"{name} differs most between the runs, by up to {number(100.0 * share)} % of its range in {runs[0].label}."


def _sections(runs: Sequence[OverlayRun], errors: Sequence[Measured], different: list[list[str]]) -> list[Section]:
    below = f"Below each number: the difference to {runs[0].label}."
    failed = [f"{run.label}: {run.result.failure}" for run in runs if run.result.failure is not None]
    table, details = numbers_table(runs, errors, MEASURED), numbers_table(runs, detailed(runs), COLUMNS)
    shown, rest = (_differences_table(runs, rows) for rows in _cut(different))
    lead = f"{runs[0].label} is what the others are compared with: {', '.join(run.label for run in runs[1:])}."
    none = (
        ""
        if shown
        else "Nothing the summaries tell of differs: settings, parameters, FMUs, telegrams and versions are the same."
    )
    return [
        Section("Not all runs came to their end", [failed], mood="bad"),
        Section("Runs", [lead if len(runs) > 1 else "", _runs_table(runs)]),
        Section("Errors, phase by phase", [f"Estimate minus true value. {below}", table] if table else []),
        Section("Slip, forces, errors around telegrams, indicators", [below, details] if details else []),
        Section(
            "What differs between the runs", [none, layout_note(runs), shown, Folded(f"{len(rest.rows)} more", [rest])]
        ),
        Section("Notes", [_notes(runs)]),
    ]


def _title(runs: Sequence[OverlayRun]) -> str:
    titles = list(dict.fromkeys(run.spec.title for run in runs))
    return f"{titles[0]}: {len(runs)} runs" if len(titles) == 1 else f"{len(runs)} runs over each other"


def _cut(rows: list[list[str]]) -> tuple[list[list[str]], list[list[str]]]:
    """The rows that are shown, and those that unfold."""
    return rows[:_DIFFERENCES_SHOWN], rows[_DIFFERENCES_SHOWN:]


def _largest_changes(runs: Sequence[OverlayRun], errors: Sequence[Measured]) -> list[Card]:
    """Where the rms speed error rose most and fell most, relative to the first run."""
    changes = []
    for row in errors:
        first = row.values.get(runs[0].label, (None,) * len(MEASURED))[_RMS_SPEED]
        for run in runs[1:]:
            now = row.values.get(run.label, (None,) * len(MEASURED))[_RMS_SPEED]
            if first and now is not None and isfinite(first):
                changes.append((now / first - 1, now, f"{row.observer}, {row.phase}, {run.label}"))
    found: list[Card] = []
    for name, mood, worst in (
        ("Largest rise of rms speed error", "doubt", max),
        ("Largest fall of rms speed error", "good", min),
    ):
        change, now, where = worst(changes, default=(0.0, 0.0, ""))
        if change != 0 and (change > 0) == (worst is max):
            size = f"{'+' if change > 0 else '−'}{number(100 * abs(change))} %" if isfinite(change) else "diverged"
            found.append((name, size, f"to {error_number(now)} m/s: {where}", mood))
    return found


def _differences_table(runs: Sequence[OverlayRun], rows: Sequence[Sequence[str]]) -> Table:
    return Table(
        "differences", [name_column("what", "What"), *(text_column(run.label, run.label) for run in runs)], rows
    )


_RUN_COLUMNS = (
    name_column("run", "Run"),
    text_column("scenario", "Scenario"),
    Column("start", "From", "s"),
    Column("stop", "To", "s"),
    Column("step", "Step", "ms", "Communication step", factor=1000.0),
    Column("rows", "Rows"),
    Column("wall_seconds", "Wall time", "s", "How long the run took"),
    text_column("created", "Made"),
)


def _runs_table(runs: Sequence[OverlayRun]) -> Table:
    rows: list[list[Any]] = []
    for run in runs:
        summary, time = run.result.summary, run.result.time
        step, seconds = (number_entry(summary, key) for key in ("step", "wall_seconds"))
        scenario, created = (summary.get(key) or None for key in ("scenario", "created"))
        rows.append([run.label, scenario, float(time[0]), float(time[-1]), step, len(time), seconds, created])
    return Table("runs", _RUN_COLUMNS, rows)


def _notes(runs: Sequence[OverlayRun]) -> list[str]:
    """What the reader must know before comparing."""
    notes = []
    first = runs[0]
    evaluated = [run.label for run in runs[1:] if list(run.own_spec.phases) != list(first.own_spec.phases)]
    if evaluated:
        notes.append(f"{', '.join(evaluated)} named other phases; all are judged over those of {first.label}.")
    late = [run.label for run in runs[1:] if run.own_spec.evaluate_after != first.own_spec.evaluate_after]
    if late:
        notes.append(f"{', '.join(late)} were to be evaluated from another instant on; that of {first.label} is used.")
    short = [run.label for run in runs if abs(float(run.result.time[-1] - first.result.time[-1])) > 0.0]
    if short:
        notes.append(
            f"{', '.join(short)} end at another time than {first.label}: phases beyond the end hold less, or nothing."
        )
    return [
        *notes,
        *dict.fromkeys(f"{run.label}: {note}" for run in runs for note in run.own_spec.notes if run is first),
    ]

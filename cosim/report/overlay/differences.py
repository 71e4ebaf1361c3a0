"""What differs between runs besides their numbers: settings, parameters, FMUs, layout, versions. Imports NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Any

from cosim.evaluation.event_counts import count_events
from cosim.evaluation.roles import phases
from cosim.evaluation.summary_entries import list_entry, mapping_entry
from cosim.report.overlay.overlaid_runs import OverlayRun
from cosim.results.result import BaliseRecord, Result
from fmus.tables.numbers import DASH, number

_COMPONENT_ENTRIES = {
    "kind": "kind",
    "fmi_version": "FMI version",
    "model": "model",
    "preset": "preset",
    "guid": "GUID",
}
SETTINGS = ("scenario", "start", "stop", "step")
VERSION = "version of "  # these stand last
PLACE = 1e-6  # balises this close together are one [m]
INSTANT = 1e-9  # likewise, where the layout tells when they are passed [s]


def differences(runs: Sequence[OverlayRun]) -> list[list[str]]:
    """Rows of a table: what, then its value in each run; only what is not the same in all.

    Args:
        runs: from `make_runs`.
    """
    known = [_properties(run) for run in runs]
    names = sorted(
        dict.fromkeys(name for properties in known for name in properties), key=lambda name: name.startswith(VERSION)
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
    other = [run.label for run, own in zip(runs[1:], passed[1:], strict=True) if not _same_layout(passed[0], own)]
    if not other:
        return "All runs pass the same balises, at the same places or at the same instants."
    return f"{', '.join(other)} passed other balises than {runs[0].label}, or elsewhere."


def _same_layout(a: Mapping[str, BaliseRecord], b: Mapping[str, BaliseRecord]) -> bool:
    """Whether the same balises were passed where they were (a layout by distance) or when they were (one by
    instants).
    """
    if a.keys() != b.keys():
        return False
    same_places = all(abs(a[name].true_position - b[name].true_position) <= PLACE for name in a)
    return same_places or all(abs(a[name].stamp - b[name].stamp) <= INSTANT for name in a)


def _properties(run: OverlayRun) -> dict[str, str]:
    """Everything that may differ, by name."""
    result = run.result
    found = {name: _text(result.summary[name]) for name in SETTINGS if name in result.summary}
    found |= _master(result)
    for entry in list_entry(result, "components"):
        if isinstance(entry, Mapping):
            found |= _component(entry)
    found |= {
        "connections": f"{len(list_entry(result, 'connections'))} lines, {_digest(list_entry(result, 'connections'))}"
    }
    found |= _telegrams(result)
    found |= {"evaluated from": f"{number(run.own_spec.evaluate_after)} s", "phases": _phases(run)}
    return found | {f"{VERSION}{name}": str(version) for name, version in mapping_entry(result, "versions").items()}


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

"""The tables of a report that hold what the summary of a run says; every entry of it may be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cosim.evaluation.consistency import ADVICE, filter_consistency
from cosim.evaluation.consistency_table import HEADINGS as CONSISTENCY_HEADINGS
from cosim.evaluation.consistency_table import cells as consistency_cells
from cosim.evaluation.cost import KINDS, cost_rows
from cosim.evaluation.event_counts import outcome_columns
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.fault_table import HEADINGS, cells, columns
from cosim.evaluation.indicators import indicator_statistics
from cosim.evaluation.roles import label
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, number_entry
from cosim.expectations.judged import Judged
from cosim.report.page.page_table import PageTable, simple_table
from cosim.results.result import Result
from fmus.tables.numbers import DASH, number

LIMITS = ("aperiodic_limit", "constant_limit")
_CERTIFICATE_COLUMNS = {
    "aperiodic_limit": "Limit, varying gaps [s]",
    "constant_limit": "Limit, constant gap [s]",
    "max_gap": "Largest gap expected [s]",
    "largest_gap_seen": "Largest gap seen [s]",
}
HOLDS = {"True": "holds", "False": "does not hold"}
_SEED_COLUMNS = ("lower quartile", "median", "upper quartile", "published", "independent")
_COMPONENT_COLUMNS = {"name": "Name", "kind": "Kind", "fmi_version": "FMI", "model": "Model", "source": "Source"}
MESSAGES_SHOWN = 100


def expectations_table(judged: list[Judged]) -> PageTable:
    """All expectations with what was measured.

    Args:
        judged: in the order in which they are shown.
    """
    rows = [["met" if j.passed else "not met", j.name, j.text] for j in judged]
    return simple_table(["Verdict", "Expected", "Measured"], rows)


def seeds_table(result: Result) -> PageTable:
    """Quartiles of the maximal speed errors over several seeds.

    Args:
        result: the run.
    """
    rows = [
        [str(row.get("observer")), str(row.get("phase")), *(number(row.get(column)) for column in _SEED_COLUMNS)]
        for row in mapping_entry(result, "seed_study").get("rows", [])
        if isinstance(row, Mapping)
    ]
    headings = ["Observer", "Phase", *(f"{column} [m/s]" for column in _SEED_COLUMNS)]
    return simple_table(headings, rows, range(2, len(headings)))


def certificates(result: Result, spec: ReportSpec) -> tuple[PageTable, dict[str, str]]:
    """Limits of the observers' certificates, those of the report first.

    Args:
        result: the run.
        spec: labels and order of the observers.

    Returns:
        The table, and what was checked by label of the observer.
    """
    known = mapping_entry(result, "certificates")
    order = dict.fromkeys([*(o for o in spec.observers if o in known), *known])
    entries = {label(spec, o): entry for o in order if isinstance(entry := known[o], Mapping)}
    rows = [
        [name, *(_limit(entry, key) for key in _CERTIFICATE_COLUMNS), HOLDS.get(str(entry.get("holds")), DASH)]
        for name, entry in entries.items()
    ]
    headings = ["Observer", *_CERTIFICATE_COLUMNS.values(), "Certificate"]
    explained = {name: str(entry.get("explanation") or "") for name, entry in entries.items()}
    return simple_table(headings, rows, range(1, len(_CERTIFICATE_COLUMNS) + 1)), explained


def _limit(entry: Mapping[str, Any], key: str) -> str:
    """One number of a certificate; where a search ended without a limit, how far it went."""
    horizon = number_entry(entry, "horizon")
    if key in LIMITS and entry.get(key) is None and horizon is not None:
        return f"> {horizon:g}"
    return number(entry.get(key))


def telegrams_table(
    outcomes: Mapping[str, Mapping[str, int]], labels: Mapping[str, str], heading: str = "Receiver"
) -> PageTable:
    """What became of the telegrams in each receiver.

    Args:
        outcomes: number of telegrams by outcome, by name of the receiver.
        labels: texts for names.
        heading: what the receivers are called.
    """
    chosen = outcome_columns(outcomes.values())
    rows = [[labels.get(name, name), *(str(count.get(o, 0)) for o in chosen)] for name, count in outcomes.items()]
    return simple_table([heading, *chosen.values()], rows, range(1, len(chosen) + 1))


_PACKET_COLUMNS = {
    "sent": "Sent",
    "lost": "Lost",
    "duplicates": "Duplicates",
    "overtaken": "Overtaken",
    "undelivered": "On their way at the end",
    "mean_age": "Mean age [s]",
    "largest_age": "Largest age [s]",
}


def packets_table(result: Result) -> PageTable:
    """What became of the packets of each node, and how old what receivers hold is.

    Args:
        result: the run.
    """
    entry = mapping_entry(result, "network")
    nodes = entry.get("nodes", {})
    rows = [
        [name, ", ".join(nodes.get(name, ())), *(number(found.get(key)) for key in _PACKET_COLUMNS)]
        for name, found in entry.get("packets", {}).items()
    ]
    headings = ["Node", "Signals", *_PACKET_COLUMNS.values()]
    return simple_table(headings, rows, range(2, len(headings)))


def indicators_table(result: Result, spec: ReportSpec) -> PageTable:
    """How long slip was indicated, and how late.

    Args:
        result: the run.
        spec: roles and zones.
    """
    headings = ["Observer", "Time on [%]", "Time on outside zones [%]"]
    headings += [f"Delay in zone {number(a)} to {number(b)} s [s]" for a, b in spec.zones]
    rows = []
    for s in indicator_statistics(result, spec):
        delays = [
            "not reached" if zone[0] >= result.time[-1] else "not indicated" if delay is None else number(delay)
            for zone, delay in zip(spec.zones, s.delays, strict=True)
        ]
        rows.append([label(spec, s.observer), number(100 * s.on), number(100 * s.on_outside), *delays])
    return simple_table(headings, rows, range(1, len(headings)))


def faults_table(result: Result, spec: ReportSpec) -> PageTable:
    """Faults: which were found, how late, and what was no fault.

    Args:
        result: the run.
        spec: roles and labels.
    """
    found = fault_detection(result, spec)
    shown = columns(found)
    rows = [[label(spec, one.observer), *cells(one, spec.delay_limit)[:shown]] for one in found]
    return simple_table(["Observer", *HEADINGS[:shown]], rows, range(1, shown + 1))


def consistency_table(result: Result, spec: ReportSpec) -> PageTable:
    """Filters whose covariances can be judged, and whether they fit.

    Args:
        result: the run.
        spec: roles and labels.
    """
    rows = [[label(spec, entry.observer), *consistency_cells(entry)] for entry in filter_consistency(result, spec)]
    table = simple_table(["Observer", *CONSISTENCY_HEADINGS], rows, range(2, len(CONSISTENCY_HEADINGS)))
    return replace(table, bad=set(ADVICE))


def components_table(result: Result) -> PageTable:
    """What was run.

    Args:
        result: the run.
    """
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping)]
    rows = [[_shown(entry.get(key)) for key in _COMPONENT_COLUMNS] for entry in entries]
    return simple_table(list(_COMPONENT_COLUMNS.values()), rows)


def calls_table(result: Result) -> PageTable:
    """Calls of the components and the milliseconds they took.

    Args:
        result: the run.
    """
    return simple_table(["Component", *KINDS, "Messages"], cost_rows(result), range(1, len(KINDS) + 2))


def messages_table(result: Result) -> PageTable:
    """What the components logged: the first and the last messages.

    Args:
        result: the run.
    """
    messages, half = list(result.messages), MESSAGES_SHOWN // 2
    shown = messages if len(messages) <= MESSAGES_SHOWN else [*messages[:half], *messages[-half:]]
    rows = [[m.component, number(m.time), m.status, m.category or DASH, m.text] for m in shown]
    return simple_table(["Component", "Time [s]", "Status", "Category", "Text"], rows, (1,))


def versions_table(result: Result) -> PageTable:
    """Versions of the packages that were used.

    Args:
        result: the run.
    """
    versions = mapping_entry(result, "versions")
    return simple_table(["Package", "Version"], [[str(name), str(version)] for name, version in versions.items()])


def _shown(value: Any) -> str:
    return DASH if value is None else str(value)

"""The tables of a report that hold what the summary of a run says; every entry of it may be missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.evaluation.balise_gaps import GapErrors, gap_errors, largest
from cosim.evaluation.consistency import filter_consistency
from cosim.evaluation.consistency_table import consistency_table
from cosim.evaluation.cost import cost_table
from cosim.evaluation.event_counts import count_events, outcome_columns
from cosim.evaluation.fault_detection import fault_detection
from cosim.evaluation.fault_table import fault_table
from cosim.evaluation.indicators import indicator_statistics
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.roles import label
from cosim.evaluation.seed_table import seed_table
from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.summary_entries import list_entry, mapping_entry, number_entry
from cosim.expectations.evaluated import Evaluated, evaluated_table
from cosim.report.page.phases import phases_table
from cosim.results.result import Result
from fmus.tables.numbers import DASH, error_number, number
from fmus.tables.table import Column, Table, name_column, text_column

LIMITS = ("aperiodic_limit", "constant_limit")
HOLDS = {"True": "holds", "False": "does not hold"}
OBSERVER = name_column("observer", "Observer")
_CERTIFICATE_COLUMNS = (
    Column("aperiodic_limit", "Limit, varying gaps", "s", "Longest gap that is certified where gaps vary"),
    Column("constant_limit", "Limit, constant gap", "s", "Longest gap that is certified where all gaps are equal"),
    Column("max_gap", "Largest gap expected", "s", "From the layout of the balises and the speed, before the run"),
    Column("largest_gap_seen", "Largest gap seen", "s", "Between telegrams that were used in the run"),
)
_PACKET_COLUMNS = (
    Column("sent", "Sent"),
    Column("lost", "Lost"),
    Column("duplicates", "Duplicates"),
    Column("overtaken", "Overtaken", meaning="Packets that a later one arrived before"),
    Column("undelivered", "On their way at the end"),
    Column("mean_age", "Mean age", "s", "Of what receivers hold"),
    Column("largest_age", "Largest age", "s", "Of what receivers hold"),
)
_COMPONENT_COLUMNS = (
    name_column("name", "Name"),
    *(text_column(key, heading) for key, heading in (("kind", "Kind"), ("fmi_version", "FMI"), ("model", "Model"))),
    text_column("source", "Source"),
)
MESSAGES_SHOWN = 100


def run_tables(result: Result, spec: ReportSpec, evaluated: Sequence[Evaluated]) -> dict[str, Any]:
    """Tables that follow from a run and its roles, by their names in the template.

    Args:
        result: the run. spec: roles and labels. evaluated: expectations.
    """
    certificates, explained = _certificates(result, spec)
    return {
        "expectations": evaluated_table(evaluated),
        "telegrams": telegrams_table(count_events(result.events).outcomes, spec.labels),
        "seeds": _seeds(result),
        "phases": phases_table(phase_details(result, spec), spec),
        "gaps": _gaps_table(gap_errors(result, spec)),
        "certificates": certificates,
        "explained": explained,
        "packets": _packets(result),
        "indicators": _indicators(result, spec),
        "faults": fault_table(fault_detection(result, spec), spec),
        "consistency": consistency_table(filter_consistency(result, spec), spec),
        "components": _components(result),
        "calls": cost_table(result),
        "messages": _messages(result),
        "versions": _versions(result),
    }


def _seeds(result: Result) -> Table:
    """Quartiles of the maximal speed errors over several seeds."""
    rows = mapping_entry(result, "seed_study").get("rows", [])
    return seed_table(row for row in rows if isinstance(row, Mapping))


_GAP_COLUMNS = (
    Column("length", "Way", "m"),
    Column("seconds", "Time", "s"),
    Column("speed", "Speed at its end", "km/h", factor=3.6),
    Column("envelope", "SUBSET-041", "m", "What is allowed to an odometer after this way"),
)
_GAP_ERROR = "Estimated minus true position in the last row before the telegram is used"


def _gaps_table(found: GapErrors) -> Table:
    """Position errors at the end of the longest gaps, in metres and in seconds of running time; last row: the largest
    of all gaps, and how many of them ended within the envelope.
    """
    columns = [name_column("gap", "Gap"), *_GAP_COLUMNS]
    columns += [
        Column(name, f"{found.labels[name]} [m]\nrunning time [s]", "", _GAP_ERROR, write=_written)
        for name in found.errors
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
        rows.append([name, *[""] * len(_GAP_COLUMNS), *worst])
    return Table("gaps", columns, rows)


def _written(value: dict[str, float]) -> str:
    """An error [m] above its running time [s]; of all gaps the largest [m] above the share that was within [1]."""
    if "error" in value:
        return f"{error_number(value['error'])}\n{error_number(value['running_time'])}"
    return f"{error_number(value['largest'])} m\n{number(100.0 * value['within'])} %"


def _certificates(result: Result, spec: ReportSpec) -> tuple[Table, dict[str, str]]:
    """Limits of the observers' certificates, those of the report first; and what was checked, by label."""
    known = mapping_entry(result, "certificates")
    order = dict.fromkeys([*(o for o in spec.observers if o in known), *known])
    entries = {label(spec, o): entry for o in order if isinstance(entry := known[o], Mapping)}
    rows = [
        [name, *(_limit(entry, c.key) for c in _CERTIFICATE_COLUMNS), HOLDS.get(str(entry.get("holds")))]
        for name, entry in entries.items()
    ]
    holds = text_column("holds", "Certificate", "Whether it holds for the gaps that were expected")
    explained = {name: str(entry.get("explanation") or "") for name, entry in entries.items()}
    return Table("certificates", [OBSERVER, *_CERTIFICATE_COLUMNS, holds], rows), explained


def _limit(entry: Mapping[str, Any], key: str) -> Any:
    """One number of a certificate; where a search ended without a limit, how far it went."""
    horizon = number_entry(entry, "horizon")
    return f"> {horizon:g}" if key in LIMITS and entry.get(key) is None and horizon is not None else entry.get(key)


def telegrams_table(
    outcomes: Mapping[str, Mapping[str, int]], labels: Mapping[str, str], heading: str = "Receiver"
) -> Table:
    """What became of the telegrams in each receiver.

    Args:
        outcomes: number of telegrams by outcome, by name of the receiver. labels: texts for names.
        heading: what the receivers are called.
    """
    chosen = outcome_columns(outcomes.values())
    columns = [name_column("receiver", heading), *(Column(outcome, text) for outcome, text in chosen.items())]
    rows = [[labels.get(name, name), *(count.get(o, 0) for o in chosen)] for name, count in outcomes.items()]
    return Table("telegrams", columns, rows)


def _packets(result: Result) -> Table:
    """What became of the packets of each node, and how old what receivers hold is."""
    entry = mapping_entry(result, "network")
    nodes = entry.get("nodes", {})
    rows = [
        [name, ", ".join(nodes.get(name, ())), *(found.get(column.key) for column in _PACKET_COLUMNS)]
        for name, found in entry.get("packets", {}).items()
    ]
    return Table("packets", [name_column("node", "Node"), text_column("signals", "Signals"), *_PACKET_COLUMNS], rows)


def _indicators(result: Result, spec: ReportSpec) -> Table:
    """How long slip was indicated, and how late."""
    delay = "From the begin of the zone to the first indication in it"
    columns = [
        OBSERVER,
        Column("on", "Time on", "%", "Share of the time in which slip was indicated", factor=100.0),
        Column("on_outside", "Time on outside zones", "%", "Of the time outside of zones", factor=100.0),
        *(Column(f"delay {a:g}", f"Delay in zone {number(a)} to {number(b)} s", "s", delay) for a, b in spec.zones),
    ]
    rows: list[list[Any]] = []
    for s in indicator_statistics(result, spec):
        delays = [
            "not reached" if zone[0] >= result.time[-1] else "not indicated" if delay is None else delay
            for zone, delay in zip(spec.zones, s.delays, strict=True)
        ]
        rows.append([label(spec, s.observer), s.on, s.on_outside, *delays])
    return Table("indicators", columns, rows)


def _components(result: Result) -> Table:
    """What was run."""
    entries = [entry for entry in list_entry(result, "components") if isinstance(entry, Mapping)]
    return Table(
        "components", _COMPONENT_COLUMNS, [[entry.get(c.key) for c in _COMPONENT_COLUMNS] for entry in entries]
    )


def _messages(result: Result) -> Table:
    """What the components logged: the first and the last messages."""
    messages, half = list(result.messages), MESSAGES_SHOWN // 2
    shown = messages if len(messages) <= MESSAGES_SHOWN else [*messages[:half], *messages[-half:]]
    columns = [
        name_column("component", "Component"),
        Column("time", "Time", "s"),
        *(text_column(key, key.capitalize()) for key in ("status", "category", "text")),
    ]
    return Table("messages", columns, [[m.component, m.time, m.status, m.category or DASH, m.text] for m in shown])


def _versions(result: Result) -> Table:
    """Versions of the packages that were used."""
    columns = [name_column("package", "Package"), text_column("version", "Version")]
    return Table("versions", columns, list(mapping_entry(result, "versions").items()))

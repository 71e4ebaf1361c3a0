"""What ``cosim baseline`` says of a baseline and of a change of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cosim.baselines.call import Call
from cosim.baselines.draft import value_range
from fmus.cli.output import Output
from fmus.tables.table import Parts, Table, name_column, text_column

if TYPE_CHECKING:
    from cosim.baselines import Baseline
    from cosim.baselines.update import Update

_COLUMNS = (
    name_column("signal"),
    text_column("allowed", meaning="How far a value may differ", write="+- {:.3g}".format),
    text_column("unit"),
    text_column("description"),
)


def change_output(update: Update, path: Path) -> Output:
    """What was written.

    Args:
        update: what was changed. path: of the baseline.
    """
    notes = [*update.notes, *(Call.worst(update.before) if update.before is not None else [])]
    rows = update.after.baseline.header.rows if update.after.baseline is not None else 0
    line = f"{path}: {update.change}, {len(update.after.signals)} signals, {rows} rows."
    data = {"file": str(path), "change": update.change, "notes": notes}
    return Output(["\n".join([line, *(f"  {note}" for note in notes)])], data)


def header_parts(baseline: Baseline) -> Parts:
    """What a baseline is of."""
    header = baseline.header
    span = header.span
    telegrams = "" if header.events is None else f", {header.events} telegrams"
    lines = [
        f"{baseline.path}: {header.title}",
        f"  {span['start']:g} to {span['stop']:g} s at {span['step']:g} s steps; {header.rows} rows{telegrams}",
        f"  run again from: {header.recipe.source or 'nothing (made from a result)'}",
    ]
    for entry in header.components:
        file = f", {entry.file}" if entry.file else ""
        lines.append(f"  {entry.name}: model {entry.model}, FMI {entry.fmi_version}, GUID {entry.guid}{file}")
        lines += [f"    {name} = {value}" for name, value in entry.parameters.items()]
    versions = ", ".join(f"{name} {value}" for name, value in header.versions.items()) or "not known"
    remarks = [f"ignored: {pattern}" for pattern in header.tolerances.ignore]
    remarks += [f"note: {note}" for note in baseline.notes]
    rows = [[info.name, _allowed(baseline, info.name), info.unit, info.description] for info in header.signals]
    text = "\n".join([*lines, f"  made with: {versions}"])
    return [text, Table("allowed", _COLUMNS, rows), "\n".join(f"  {remark}" for remark in remarks)]


def _allowed(baseline: Baseline, name: str) -> float:
    """Largest error of a signal that is allowed, in its unit."""
    return baseline.tolerances.for_signal(name).value_for(value_range(baseline.result.table[name]))

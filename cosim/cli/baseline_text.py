"""What ``cosim baseline`` prints: a baseline, a comparison, a change. Prints only."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cosim.baselines.call import Call
from cosim.baselines.draft import value_range
from cosim.cli.output import print_json
from cosim.comparison.comparison_text import comparison_text
from fmus.text_table import text_table

if TYPE_CHECKING:
    from cosim.baselines import Baseline, Regression
    from cosim.baselines.update import Update


def print_comparison(found: Regression, verbose: bool) -> None:
    """Print a comparison.

    Args:
        found: what the check found. verbose: all signals, not only those that differ.
    """
    print(comparison_text(found, verbose=verbose))


def print_change(update: Update, path: Path, as_json: bool) -> None:
    """Print what was written.

    Args:
        update: what was changed. path: of the baseline. as_json: print JSON.
    """
    worst = Call.worst(update.before) if update.before is not None else []
    if as_json:
        print_json({"file": str(path), "change": update.change, "notes": [*update.notes, *worst]})
        return
    rows = update.after.baseline.header.rows if update.after.baseline is not None else 0
    print(f"{path}: {update.change}, {len(update.after.signals)} signals, {rows} rows.")
    for line in (*update.notes, *worst):
        print(f"  {line}")


def print_header(baseline: Baseline) -> None:
    """Print what a baseline is of."""
    header = baseline.header
    span = header.span
    telegrams = "" if header.events is None else f", {header.events} telegrams"
    print(f"{baseline.path}: {header.title}")
    print(f"  {span['start']:g} to {span['stop']:g} s at {span['step']:g} s steps; {header.rows} rows{telegrams}")
    print(f"  run again from: {header.recipe.source or 'nothing (made from a result)'}")
    for entry in header.components:
        file = f", {entry.file}" if entry.file else ""
        print(f"  {entry.name}: model {entry.model}, FMI {entry.fmi_version}, GUID {entry.guid}{file}")
        for name, value in entry.parameters.items():
            print(f"    {name} = {value}")
    print("  made with: " + (", ".join(f"{name} {value}" for name, value in header.versions.items()) or "not known"))
    rows = [[info.name, _allowed(baseline, info.name), info.unit, info.description] for info in header.signals]
    for line in text_table(rows, left=range(4)):
        print(f"  {line}")
    for pattern in header.tolerances.ignore:
        print(f"  ignored: {pattern}")
    for note in baseline.notes:
        print(f"  note: {note}")


def _allowed(baseline: Baseline, name: str) -> str:
    allowed = baseline.tolerances.for_signal(name).value_for(value_range(baseline.result.table[name]))
    return f"+- {allowed:.3g}"

"""What a scenario shows of itself: what it is in a sentence, its components, its connections. Works on plain tables,
complete or not.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.scenario.paths import COMPONENT_PATHS, MODEL_KEYS
from fmus.tables.table import SCREEN_ROWS, Parts, Table, name_column, text_column

_COLUMNS = (
    name_column("component", "component"),
    text_column("kind", "kind"),
    text_column("what", "what it is"),
    text_column("preset", "preset"),
    text_column("parameters", "parameters", "Start values that the scenario states"),
)
_SHOWN = 4
"""Parameters of a component that are shown."""


def scenario_screen(name: str, data: Mapping[str, Any], fault: str) -> Parts:
    """The first screen of a scenario.

    Args:
        name: of the scenario. data: its keys. fault: why it cannot be run yet, in a line; empty where it can.
    """
    components = data.get("components") or {}
    lines = [str(line) for line in data.get("connections") or []]
    counts = [f"{len(components)} components", f"{len(lines)} connections"]
    counts += [f"{key}" for key in ("balises", "network") if data.get(key)]
    counts += [f"{len(data['expect'])} expectations"] if data.get("expect") else []
    counts += [f"{len(data['cases'])} cases"] if data.get("cases") else []
    table = Table("components", _COLUMNS, [_row(*entry) for entry in components.items()]).filled()
    more = [f"... and {len(lines) - SCREEN_ROWS} more connections"] if len(lines) > SCREEN_ROWS else []
    return [
        f"{data.get('title') or name}: {_times(data)}{', '.join(counts)}.",
        f"Not ready to run: {fault}" if fault else "",
        table,
        "\n".join([*lines[:SCREEN_ROWS], *more]),
    ]


def _times(data: Mapping[str, Any]) -> str:
    stop, step = data.get("stop"), data.get("step")
    span = f"{data.get('start', 0.0)} to {stop} s" if stop is not None else ""
    steps = f"steps of {step} s" if step is not None else ""
    return "".join(f"{text}, " for text in (span, steps) if text)


def _row(name: str, table: Any) -> list[str | None]:
    """A component; the name of a file without its folder."""
    stated = table if isinstance(table, Mapping) else {}
    kind = next((key for key in (*COMPONENT_PATHS, *MODEL_KEYS) if stated.get(key) is not None), "")
    what = str(stated.get(kind, ""))
    parameters = [f"{key} = {value}" for key, value in (stated.get("parameters") or {}).items()]
    shown = ", ".join(parameters[:_SHOWN]) + (f", {len(parameters) - _SHOWN} more" if len(parameters) > _SHOWN else "")
    short = Path(what).name if kind in COMPONENT_PATHS else what
    return [name, kind, short, stated.get("preset"), shown[:120] or None]

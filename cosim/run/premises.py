"""What a run says of observers whose Takagi-Sugeno model was left: premises outside their bounds.

Some observers count that themselves, in outputs; of the train observers it is read off the recorded rows after the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cosim.coupling.connection import Connection
from cosim.run.component_models import make_system, values_in_use
from cosim.scenario.scenario_tables import ComponentTable

COUNT, TIME = "premise_violations", "premise_outside_time"
ADVICE = (
    "there the nearest of its linear models stood in. Widen the bounds and design the gains anew, or count this as an "
    "error of the model."
)


def premise_findings(
    table: np.ndarray, components: Mapping[str, ComponentTable], connections: Sequence[Connection]
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """How long, and at how many samples where that is known, premises were outside their bounds.

    Args:
        table: rows of a run, fields `component.signal`, in the components' own units.
        components: tables by name. connections: where inputs come from.

    Returns:
        Findings by component, for the summary; and a warning for each that has left its model. Below the lowest vertex
        of a train, where it starts and stops, the drag is too small to matter: that is found and not warned of.
    """
    findings: dict[str, dict[str, Any]] = {}
    warnings = []
    for name, component in components.items():
        counted, seen = _counted(table, name), _seen(table, name, component, connections)
        if counted is not None and any(counted.values()):
            findings[name] = counted
            samples = f"at {counted['samples']} sample(s) and " if "samples" in counted else ""
            text = f"{samples}for {counted['seconds_outside']:.3g} s; {ADVICE}"
            what = "what its Takagi-Sugeno model mixes linear ones by (a premise)"
            warnings.append(f"{name}: {what} was outside its bounds {text}")
        elif seen is not None and (seen["seconds_below"] or seen["seconds_above"]):
            findings[name] = seen
            if seen["seconds_above"]:
                text = (
                    f"its Takagi-Sugeno model is made for {seen['premise']} values up to {seen['bounds'][1]:g} m/s; "
                    f"they were above for {seen['seconds_above']:.3g} s"
                )
                warnings.append(f"{name}: {text}; {ADVICE}")
    return findings, warnings


def _counted(table: np.ndarray, name: str) -> dict[str, Any] | None:
    """What an observer counted itself."""
    fields = table.dtype.names or ()
    if f"{name}.{TIME}" not in fields or not len(table):
        return None
    found: dict[str, Any] = {"seconds_outside": float(table[f"{name}.{TIME}"][-1])}
    return found | ({"samples": int(table[f"{name}.{COUNT}"][-1])} if f"{name}.{COUNT}" in fields else {})


def _seen(
    table: np.ndarray, name: str, component: ComponentTable, connections: Sequence[Connection]
) -> dict[str, Any] | None:
    """What the recorded rows show of a train observer: each value counts until the next row."""
    system: Any = make_system(component, name) if component.observer is not None else None
    if not hasattr(system, "premise_range"):
        return None
    values = values_in_use(component, system)
    signal, low, high = system.premise_range(values)
    column = _column(table, name, signal, connections)
    if column is None or len(column) < 2:
        return None
    spans = np.diff(table["time"])
    below, above = (float(spans[outside[:-1]].sum()) for outside in (column < low, column > high))
    return {"premise": signal, "bounds": [low, high], "seconds_below": below, "seconds_above": above}


def _column(table: np.ndarray, name: str, signal: str, connections: Sequence[Connection]) -> np.ndarray | None:
    """Recorded values of an output, or of the output an input comes from, in the unit of the input; None where not
    recorded.
    """
    fields = table.dtype.names or ()
    if f"{name}.{signal}" in fields:
        return np.asarray(table[f"{name}.{signal}"], dtype=float)
    for c in connections:
        if c.target == (name, signal) and ".".join(c.source) in fields:
            return np.asarray(c.factor * table[".".join(c.source)] + c.offset, dtype=float)
    return None

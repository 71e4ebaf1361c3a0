"""The roles of a result that was read back: as its summary states them, or guessed from the names. Imports NumPy
only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from math import isfinite
from typing import Any

from cosim.evaluation.spec import Phase, ReportSpec
from cosim.evaluation.summary_entries import mapping_entry
from cosim.results.result import Result

_SPEC_ENTRY = "report"  # of the summary
_SIGNAL_ROLES = (*(f.name for f in fields(ReportSpec) if f.name.startswith("true_")), "odometer", "speed_reference")
_GUESSED = {  # role: signal of a plant
    "true_position": "position",
    "true_speed": "speed",
    "true_slip": "slip",
    "true_adhesion_force": "adhesion_force",
}


def spec_of(result: Result, fallback_title: str = "Co-simulation") -> ReportSpec:
    """The roles for the report of a result.

    Args:
        result: the run; its summary holds the roles since they are written there, those of an older one are guessed.
        fallback_title: title where the summary has none.

    Returns:
        The roles as they were stored, else from the names: an observer is a component with an ``innovation`` or a
        ``slip_indicator`` beside a ``position`` or ``speed``; the plant is the first other component with both of
        these.
    """
    stored = mapping_entry(result, _SPEC_ENTRY)
    title = result.summary.get("title")
    default = title if isinstance(title, str) and title else fallback_title
    return _stored(stored, default) if stored else _guessed(result, default)


def is_guessed(result: Result) -> bool:
    """Whether the summary is silent about the roles.

    Args:
        result: with its summary.
    """
    return not mapping_entry(result, _SPEC_ENTRY)


def _stored(data: Mapping[str, Any], title: str) -> ReportSpec:
    roles = {role: data[role] for role in _SIGNAL_ROLES if isinstance(data.get(role), str)}
    return ReportSpec(
        title=data["title"] if isinstance(data.get("title"), str) else title,
        **roles,
        observers=[str(name) for name in _list(data.get("observers"))],
        other_trains=[str(name) for name in _list(data.get("other_trains"))],
        labels={name: str(text) for name, text in _mapping(data.get("labels")).items()},
        phases=[
            Phase(str(p["name"]), float(p["start"]), float(p["end"])) for p in _list(data.get("phases")) if _is_phase(p)
        ],
        zones=[(float(z[0]), float(z[1])) for z in _list(data.get("zones")) if _is_zone(z)],
        evaluate_after=_number(data.get("evaluate_after")),
        detection=data["detection"] if isinstance(data.get("detection"), str) else ReportSpec.detection,
        delay_limit=_number(data["delay_limit"]) if data.get("delay_limit") is not None else None,
        published=_numbers(data.get("published")),
        independent=_numbers(data.get("independent")),
        notes=[str(note) for note in _list(data.get("notes"))],
    )


def _guessed(result: Result, title: str) -> ReportSpec:
    signals: dict[str, set[str]] = {}
    for column in (result.table.dtype.names or ())[1:]:
        component, _, signal = column.partition(".")
        signals.setdefault(component, set()).add(signal)
    estimates, marks = {"position", "speed"}, {"innovation", "slip_indicator"}
    observers = [name for name, own in signals.items() if own & estimates and own & marks]
    plants = [name for name, own in signals.items() if estimates <= own and name not in observers]
    roles = {} if not plants else {r: f"{plants[0]}.{s}" for r, s in _GUESSED.items() if s in signals[plants[0]]}
    if "reading" in signals.get("odometer", ()):
        roles["odometer"] = "odometer.reading"
    return ReportSpec(title=title, observers=observers, **roles)  # type: ignore[arg-type]  # names of roles only


def _list(value: Any) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else ()


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value)


def _number(value: Any) -> float:
    return float(value) if _is_number(value) else 0.0


def _is_phase(value: Any) -> bool:
    return (
        isinstance(value, Mapping)
        and "name" in value
        and _is_number(value.get("start"))
        and _is_number(value.get("end"))
    )


def _is_zone(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and len(value) == 2 and all(map(_is_number, value))


def _numbers(value: Any) -> dict[str, dict[str, float]]:
    """``{observer: {phase: number}}``, without what is none."""
    tables = {name: _mapping(row) for name, row in _mapping(value).items()}
    return {name: {phase: float(v) for phase, v in row.items() if _is_number(v)} for name, row in tables.items()}

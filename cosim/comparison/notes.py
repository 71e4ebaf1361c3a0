"""What to know beside a comparison: other versions, parameters, FMUs, a run that ended early, tolerances that fit
nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cosim.comparison.tolerance import Tolerances
from cosim.errors import nearest
from cosim.results.result import Result

_RUN_KEYS = ("scenario", "start", "stop", "step")
COMPONENT_KEYS = {"model": "is model", "guid": "has the GUID", "fmi_version": "has FMI version", "preset": "has preset"}


def notes(reference: Result, result: Result, tolerances: Tolerances, labels: tuple[str, str]) -> list[str]:
    """Lines for people; empty where there is nothing to know.

    Args:
        reference: what was compared with.
        result: what was compared.
        tolerances: what is allowed, signal by signal.
        labels: what result and reference are called.
    """
    lines = [
        f"{label}: the run ended early: {side.failure}"
        for label, side in zip(labels, (reference, result), strict=True)
        if side.failure is not None
    ]
    bare = [tells_no_units(side) for side in (reference, result)]
    if bare[0] != bare[1]:
        without, with_units = labels if bare[0] else labels[::-1]
        lines.append(f"{without} names no units; its numbers were taken to be in those of {with_units}.")
    one, two = reference.summary, result.summary
    lines += [
        f"{key}: {two[key]} instead of {one[key]}."
        for key in _RUN_KEYS
        if key in one and key in two and one[key] != two[key]
    ]
    lines += _versions(one.get("versions"), two.get("versions"))
    lines += _components(one.get("components"), two.get("components"))
    names = list(dict.fromkeys([*_names(reference), *_names(result)]))
    lines += [
        f"The tolerance for {given!r} fits no signal; {nearest(given, names)}" for given in tolerances.unused(names)
    ]
    return lines


def tells_no_units(side: Result) -> bool:
    """Whether it is a mere table without any unit, as most CSV files are: not a run, whose pure numbers are meant
    so.

    Args:
        side: result or reference.
    """
    return "components" not in side.summary and all(info.unit in ("", "1") for info in side.signals)


def _names(side: Result) -> list[str]:
    return list(side.table.dtype.names or ())[1:]


def _versions(one: Any, two: Any) -> list[str]:
    if not isinstance(one, Mapping) or not isinstance(two, Mapping):
        return []
    other = [f"{name} {two[name]} instead of {one[name]}" for name in one if name in two and one[name] != two[name]]
    return [f"Other versions: {', '.join(other)}."] if other else []


def _components(one: Any, two: Any) -> list[str]:
    if not (_is_list(one) and _is_list(two)):
        return []
    known = {entry["name"]: entry for entry in two}
    lines = []
    for entry in (e for e in one if e["name"] in known):
        now, name = known[entry["name"]], entry["name"]
        lines += [
            f"{name} {verb} {now[key]} instead of {entry[key]}."
            for key, verb in COMPONENT_KEYS.items()
            if key in entry and key in now and entry[key] != now[key]
        ]
        lines += _parameters(name, entry.get("parameters"), now.get("parameters"))
    return lines


def _parameters(name: str, one: Any, two: Any) -> list[str]:
    if not isinstance(one, Mapping) or not isinstance(two, Mapping) or one == two:
        return []
    return [
        f"Parameter {name}.{key} is {two.get(key, 'its default')} instead of {one.get(key, 'its default')}."
        for key in {**one, **two}
        if str(one.get(key)) != str(two.get(key))
    ]


def _is_list(entries: Any) -> bool:
    return isinstance(entries, Iterable) and all(isinstance(e, Mapping) and "name" in e for e in entries)

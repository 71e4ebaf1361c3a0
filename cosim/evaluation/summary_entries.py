"""What a report says of a run besides its numbers, taken from the summary; every entry may be missing.

Entries read: ``scenario``, ``description`` (texts), ``start``, ``reached``, ``step``, ``wall_seconds`` [s],
``real_time_factor`` [1], ``localisation`` (``method`` and ``reason``), ``warnings`` and ``notes`` (texts),
``components`` (mappings with ``name``, ``kind``, ``fmi_version``, ``model`` and ``source``), ``certificates`` (by
observer: ``aperiodic_limit`` [s], ``constant_limit`` [s], ``max_gap`` [s], ``largest_gap_seen`` [s], ``holds`` and
``explanation``), ``seed_study`` (``seeds`` and ``rows``) and ``versions``. Standard library only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from cosim.results.result import Result
from fmus.tables.numbers import instant, number


def mapping_entry(result: Result, key: str) -> Mapping[str, Any]:
    """An entry that is a mapping; empty where it is missing or something else.

    Args:
        result: the run.
        key: of the summary.
    """
    value = result.summary.get(key)
    return value if isinstance(value, Mapping) else {}


def list_entry(result: Result, key: str) -> list[Any]:
    """An entry that is a list; a single text counts as one item, a missing entry as none.

    Args:
        result: the run.
        key: of the summary.
    """
    value = result.summary.get(key)
    if isinstance(value, str):
        return [value]
    return list(value) if isinstance(value, Sequence) else []


def number_entry(entries: Mapping[str, Any], key: str) -> float | None:
    """A finite number, or None.

    Args:
        entries: the summary, or a part of it.
        key: of the entry.
    """
    value = entries.get(key)
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value) else None


def certified_gap(entry: Mapping[str, Any]) -> float | None:
    """Longest gap that a certificate covers, as far as was looked [s]; None where it covers every gap.

    Args:
        entry: of one observer, under ``certificates``.
    """
    return number_entry(entry, "certified_up_to" if "certified_up_to" in entry else "aperiodic_limit")


def localisation(result: Result) -> str:
    """How the crossings were found and why so: from the summary, or else from the telegrams; empty where neither
    says.

    Args:
        result: the run.
    """
    stated = mapping_entry(result, "localisation")
    if not stated:
        methods = sorted({event.method for event in result.events if event.method})
        return f"Balises were located by {', '.join(map(repr, methods))}." if methods else ""
    reason = f": {stated['reason']}" if stated.get("reason") else ""
    return f"Balises were located by {str(stated.get('method'))!r}{reason.rstrip('.')}."


def _duration(result: Result) -> float:
    start, reached = number_entry(result.summary, "start"), number_entry(result.summary, "reached")
    if start is not None and reached is not None:
        return reached - start
    return float(result.time[-1] - result.time[0]) if len(result.time) else 0.0


def statement(result: Result) -> str:
    """A few sentences: what was run, for how long, at which step, how fast, and how balises were found.

    Args:
        result: the run.
    """
    duration, step = _duration(result), number_entry(result.summary, "step")
    wall, factor = number_entry(result.summary, "wall_seconds"), number_entry(result.summary, "real_time_factor")
    if factor is None and wall:
        factor = duration / wall
    scenario = result.summary.get("scenario")
    text = f"Scenario {scenario}" if isinstance(scenario, str) else "This run"
    text += f" covers {instant(duration)} s of simulated time"
    text += f" in communication steps of {number(1000 * step)} ms" if step is not None else ""
    text += f"; it took {number(wall)} s of wall time" if wall is not None else ""
    text += f", {number(factor)} times as fast as real time" if factor is not None else ""
    return f"{text}. {localisation(result)}".rstrip()

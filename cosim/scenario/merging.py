"""Merging the tables of one scenario file into those of the files it includes. Plain data only; touches no files.

Later wins, table by table: tables are merged key by key, everything else is replaced, and ``false`` removes a table.
Connections are appended: a later one to the same input replaces the earlier, and ``-> component.input`` leaves that
input free.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cosim.errors import ScenarioError, nearest

_ORIGINS = ("fmu", "model", "observer", "recording")
FILES = ("fmu", "recording")
BETWEEN_TARGETS = re.compile(r",(?![^\[\]]*\])")
"""A comma, but not one between the indices of an array element."""

Line = tuple[Any, str]
"""A connection, and the file it stands in."""


def merge(earlier: dict[str, Any], later: Mapping[str, Any]) -> None:
    """Merge tables into earlier ones, in place; connections are not looked at (see `join`).

    Args:
        later: what comes on top.
    """
    _merge({k: v for k, v in later.items() if k != "connections"}, earlier, ())


def _merge(later: Mapping[str, Any], earlier: dict[str, Any], path: tuple[str, ...]) -> None:
    for name, value in later.items():
        before = earlier.get(name)
        if not isinstance(before, dict):
            earlier[name] = value
        elif value is False:
            del earlier[name]
        elif isinstance(value, dict) and not (path == ("components",) and _is_another(before, value)):
            _merge(value, before, (*path, name))
        else:
            earlier[name] = value


def _is_another(before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Whether a component is another model now, so that what was said of the former does not hold.

    Another file of an FMU is not another model: a new delivery keeps its parameters.
    """
    named, former = ({key for key in _ORIGINS if key in table} for table in (after, before))
    return bool(named) and (named != former or any(before[key] != after[key] for key in named - set(FILES)))


def join(earlier: Sequence[Line], later: Sequence[Line], removed: Iterable[str]) -> list[Line]:
    """Earlier and later connections together.

    Args:
        earlier, later: connections as written, lines or tables. removed: components that are gone, with their
            connections.

    Raises:
        ScenarioError: an input is to be left free that nothing is connected to.
    """
    gone, taken = set(removed), {target for item, _ in later for target in _targets(item)}
    targets = [target for item, _ in earlier for target in _targets(item)]
    for item, _ in later:
        for target in _targets(item) if _frees(item) else ():
            if target not in targets:
                raise ScenarioError(
                    f"connections: {item!r}: no included file connects this input; {nearest(target, targets)}"
                )
    kept = [(left, place) for item, place in earlier if (left := _without(item, taken, gone)) is not None]
    return [*kept, *((item, place) for item, place in later if not _frees(item))]


def _frees(item: Any) -> bool:
    return isinstance(item, str) and item.strip().startswith("->")


def _targets(item: Any) -> list[str]:
    if isinstance(item, dict):
        return [str(item.get("to", ""))]
    return [name.strip() for name in BETWEEN_TARGETS.split(item.partition("->")[2])] if isinstance(item, str) else []


def _source(item: Any) -> str:
    return str(item.get("from", "")) if isinstance(item, dict) else str(item).partition("->")[0].strip()


def _without(item: Any, taken: set[str], gone: set[str]) -> Any:
    """A connection without the targets that are taken or gone; None where nothing is left of it."""
    targets = _targets(item)
    left = [t for t in targets if t not in taken and t.partition(".")[0] not in gone]
    if not left or _source(item).partition(".")[0] in gone:
        return None if targets else item  # what has no targets is refused later, as what it is
    return item if left == targets else f"{_source(item)} -> {', '.join(left)}"

"""Sampling: the variations of a sweep, as a grid, side by side, or as points of distributions. Knows no scenarios."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Sized
from itertools import islice, product
from math import prod
from typing import Any, Literal, get_args

from cosim.errors import ScenarioError
from cosim.scenario.toml_values import plain
from cosim.studies.distributions import Distribution, Entries, Method, unit_points

Mode = Literal["grid", "zip", "latin", "random", "sobol"]
Variation = dict[str, Any]
MOST = 100_000
"""A sweep of more variations is taken for a slip: checking them alone would take minutes."""


def variations(
    values: Mapping[str, Iterable[Any] | Distribution] | Sequence[Mapping[str, Any]],
    mode: Mode,
    count: int | None,
    seed: int,
) -> list[Variation]:
    """The variations of a sweep, in order; arguments as for `cosim.Scenario.vary`.

    Args:
        values: values or distributions by name of the setting.
        mode: ``grid``, ``zip``, ``latin``, ``random`` or ``sobol``, see `Scenario.vary`.
        count: number of runs where they are drawn.
        seed: of the drawing.

    Raises:
        ScenarioError: there are none, a list is missing, or lists of different length stand side by side.
    """
    if not isinstance(values, Mapping):
        return _listed(values)
    if mode not in get_args(Mode):
        raise ScenarioError(f"vary: mode {mode!r} is none of {', '.join(map(repr, get_args(Mode)))}.")
    if not values:
        raise ScenarioError("vary: nothing is varied; expected for instance {'plant.mass': [70e3, 80e3]}.")
    if mode != "grid" and mode != "zip":  # noqa: PLR1714 # so that type checkers follow
        return _sampled({name: drawn_from(name, stated) for name, stated in values.items()}, mode, count, seed)
    if count is not None:
        raise ScenarioError(f"vary: 'count' belongs to mode 'latin', 'random' or 'sobol', not to {mode!r}.")
    lists = {name: _entries(name, stated) for name, stated in values.items()}
    if mode == "zip" and len({len(entries) for entries in lists.values()}) > 1:
        lengths = ", ".join(f"{name} {len(entries)}" for name, entries in lists.items())
        raise ScenarioError(f"vary: mode 'zip' needs lists of one length (got {lengths}).")
    if mode == "grid":
        _check_count(prod(len(entries) for entries in lists.values()))
    rows = zip(*lists.values(), strict=True) if mode == "zip" else product(*lists.values())
    return [dict(zip(lists, row, strict=True)) for row in rows]


def _check_count(count: int) -> None:
    if count > MOST:
        raise ScenarioError(
            f"vary: {count} variations are more than {MOST}; give fewer values, or mode 'latin' (--samples) with fewer "
            f"points."
        )


def _listed(values: Any) -> list[Variation]:
    rows = list(values) if isinstance(values, Iterable) and not isinstance(values, str) else []
    if not rows or not all(isinstance(row, Mapping) and row for row in rows):
        raise ScenarioError(
            "vary: expected names with lists of values, or a list of tables such as [{'plant.mass': 70e3}, ...]."
        )
    return [plain(row) for row in rows]


def drawn_from(name: str, stated: Any) -> Distribution:
    """What the values of one name are drawn from.

    Args:
        name: for messages. stated: a distribution, or a list of which each entry is as likely.
    """
    return stated if hasattr(stated, "at") else Entries(_entries(name, stated))


def _entries(name: str, stated: Any) -> list[Any]:
    """The values of one name as a list."""
    if hasattr(stated, "at"):
        raise ScenarioError(
            f"vary: {name}: a range is sampled; use mode='latin' or 'random' with count=..., or give a list."
        )
    if isinstance(stated, str | bytes | Mapping) or not isinstance(stated, Iterable):
        raise ScenarioError(f"vary: {name}: expected a list of values (got {stated!r}).")
    # an endless or huge iterable is not listed to its end
    entries = [plain(entry) for entry in islice(stated, MOST + 1)]
    _check_count(len(stated) if isinstance(stated, Sized) else len(entries))
    if not entries:
        raise ScenarioError(f"vary: {name}: the list of values is empty.")
    return entries


def _sampled(drawn: Mapping[str, Distribution], mode: Method, count: int | None, seed: int) -> list[Variation]:
    """Points of the unit cube, each coordinate taken to the value of one name."""
    if count is None or count < 1:
        raise ScenarioError(f"vary: mode {mode!r} needs count=..., the number of points, at least 1 (got {count!r}).")
    _check_count(count)
    points = unit_points(mode, count, len(drawn), seed)
    return [{name: one.at(float(u)) for (name, one), u in zip(drawn.items(), row, strict=True)} for row in points]

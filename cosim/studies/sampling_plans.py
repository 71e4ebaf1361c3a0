"""Sampling: the variations of a sweep, as a grid, side by side, or as points spread over ranges. Knows no scenarios."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Sized
from dataclasses import dataclass
from itertools import islice, product
from math import exp, floor, isfinite, log, prod
from typing import Any, Literal

import numpy as np
import scipy

from cosim.errors import ScenarioError
from cosim.scenario.toml_values import plain

Mode = Literal["grid", "zip", "latin", "random"]
Variation = dict[str, Any]
MOST = 100_000
"""A sweep of more variations is taken for a slip: checking them alone would take minutes."""


@dataclass(frozen=True)
class Range:
    """A range to take points from, both ends included where the numbers are whole.

    Args:
        low, high: its ends. kind: ``uniform``, ``log`` (uniform in the logarithm) or ``whole`` (whole numbers).
    """

    low: float
    high: float
    kind: Literal["uniform", "log", "whole"] = "uniform"

    def __post_init__(self) -> None:
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ScenarioError(
                f"A range needs two finite ends, the lower one first (got {self.low!r} and {self.high!r})."
            )
        if self.kind == "log" and not self.low > 0.0:
            raise ScenarioError(f"A logarithmic range begins above zero (got {self.low!r}).")

    def at(self, share: float) -> float | int:
        """The point at a share of the range, 0 <= share < 1.

        Args:
            share: from 0 to 1.
        """
        if self.kind == "log":
            return exp(log(self.low) + share * (log(self.high) - log(self.low)))
        if self.kind == "whole":
            return floor(self.low + share * (self.high - self.low + 1))
        return self.low + share * (self.high - self.low)


def uniform(low: float, high: float) -> Range:
    """All numbers from `low` to `high`, equally likely."""
    return Range(float(low), float(high))


def log_uniform(low: float, high: float) -> Range:
    """All numbers from `low` to `high`, every factor equally likely."""
    return Range(float(low), float(high), "log")


def whole(low: int, high: int) -> Range:
    """All whole numbers from `low` to `high`, both included, equally likely."""
    return Range(low, high, "whole")


def variations(
    values: Mapping[str, Iterable[Any] | Range] | Sequence[Mapping[str, Any]], mode: Mode, count: int | None, seed: int
) -> list[Variation]:
    """The variations of a sweep, in order; arguments as for `cosim.Scenario.vary`.

    Args:
        values: values or ranges by name of the setting.
        mode: ``grid``, ``zip``, ``latin`` or ``random``, see `Scenario.vary`.
        count: number of runs where they are drawn.
        seed: of the drawing.

    Raises:
        ScenarioError: there are none, a list is missing, or lists of different length stand side by side.
    """
    if not isinstance(values, Mapping):
        return _listed(values)
    if mode not in ("grid", "zip", "latin", "random"):
        raise ScenarioError(f"vary: mode {mode!r} is none of 'grid', 'zip', 'latin' and 'random'.")
    if not values:
        raise ScenarioError("vary: nothing is varied; expected for instance {'plant.mass': [70e3, 80e3]}.")
    if mode in ("latin", "random"):
        return _sampled(
            {name: _choices(name, stated, ranges=True) for name, stated in values.items()}, mode, count, seed
        )
    if count is not None:
        raise ScenarioError(f"vary: 'count' belongs to mode 'latin' or 'random', not to {mode!r}.")
    lists = {name: _choices(name, stated, ranges=False) for name, stated in values.items()}
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


def _choices(name: str, stated: Any, ranges: bool) -> Any:
    """The values of one name as a list; a range as it is, where it may be one."""
    if isinstance(stated, Range):
        if not ranges:
            raise ScenarioError(
                f"vary: {name}: a range is sampled; use mode='latin' or 'random' with count=..., or give a list."
            )
        return stated
    if isinstance(stated, str | bytes | Mapping) or not isinstance(stated, Iterable):
        raise ScenarioError(f"vary: {name}: expected a list of values (got {stated!r}).")
    # an endless or huge iterable is not listed to its end
    entries = [plain(entry) for entry in islice(stated, MOST + 1)]
    _check_count(len(stated) if isinstance(stated, Sized) else len(entries))
    if not entries:
        raise ScenarioError(f"vary: {name}: the list of values is empty.")
    return entries


def _sampled(choices: Mapping[str, Any], mode: Mode, count: int | None, seed: int) -> list[Variation]:
    """Points of a Latin hypercube, or independent ones; a list takes the place of a range by its entries."""
    if count is None or count < 1:
        raise ScenarioError(f"vary: mode {mode!r} needs count=..., the number of points, at least 1 (got {count!r}).")
    _check_count(count)
    if mode == "latin":
        points = scipy.stats.qmc.LatinHypercube(d=len(choices), seed=seed).random(count)
    else:
        points = np.random.default_rng(seed).random((count, len(choices)))
    return [
        {name: _pick(stated, float(u)) for (name, stated), u in zip(choices.items(), row, strict=True)}
        for row in points
    ]


def _pick(stated: Any, share: float) -> Any:
    return stated.at(share) if isinstance(stated, Range) else stated[int(share * len(stated))]

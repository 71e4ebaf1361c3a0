"""What varies in a campaign: from a point of the unit cube to settings, a pure function; and points that meet
conditions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from cosim.campaign.conditions import Condition
from cosim.errors import ScenarioError
from cosim.studies.distributions import Distribution, Method, unit_points

_RAREST = 1000
"""Draws of which one at least must meet the conditions."""
_ENOUGH = 20 * _RAREST
"""Draws after which is judged that too few do: of one in 500 fewer than 20 come with probability 2e-4."""


@dataclass(frozen=True)
class VariedSettings:
    """What varies, and how.

    Args:
        drawn: distributions by name of the setting. correlations: of normal numbers behind pairs of them (a Gaussian
            copula; Nelsen, An Introduction to Copulas (2006), section 2.3): distributions stay as they are.
        where: conditions, as texts.

    Raises:
        ScenarioError: a condition cannot be read, or no distribution has these correlations together.
    """

    drawn: Mapping[str, Distribution]
    correlations: Sequence[tuple[str, str, float]] = ()
    where: Sequence[str] = ()

    def __post_init__(self) -> None:
        assert self._conditions is not None
        assert self._factor is not None or not self.correlations

    def settings(self, point: Sequence[float] | np.ndarray) -> dict[str, Any]:
        """The settings at a point; whether they meet the conditions is another question.

        Args:
            point: of the unit cube, a number from 0 to 1 (excluded) for each name, shape (names,).
        """
        shares = np.asarray(point, dtype=float)
        if self._factor is not None:
            normal = self._factor @ scipy.special.ndtri(np.clip(shares, 2.0**-53, 1.0 - 2.0**-53))
            shares = np.minimum(scipy.special.ndtr(normal), np.nextafter(1.0, 0.0))
        return {name: one.at(float(u)) for (name, one), u in zip(self.drawn.items(), shares, strict=True)}

    def unmet(self, settings: Mapping[str, Any]) -> Condition | None:
        """The first condition that settings do not meet; None where they meet all.

        Args:
            settings: values by name.
        """
        return next((one for one in self._conditions if not one.holds(settings)), None)

    def draw(self, method: Method, count: int, seed: int) -> list[dict[str, Any]]:
        """Settings of points that meet the conditions.

        Args:
            method: see `unit_points`. count: of settings. seed: of the points.

        Raises:
            ScenarioError: too few points meet a condition, which is named.
        """
        total = count
        while True:
            drawn = [self.settings(point) for point in unit_points(method, total, len(self.drawn), seed)]
            unmet = [self.unmet(settings) for settings in drawn] if self._conditions else [None] * total
            met = [settings for settings, condition in zip(drawn, unmet, strict=True) if condition is None]
            if len(met) >= count:
                return met[:count]
            if total >= _ENOUGH and len(met) * _RAREST < total:
                worst = max(self._conditions, key=lambda one: sum(condition is one for condition in unmet))
                raise ScenarioError(
                    f"campaign.where: {len(met)} of {total} draws meet all conditions, fewer than one in {_RAREST}; "
                    f"most fail {worst.text!r}."
                )
            total *= 2

    @cached_property
    def _conditions(self) -> list[Condition]:
        return [Condition(text, list(self.drawn)) for text in self.where]

    @cached_property
    def _factor(self) -> np.ndarray | None:
        """L of ``L L' = R``, the matrix of correlations; None where there are none."""
        if not self.correlations:
            return None
        names = list(self.drawn)
        R = np.eye(len(names))
        for first, second, value in self.correlations:
            i, j = names.index(first), names.index(second)
            R[i, j] = R[j, i] = value
        try:
            return np.linalg.cholesky(R)
        except np.linalg.LinAlgError:
            least = float(np.linalg.eigvalsh(R)[0])
            pairs = ", ".join(f"{a} and {b} {value:g}" for a, b, value in self.correlations)
            raise ScenarioError(
                f"campaign.correlate: no numbers are correlated so ({pairs}): their matrix must be positive definite "
                f"(its smallest eigenvalue is {least:.3g}). Take smaller correlations."
            ) from None

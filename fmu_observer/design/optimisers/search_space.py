"""`SearchSpace`: named parameters with bounds, linear or logarithmic, and the coordinates of a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from fmu_observer.design.optimisers.optimiser import Array


@dataclass(frozen=True)
class Bounded:
    """A parameter to be searched.

    Args:
        name: of the parameter. low, high: bounds, in its unit. log: searched in its logarithm.

    Raises:
        ValueError: the bounds are not finite, not in order, or not above zero where the search is logarithmic.
    """

    name: str
    low: float
    high: float
    log: bool = False

    def __post_init__(self) -> None:
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"{self.name}: expected two finite bounds, the lower one first (got {self.low!r} and {self.high!r})."
            )
        if self.log and not self.low > 0.0:
            raise ValueError(f"{self.name}: a logarithmic search begins above zero (got {self.low!r}).")


@dataclass(frozen=True)
class SearchSpace:
    """The parameters of a search.

    Args:
        parameters: with their bounds, at least one, no name twice.

    Raises:
        ValueError: there is none, or a name stands twice.
    """

    parameters: Sequence[Bounded]

    def __post_init__(self) -> None:
        if not self.parameters or len(set(self.names)) < len(self.parameters):
            raise ValueError(f"Expected parameters with different names (got {', '.join(self.names) or 'none'}).")

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [parameter.name for parameter in self.parameters]

    @property
    def lower(self) -> Array:
        """Lower bounds in search coordinates, shape (d,)."""
        return self.coordinates([p.low for p in self.parameters])

    @property
    def upper(self) -> Array:
        """Upper bounds in search coordinates, shape (d,)."""
        return self.coordinates([p.high for p in self.parameters])

    def coordinates(self, values: ArrayLike) -> Array:
        """Search coordinates of parameters.

        Args:
            values: in their units, shape (..., d).
        """
        array = np.asarray(values, float)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self._log, np.log(np.where(self._log, array, 1.0)), array)

    def values(self, coordinates: ArrayLike) -> Array:
        """Parameters in their units, shape (..., d).

        Args:
            coordinates: of the search, shape (..., d).
        """
        array = np.asarray(coordinates, float)
        found = np.where(self._log, np.exp(np.where(self._log, array, 0.0)), array)
        return np.clip(found, [p.low for p in self.parameters], [p.high for p in self.parameters])

    def named(self, coordinates: ArrayLike) -> dict[str, float]:
        """One candidate by name, in its units.

        Args:
            coordinates: of the search, shape (d,).
        """
        return dict(zip(self.names, map(float, self.values(coordinates)), strict=True))

    def without(self, fixed: Mapping[str, float]) -> SearchSpace:
        """The space without parameters that are held.

        Args:
            fixed: their values, by name.
        """
        return SearchSpace([p for p in self.parameters if p.name not in fixed])

    @property
    def _log(self) -> np.ndarray:
        return np.array([parameter.log for parameter in self.parameters])

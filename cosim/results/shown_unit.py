"""The unit in which numbers of a signal are shown to people, while they are kept in SI: the one decision for pages,
tables, texts and pictures. NumPy only.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite

import numpy as np

from plant_models.hybrid.units import Unit, UnitError, conversion, parse_unit


@dataclass(frozen=True, slots=True)
class ShownUnit:
    """A unit to show: ``kept = factor * shown + offset``.

    Args:
        name: of the unit, ``1`` for a pure number. factor, offset: above zero, and in the unit in which numbers are
            kept. kept: the name of that unit.
    """

    name: str = "1"
    factor: float = 1.0
    offset: float = 0.0
    kept: str = "1"

    @classmethod
    def first_of(cls, kept: str, names: Iterable[str | None], scale: tuple[float, float] | None = None) -> ShownUnit:
        """The first unit of some that numbers can be shown in.

        Args:
            kept: the unit in which they are kept. names: of the units that are wanted, the first before all others.
            scale: factor and offset of the first one, where its name does not say them.
        """
        for name in names:
            found = scale or (None if name is None else _scale(name, kept))
            if name is not None and found is not None and found[0] > 0.0 and all(map(isfinite, found)):
                return cls(name, *found, kept)
            scale = None
        return cls(kept, kept=kept)

    def values(self, kept: np.ndarray) -> np.ndarray:
        """Values as they are shown, shape as given.

        Args:
            kept: values as they are kept.
        """
        return kept if self.is_kept else np.asarray((np.asarray(kept) - self.offset) / self.factor)

    def value(self, kept: float) -> float:
        """A value as it is shown.

        Args:
            kept: the value as it is kept.
        """
        return (kept - self.offset) / self.factor

    def difference(self, kept: float) -> float:
        """A difference of two values as it is shown.

        Args:
            kept: the difference of values as they are kept.
        """
        return kept / self.factor

    def text(self, kept: float) -> str:
        """A value as people read it, with its unit.

        Args:
            kept: the value as it is kept.
        """
        return self._named(self.value(kept))

    def difference_text(self, kept: float) -> str:
        """A difference of two values as people read it, with its unit.

        Args:
            kept: the difference of values as they are kept.
        """
        return self._named(self.difference(kept))

    @property
    def is_kept(self) -> bool:
        """Whether numbers are shown as they are kept."""
        return (self.factor, self.offset) == (1.0, 0.0)

    def _named(self, number: float) -> str:
        return f"{number:.4g}" if self.name in ("", "1") else f"{number:.4g} {self.name}"


def shared_unit(units: Iterable[ShownUnit]) -> ShownUnit:
    """The unit of an axis that several signals have in common: the one in which all are shown, else the one in which
    they are kept.

    Args:
        units: of signals that are kept in the same unit; one at least.
    """
    first, *others = dict.fromkeys(units)
    return ShownUnit(first.kept, kept=first.kept) if others else first


def own_scale(name: str, unit: Unit) -> tuple[float, float] | None:
    """Factor and offset of a unit to SI where its name does not say them; None where everybody understands it so.

    Args:
        name: of the unit. unit: what it is.
    """
    own = unit.factor, unit.offset
    try:
        known = parse_unit(name)
    except UnitError:
        return own
    return None if (known.factor, known.offset) == own else own


def _scale(name: str, kept: str) -> tuple[float, float] | None:
    """Factor and offset as everybody understands the names; None where nobody does."""
    if name == kept:
        return 1.0, 0.0
    try:
        return conversion(parse_unit(name), parse_unit(kept))
    except UnitError:
        return None

"""Tolerances of a comparison: in value and in time, absolute and relative, for all signals or by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from fnmatch import fnmatchcase
from math import isfinite
from typing import Any

from cosim.comparison.curve import Curve
from cosim.errors import ComparisonError, nearest


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a signal may be from its reference.

    A value may differ by ``absolute + relative * range``, where range is largest minus smallest value of the reference,
    at least a millionth of its largest size, and that size where it is constant; of whole numbers that are held it is
    one at most, unless the tolerance is stated under its full name. An instant may differ by
    ``time + time_relative * length`` of the reference.

    Args:
        absolute: in the SI unit of the signal.
        relative: share of the range of the reference [1].
        time: [s].
        time_relative: share of the length of the reference [1].

    Raises:
        ComparisonError: a negative or infinite number.
    """

    absolute: float = 1e-9
    relative: float = 1e-4
    time: float = 1e-6
    time_relative: float = 0.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value < 0.0:
                raise ComparisonError(
                    f"Tolerance {entry.name} = {value!r}: expected a number that is zero or positive."
                )

    def value_for(self, scale: float) -> float:
        """Allowed difference in value, for a reference of range `scale`."""
        return self.absolute + self.relative * scale

    def time_for(self, length: float) -> float:
        """Allowed difference in time [s], for a reference of `length` [s]."""
        return self.time + self.time_relative * length


KEYS = tuple(entry.name for entry in fields(Tolerance))


def tolerance(stated: Tolerance | Mapping[str, Any] | float, base: Tolerance) -> Tolerance:
    """A tolerance as users write it.

    Args:
        stated: a tolerance, a mapping with some of its keys (the others as in `base`), or a number: the relative
            tolerance.
        base: what is not given.

    Raises:
        ComparisonError: unknown keys or impossible numbers.
    """
    if isinstance(stated, Tolerance):
        return stated
    if isinstance(stated, Mapping):
        for key in stated:
            if key not in KEYS:
                raise ComparisonError(f"Unknown tolerance {key!r}; {nearest(str(key), KEYS)}")
        return replace(base, **stated)
    return replace(base, relative=stated)


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of all signals.

    Args:
        default: for signals without one of their own.
        by_signal: by name or pattern (``train.*``); the first that fits counts, a name in full before all patterns.
        ignore: names or patterns of signals that are not compared.
    """

    default: Tolerance = field(default_factory=Tolerance)
    by_signal: Mapping[str, Tolerance] = field(default_factory=dict)
    ignore: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        default: Tolerance | Mapping[str, Any] | float | None = None,
        by_signal: Mapping[str, Tolerance | Mapping[str, Any] | float] | None = None,
        ignore: Iterable[str] = (),
    ) -> Tolerances:
        """Tolerances as users write them: see `tolerance`.

        Args:
            default: for signals that have no tolerance of their own.
            by_signal: by name or pattern.
            ignore: names or patterns of what is not compared.
        """
        base = Tolerance() if default is None else tolerance(default, Tolerance())
        return cls(base, {name: tolerance(stated, base) for name, stated in (by_signal or {}).items()}, tuple(ignore))

    def for_signal(self, name: str) -> Tolerance:
        """The tolerance of a signal.

        Args:
            name: name of the signal.
        """
        if name in self.by_signal:
            return self.by_signal[name]
        return next((stated for pattern, stated in self.by_signal.items() if fnmatchcase(name, pattern)), self.default)

    def value_for(self, name: str, reference: Curve) -> float:
        """Allowed difference in value of a signal, in its unit: a share of the range where a tolerance is stated under
        its full name, else of `Curve.share_scale`.

        Args:
            name: name of the signal. reference: what it is held against.
        """
        scale = reference.scale if name in self.by_signal else reference.share_scale
        return self.for_signal(name).value_for(scale)

    def ignores(self, name: str) -> bool:
        """Whether a signal is not compared.

        Args:
            name: name of the signal.
        """
        return any(name == pattern or fnmatchcase(name, pattern) for pattern in self.ignore)

    def unused(self, names: Iterable[str]) -> list[str]:
        """Names and patterns that fit none of the signals `names`: misspelt, most likely."""
        known = list(names)
        return [
            p for p in (*self.by_signal, *self.ignore) if not any(p == name or fnmatchcase(name, p) for name in known)
        ]

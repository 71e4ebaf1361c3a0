"""First-order hold: the straight line of each input of one component through the last two values that its source gave.

Where the value is that of the end of the step the line interpolates, elsewhere it extrapolates. How a slave receives
it is in `interpolators`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from cosim.components.component import Component
from fmus.fmi.standard import TIME_TOLERANCE

Method = Literal["interpolate", "extrapolate"]


@dataclass
class _InputHistory:
    """The last two values that the sources gave, and when.

    Args:
        earlier, later: shape (m,). earlier_at, later_at: [s], shape (m,); NaN where there is none.
    """

    earlier: np.ndarray
    later: np.ndarray
    earlier_at: np.ndarray
    later_at: np.ndarray

    def copy(self) -> _InputHistory:
        """An independent copy."""
        return _InputHistory(self.earlier.copy(), self.later.copy(), self.earlier_at.copy(), self.later_at.copy())


class _Course(Protocol):
    """Signals whose values are known ahead."""

    def at(self, t: float, *, before: bool) -> np.ndarray:
        """Values at `t` [s], shape (k,); where they jump those `before` or after it."""

    def mean(self, t: float, until: float) -> np.ndarray:
        """Means from `t` to `until` [s], shape (k,)."""


@dataclass(frozen=True)
class KnownInputs:
    """Inputs ``factor * signal + offset`` of signals whose values are known ahead.

    Args:
        places: of the inputs, shape (k,). course: of the signals. factors, offsets: shape (k,).
    """

    places: np.ndarray
    course: _Course
    factors: np.ndarray
    offsets: np.ndarray

    def converted(self, values: np.ndarray) -> np.ndarray:
        """Values of the inputs where the signals have these, shape (k,)."""
        return np.asarray(self.factors * values + self.offsets)


class FirstOrderHold:
    """The course of the inputs of one component, ``u(s) = later + slope * (s - later_at)``.

    Args:
        method: ``interpolate`` uses a line where both ends of it are known and holds elsewhere; ``extrapolate``
            continues the last line there.
        sources: the component that gives each input, shape (m,).
        continuous: inputs that may follow a line, shape (m,); the others are held.
        known: of some of them the course is known ahead: which, and how it runs.
    """

    def __init__(
        self,
        method: Method,
        sources: Sequence[Component],
        continuous: np.ndarray,
        known: Sequence[KnownInputs] = (),
    ) -> None:
        self.method, self.continuous, self.known = method, continuous, known
        self._distinct = list({id(c): c for c in sources}.values())
        self._source_of = np.array([[id(d) for d in self._distinct].index(id(c)) for c in sources], dtype=np.intp)
        count = len(continuous)
        self._history = _InputHistory(np.zeros(count), np.zeros(count), np.full(count, np.nan), np.full(count, np.nan))
        self.slope = np.zeros(count)
        self._stood = np.full(count, np.nan)

    @property
    def sources(self) -> Sequence[Component]:
        """The components that give the inputs, each once."""
        return self._distinct

    def begin(self) -> None:
        """A step begins: what is held over it was true where its source stands now."""
        self._stood = self._times()

    def update(
        self,
        gathered: np.ndarray,
        until: float,
        *,
        held: bool | np.ndarray = False,
        ends_known: bool | np.ndarray = False,
    ) -> None:
        """Take what was gathered for a step that ends at `until` [s], shape (m,).

        Args:
            held: the values are those of the start of the step; for all or each, shape (m,).
            ends_known: the values are those of `until`, wherever their components stand (a step that is iterated); for
                all or each, shape (m,).
        """
        seen_at = np.where(ends_known, until, np.where(held, self._stood, self._times()))
        history = self._history
        newer = seen_at > history.later_at + TIME_TOLERANCE
        first = np.isnan(history.later_at)
        history.earlier = np.where(newer, history.later, history.earlier)
        history.earlier_at = np.where(newer, history.later_at, history.earlier_at)
        history.later = gathered.copy()
        history.later_at = np.where(newer | first, seen_at, history.later_at)
        usable = self.continuous & (history.later_at - history.earlier_at > TIME_TOLERANCE)
        if self.method == "interpolate":
            usable &= history.later_at >= until - TIME_TOLERANCE
        span = np.where(usable, history.later_at - history.earlier_at, 1.0)
        with np.errstate(over="ignore"):  # where no number holds the slope, the last value is held
            slope = (history.later - history.earlier) / span
        self.slope = np.where(usable & np.isfinite(slope), slope, 0.0)

    def at(self, time: float, *, begins: bool = False) -> np.ndarray:
        """Values of the inputs at a time [s], shape (m,).

        Args:
            begins: of values that jump there those after the jump, not those before it.
        """
        values: np.ndarray = self._history.later + self.slope * (time - self._history.later_at)
        for known in self.known:
            values[known.places] = known.converted(known.course.at(time, before=not begins))
        return values

    def mean(self, t: float, until: float) -> np.ndarray:
        """Means of the inputs from `t` to `until` [s], shape (m,)."""
        values = self.at(0.5 * (t + until))
        for known in self.known:
            values[known.places] = known.converted(known.course.mean(t, until))
        return values

    def slopes(self, t: float, until: float) -> np.ndarray:
        """Slopes of the inputs from `t` to `until` [s], shape (m,)."""
        slopes = self.slope.copy()
        for known in self.known:
            ends = known.course.at(t, before=False), known.course.at(until, before=True)
            slopes[known.places] = known.factors * (ends[1] - ends[0]) / (until - t)
        return slopes

    def forget(self, which: np.ndarray) -> None:
        """Inputs whose source jumped, as a mask of shape (m,): no line leads over it.

        Args:
            which: inputs to forget, shape (m,) of booleans.
        """
        self._history.earlier_at[which] = self._history.later_at[which] = np.nan

    def save(self) -> _InputHistory:
        """What a step changes here."""
        return self._history.copy()

    def restore(self, state: _InputHistory) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        self._history = state.copy()

    def _times(self) -> np.ndarray:
        """When the values of the sources were true: where their components stand [s]."""
        return np.array([c.time for c in self._distinct])[self._source_of]

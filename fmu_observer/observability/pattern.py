"""Patterns: the instants at which sampled measurements arrive, from a list of instants, or from balises and a speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class SamplePattern:
    """Instants in a window of time that begins at zero.

    Args:
        instants: increasing, in [0, duration] [s], shape (N,).
        duration: length of the window [s]; None for the last instant.

    Raises:
        ValueError: an instant is not finite, not after the one before it, or outside the window.
    """

    instants: np.ndarray
    duration: float

    def __init__(self, instants: Sequence[float] | np.ndarray, duration: float | None = None) -> None:
        times = np.array(instants, dtype=float).ravel()
        end = duration if duration is not None else (float(times[-1]) if times.size else 0.0)
        if not np.isfinite(times).all() or not 0.0 <= end < np.inf:
            raise ValueError(
                "Sample pattern: the instants and the duration must be finite, and the duration not negative [s]."
            )
        late = np.flatnonzero(np.diff(times) <= 0.0)
        if late.size:
            i = int(late[0])
            raise ValueError(
                f"Sample pattern: instants must increase, one sample at a time: number {i + 2} at {times[i + 1]:g} s "
                f"follows "
                f"number {i + 1} at {times[i]:g} s."
            )
        if times.size and not (times[0] >= 0.0 and times[-1] <= end):
            raise ValueError(
                f"Sample pattern: {times[0]:g} s to {times[-1]:g} s is not within the window 0 s to {end:g} s."
            )
        object.__setattr__(self, "instants", times)
        object.__setattr__(self, "duration", float(end))

    @classmethod
    def of_balises(
        cls, positions: Sequence[float] | np.ndarray, speed: float, start: float = 0.0, duration: float | None = None
    ) -> SamplePattern:
        """The instants at which a train at constant speed passes balises.

        Args:
            positions: of the balises [m], in any order. speed: of the train [m/s], negative where positions decrease.
            start: its position at time zero [m]. duration: length of the window [s]; None up to the last balise.

        Raises:
            ValueError: two balises lie at one place, a position is not finite, the speed is zero, or no balise is
            passed.
        """
        places = np.array(positions, dtype=float).ravel()
        if not np.isfinite(places).all() or not np.isfinite(start):
            raise ValueError("Balise pattern: every position must be a finite number [m].")
        if not (np.isfinite(speed) and speed):
            raise ValueError(f"Balise pattern: the speed must be finite and not zero [m/s], got {speed!r}.")
        order = np.argsort(places, kind="stable")
        repeated = np.flatnonzero(np.diff(places[order]) == 0.0)
        if repeated.size:
            first, second = order[repeated[0]] + 1, order[repeated[0] + 1] + 1
            raise ValueError(
                f"Balise pattern: two balises at one place: numbers {first} and {second} at "
                f"{places[order[repeated[0]]]:g} m. They are one measurement; list the place once."
            )
        times = np.sort((places - start) / speed)
        passed = times[(times >= 0.0) & (times <= (np.inf if duration is None else duration))]
        if not passed.size:
            raise ValueError(
                f"Balise pattern: from {start:g} m at {speed:g} m/s no balise is passed within the window."
            )
        return cls(passed, duration)

    @property
    def gaps(self) -> np.ndarray:
        """Lengths of the intervals from time zero over the instants to the end of the window [s], shape (N + 1,)."""
        return np.diff(np.concatenate([[0.0], self.instants, [self.duration]]))

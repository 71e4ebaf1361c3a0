"""Whether the rows of a window tell the state on their own, without what the arrival cost knows. Plain NumPy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

TOLERANCE = 1e-9  # of the largest singular value of the measured rows: below it, a direction is not told
PART = 1e-6  # of the largest entry of a direction: below it, a state has no part in it


class WindowObservability(NamedTuple):
    """What a window tells of the state in its first row.

    Attributes:
        rank: independent directions that are told. unseen: orthonormal basis of those that are not, shape
            (n, n - rank). states: names of the states.
    """

    rank: int
    unseen: np.ndarray
    states: tuple[str, ...]

    def explain(self) -> str:
        """In words: every state, or the directions that are not told."""
        if not self.unseen.shape[1]:
            return "its rows alone tell every state"
        directions = "; ".join(self._direction(column) for column in self.unseen.T)
        return f"its rows alone do not tell {directions}, which only the arrival cost knows"

    def _direction(self, column: np.ndarray) -> str:
        largest = column[np.argmax(np.abs(column))]
        named = zip(self.states, column / largest, strict=True)
        return " ".join(f"{value:+.3g} {name}" for name, value in named if abs(value) > PART)


def window_observability(F: np.ndarray, H: np.ndarray, rows: int, states: Sequence[str]) -> WindowObservability:
    """What a number of rows tell of the state in the first of them, without noise.

    Args:
        F: transition from row to row, shape (n, n). H: what a row measures, shape (q, n). rows: N.
        states: names, n of them.

    Returns:
        Rank, and the directions that no combination of the rows shows.
    """
    seen, measured = [], H
    for _ in range(rows):
        seen.append(measured)
        measured = measured @ F
    _, values, directions = np.linalg.svd(np.vstack(seen))
    rank = int(np.sum(values > TOLERANCE * values[0])) if values.size and values[0] > 0.0 else 0
    return WindowObservability(rank, directions[rank:].T, tuple(states))

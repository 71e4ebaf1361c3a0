"""Whether the rows of a window tell the state on their own, without what the arrival cost knows. Plain NumPy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fmu_observer.models.filter_models import FilterModel, Known

_TOLERANCE = 1e-9  # of the largest singular value of the measured rows: below it, a direction is not told
_PART = 1e-6  # of the largest entry of a direction: below it, a state has no part in it


class _WindowObservability(NamedTuple):
    """What a window tells of the state in its first row.

    Attributes:
        measured: what the rows measure of it, shape (N * q, n). rank: independent directions that are told.
        unseen: orthonormal basis of those that are not, shape (n, n - rank). states: names of the states.
    """

    measured: np.ndarray
    rank: int
    unseen: np.ndarray
    states: tuple[str, ...]

    def explain(self) -> str:
        """In words, with a window as the subject: it tells every state, or which directions it does not."""
        if not self.unseen.shape[1]:
            return "tells all of them without the arrival cost"
        directions = "; ".join(self._direction(column) for column in self.unseen.T)
        return (
            f"tells {self.rank} without the arrival cost; it does not tell {directions}, which is known only from what "
            "was measured before. A longer window may tell it"
        )

    def _direction(self, column: np.ndarray) -> str:
        largest = column[np.argmax(np.abs(column))]
        parts = [(name, v) for name, v in zip(self.states, column / largest, strict=True) if abs(v) > _PART]
        if len(parts) == 1:
            return parts[0][0]
        return "the combination " + " ".join(f"{value:+.3g} {name}" for name, value in parts)


def window_observability(model: FilterModel, known: Known, period: float, rows: int) -> _WindowObservability:
    """What a number of full rows tell of the state in the first of them, along the model's own way without noise.

    Args:
        model: the model, from its start. known: time, inputs held, and parameters. period: from row to row [s].
        rows: N.

    Returns:
        Measured rows, rank, and the directions that no combination of the rows shows.
    """
    x, passage, seen = model.start, np.eye(model.order), []
    for i in range(rows):
        now = known._replace(t=known.t + i * period)
        H, _ = model.measurement_jacobians(x, now)
        F, _ = model.transition_jacobians(x, now, period)
        seen.append(np.asarray(H) @ passage)
        passage = np.asarray(F) @ passage
        x = np.asarray(model.moved(x, model.no_noise(), now, period), dtype=float)
    measured = np.vstack(seen)
    _, values, directions = np.linalg.svd(measured)
    rank = int(np.sum(values > _TOLERANCE * values[0])) if values[0] > 0.0 else 0
    return _WindowObservability(measured, rank, directions[rank:].T, tuple(s.name for s in model.states))

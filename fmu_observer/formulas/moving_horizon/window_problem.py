"""The least-squares problem of a window: how its states move, what rows measure, and within which bounds. Values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import Form
from fmu_observer.formulas.moving_horizon.robust_loss import Loss
from fmu_observer.formulas.moving_horizon.row_window import RowLayout, WindowRow
from plant_models.hybrid import Array, vector


class Moved(NamedTuple):
    """A transition into a row.

    Attributes:
        state: shape (n,). F: Jacobian by the state before, shape (n, n). noise: covariance it adds, shape (n, n).
    """

    state: Array
    F: Array
    noise: Array


class Seen(NamedTuple):
    """What a row measures.

    Attributes:
        measured: as expected, shape (q,). H: Jacobian by the state, shape (q, n). noise: covariance, shape (q, q).
    """

    measured: Array
    H: Array
    noise: Array


class Limits(NamedTuple):
    """Bounds of the states in `WindowProblem.bounded`, or of the disturbances in `disturbed`, in their order.

    Attributes:
        lower, upper: shape (b,).
    """

    lower: Array
    upper: Array


def _no_limits(_row: WindowRow, _shared: Array) -> Limits:
    """Limits of no disturbance."""
    return Limits(np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class WindowProblem:
    """The least-squares problem of a window.

    Args:
        order: n, number of states. layout: of the rows.
        moved: transition into a row, of the state before it, the row and what all rows share.
        seen: what a row measures, of the state in it, the row and what all rows share.
        bounded: which states have bounds. limits: the bounds, of what all rows share.
        losses: of each measurement. loss_scale: of what all rows share, deviations at which the losses doubt.
        form: of the covariance.
        disturbed: states whose disturbances have bounds, what a transition adds to them beyond the model.
        noise_limits: these bounds, of the row that the transition leads into and what all rows share; zero lies within.
    """

    order: int
    layout: RowLayout
    moved: Callable[[Array, WindowRow, Array], Moved]
    seen: Callable[[Array, WindowRow, Array], Seen]
    bounded: tuple[int, ...]
    limits: Callable[[Array], Limits]
    losses: tuple[Loss, ...]
    loss_scale: Callable[[Array], Array]
    form: Form = "joseph"
    disturbed: tuple[int, ...] = ()
    noise_limits: Callable[[WindowRow, Array], Limits] = _no_limits

    @property
    def bounds(self) -> int:
        """Bounds of a row, of states and of disturbances."""
        return len(self.bounded) + len(self.disturbed)

    def clipped(self, x: Array, shared: Array) -> Array:
        """A state within its bounds, shape (n,).

        Args:
            x: shape (n,). shared: what all rows share.
        """
        lower, upper = self.limits(shared)
        values = [x[i] for i in range(self.order)]
        for k, i in enumerate(self.bounded):
            values[i] = np.minimum(np.maximum(values[i], lower[k]), upper[k])
        return vector(*values)

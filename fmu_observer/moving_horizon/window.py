"""The window of a moving-horizon observer: time-stamped rows of fixed width, oldest first. Pure functions that trace.

A row is one instant at which something was measured, whatever it was and whenever. Measurements that are missing are
not used in their row, or have no row. It knows no model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from plant_models.hybrid.system import Array


class WindowRow(NamedTuple):
    """One instant of the window.

    Attributes:
        moves: 1 where the state moved on to this row from the one before, 0 in a row without time before it or one that
            is empty. period: time since the row before [s]. time: stamp of the row [s].
        inputs: held over the period, shape (m,). measured: shape (q,). used: 1 for what was measured in this row,
            shape (q,).
    """

    moves: Array
    period: Array
    time: Array
    inputs: Array
    measured: Array
    used: Array


@dataclass(frozen=True)
class RowLayout:
    """Where the values of a row stand in its flat form.

    Args:
        inputs: m, number of inputs. measurements: q, number of measurements.
    """

    inputs: int
    measurements: int

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return 3 + self.inputs + 2 * self.measurements

    def unpacked(self, flat: Array) -> WindowRow:
        """A row from its flat form.

        Args:
            flat: shape (width,).
        """
        m, q = self.inputs, self.measurements
        return WindowRow(flat[0], flat[1], flat[2], flat[3 : 3 + m], flat[3 + m : 3 + m + q], flat[3 + m + q :])

    def packed(self, row: WindowRow) -> list[Array]:
        """The values of a row in their flat order, as scalars.

        Args:
            row: the row.
        """
        vectors = (row.inputs, row.measured, row.used)
        return [row.moves, row.period, row.time, *(v[i] for v in vectors for i in range(v.shape[0]))]

    def count(self, rows: Array) -> Array:
        """How many rows have a measurement, shape (1,).

        Args:
            rows: shape (N, width).
        """
        used = rows[:, self.width - self.measurements :] @ np.ones(self.measurements)
        return np.reshape(np.sum(np.where(used > 0.5, 1.0, 0.0)), (1,))

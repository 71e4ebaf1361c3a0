"""The window of a moving-horizon observer: time-stamped rows of fixed width, oldest first. Pure functions that trace.

A row is one instant at which something was measured, whatever it was and whenever. Measurements that are missing are
not used in their row, or have no row. It knows no model.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array, memory
from plant_models.hybrid.signal_layout import SignalLayout


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
    """The columns of a row: those of `WindowRow`, one after the other.

    Args:
        inputs: m, number of inputs. measurements: q, number of measurements.
    """

    inputs: int
    measurements: int

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return self._columns.width

    def unpacked(self, flat: Array) -> WindowRow:
        """A row from its flat form.

        Args:
            flat: shape (width,).
        """
        return WindowRow._make(self._columns.named(flat))

    def packed(self, row: WindowRow) -> Array:
        """The flat form of a row, shape (width,).

        Args:
            row: the row.
        """
        return self._columns.flat(row._asdict(), "a row")

    @cached_property
    def _columns(self) -> SignalLayout:
        sizes = {"inputs": self.inputs, "measured": self.measurements, "used": self.measurements}
        return SignalLayout([memory(name, "1", size=sizes.get(name)) for name in WindowRow._fields])

    def count(self, rows: Array) -> Array:
        """How many rows have a measurement, shape (1,).

        Args:
            rows: shape (N, width).
        """
        used = rows[:, self.width - self.measurements :] @ np.ones(self.measurements)
        return np.reshape(np.sum(np.where(used > 0.5, 1.0, 0.0)), (1,))

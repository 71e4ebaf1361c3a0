"""Recordings as the stepper knows them: rows and columns as in ``stepper.h``, with functions of FMI 3 in its library;
and the inputs that follow their columns within a step.

Where a recording stands is kept in one place for C and Python, so each goes on where the other one ended.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from cosim.components.recording import ColumnCourse, RecordingSlave
from cosim.components.recording_data import Recording
from cosim.coupling.inputs import Inputs
from cosim.master.interpolation.interpolators import MeanInterpolator

FUNCTIONS: Mapping[str, str] = {
    "fmi3DoStep": "recording_step",
    "fmi3GetFloat64": "recording_get_reals",
    "fmi3GetInt32": "recording_get_integers",
    "fmi3GetFMUState": "recording_save",
    "fmi3SetFMUState": "recording_restore",
    "fmi3FreeFMUState": "recording_release",
}
"""By the names of FMI those of the stepper's library."""


class _CRecording(ctypes.Structure):
    """`Recording`."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("time", "rows", "held")),
        *((name, ctypes.c_int64) for name in ("row_count", "column_count")),
        *((name, ctypes.c_void_p) for name in ("values", "stands")),
        ("row", ctypes.c_int64),
        ("saved", ctypes.c_double * 2),
    )


class _CFollowedColumn(ctypes.Structure):
    """`FollowedColumn`."""

    _fields_ = (
        ("recording", ctypes.c_void_p),
        *((name, ctypes.c_int64) for name in ("column", "input")),
        *((name, ctypes.c_double) for name in ("factor", "offset")),
    )


class _CFollowed(ctypes.Structure):
    """`Followed`."""

    _fields_ = (
        ("columns", ctypes.c_void_p),
        ("column_count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("gathered", "over", "held")),
        ("passes", ctypes.c_void_p),
        *((name, ctypes.c_double) for name in ("begin", "end")),
    )


class NativeRecording:
    """A recording in C; everything that it points to is kept alive here.

    Args:
        slave: that plays it back in Python. library: the stepper.
    """

    def __init__(self, slave: RecordingSlave, library: Any) -> None:
        self.recording = recording = slave.recording
        self._library = library
        self._arrays: list[np.ndarray] = [
            np.ascontiguousarray(recording.time, dtype=np.float64),
            np.ascontiguousarray(recording.values, dtype=np.float64),
            np.ascontiguousarray(recording.held, dtype=np.uint8),
            slave.values,
            slave.stands,
        ]
        time, rows, held, values, stands = (array.ctypes.data for array in self._arrays)
        self._head = _CRecording(time, rows, held, *recording.values.shape, values, stands)

    @property
    def address(self) -> int:
        """Where it is."""
        return ctypes.addressof(self._head)

    def function(self, name: str) -> int:
        """Address of a function.

        Args:
            name: as FMI calls it.
        """
        return int(ctypes.cast(getattr(self._library, FUNCTIONS[name]), ctypes.c_void_p).value or 0)


class FollowedInputs:
    """Inputs of one component in C of which some follow columns; everything they point to is kept alive here.

    Args:
        interpolator: of the component, see `follows_recordings`. inputs: all its connected ones.
        native: address of a recording in C.
    """

    def __init__(self, interpolator: MeanInterpolator, inputs: Inputs, native: Callable[[Recording], int]) -> None:
        columns = [
            _CFollowedColumn(native(known.course.recording), column, place, factor, offset)
            for known in interpolator.hold.known
            if isinstance(known.course, ColumnCourse)
            for column, place, factor, offset in zip(
                known.course.places, known.places, known.factors, known.offsets, strict=True
            )
        ]
        self._columns = (_CFollowedColumn * len(columns))(*columns)
        self._arrays = np.zeros(len(inputs)), interpolator.over.astype(np.uint8), inputs.held.astype(np.uint8)
        self._head = _CFollowed(
            ctypes.addressof(self._columns),
            len(columns),
            *(array.ctypes.data for array in self._arrays),
            interpolator.passes.ctypes.data,
        )
        self._passes = interpolator.passes  # which initialisation may change

    @property
    def address(self) -> int:
        """Where they are."""
        return ctypes.addressof(self._head)


def follows_recordings(interpolator: Any) -> bool:
    """Whether all lines of an interpolator are columns of recordings, and its component gets their means.

    Args:
        interpolator: of a component; None where it has none.
    """
    if not isinstance(interpolator, MeanInterpolator):
        return False
    hold = interpolator.hold
    ahead = {int(place) for known in hold.known if isinstance(known.course, ColumnCourse) for place in known.places}
    return set(np.flatnonzero(hold.continuous).tolist()) <= ahead

"""`Batch`: many members of one system at one time, stepped by one compiled loop."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any
from weakref import finalize

import numpy as np
from numpy.typing import ArrayLike

from fmus.batch.error import BatchError
from fmus.batch.schedule import Schedule
from fmus.build import BuildPlan, plan_fmu
from fmus.recipes import recipe
from fmus.toolchain.cached_library import cached_library
from fmus.toolchain.compile import find_compiler
from plant_models.disk_cache.folder import cache_folder
from plant_models.hybrid import HybridSystem

_MEMBERS_AT_A_TIME = 256
"""Between so many members of a run, an interruption is felt and progress reported."""


class Batch:
    """Members of one system, each with parameters, start values, inputs, seed and events of its own.

    A member computes what one FMU of the system computes alone, bit for bit: the same C, with the same rounding.
    Members do not know of each other. One that cannot go on (a state that is not a finite number, parameters that the
    system refuses) stays where it was and is listed in `failures`; the others go on.

    Variables go by their names in the FMU. A vector signal may be given as a whole (``zone_from``) or by element
    (``zone_from[1]``).

    Args:
        system: the hybrid system, or the name of one that ships (see `fmus.RECIPES`).
        members: how many, at least 1.
        preset: preset whose values become the start values of all members; None for the system's default.

    Raises:
        BatchError: `members` is less than 1, or there is not enough memory for them.
        ValueError: the system cannot become C, or the preset is unknown.
        UnknownRecipeError: no system of this name ships.
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
    """

    def __init__(self, system: HybridSystem | str, members: int, preset: str | None = None) -> None:
        if members < 1:
            raise BatchError(f"A batch needs at least one member (got members={members}).")
        self.system = recipe(system) if isinstance(system, str) else system
        self.members = members
        self.time: float | None = None
        plan = plan_fmu(self.system, 3, preset)
        self._variables = {v.name: int(v.valueReference) for v in plan.description.modelVariables}
        self._vectors = _vectors(self._variables)
        self._library = _load(plan)
        self._batch = self._library.batch_create(members)
        if not self._batch:
            raise BatchError(f"There is not enough memory for {members} members of {self.system.name}; take fewer.")
        self._free = finalize(self, self._library.batch_free, self._batch)
        self._schedule = Schedule.nothing(self.system)

    def set(self, name: str, values: ArrayLike) -> None:
        """Give parameters and start values before `start`, inputs and tunable parameters also later.

        Args:
            name: of the variable.
            values: one number for all members, or one for each, shape (members,); of a vector signal with n elements
                one vector for all, shape (n,), or one for each, shape (members, n). In the unit of the variable.

        Raises:
            BatchError: there is no such variable, it cannot be set now, or the values have another shape.
        """
        references = self._find(name)
        rows = self._rows(name, values, len(references))
        refused = self._library.batch_set(self._batch, _Columns.of(references, rows[:, np.newaxis]))
        if refused >= 0:
            raise BatchError(f"{self.system.name}: {name}: {self._library.batch_message(self._batch).decode()}.")

    def get(self, name: str) -> np.ndarray:
        """Values of a variable now, NaN for members that failed.

        Args:
            name: of the variable: an output, a state, a parameter, or a count such as ``events.accepted``.

        Returns:
            Shape (members,), for a vector signal with n elements (members, n), in the unit of the variable.

        Raises:
            BatchError: there is no such variable.
        """
        references = self._find(name)
        values = np.empty((self.members, 1, len(references)))
        self._library.batch_get(self._batch, _Columns.of(references, values))
        return values[:, 0] if name in self._vectors else values[:, 0, 0]

    def start(self, t0: float = 0.0) -> None:
        """Let time begin.

        Args:
            t0: start time [s].

        Raises:
            BatchError: it has begun already, `t0` is not a finite number, or an event was announced for before.
        """
        if self.time is not None:
            raise BatchError("Time has begun already; call reset() first.")
        if not isfinite(t0):
            raise BatchError(f"Time cannot begin at {t0!r} s; expected a finite number.")
        self._schedule.check(self.members, t0)
        self._library.batch_start(self._batch, t0)
        self.time = float(t0)

    def reset(self) -> None:
        """Back to the start values of the preset, before time has begun; no member has failed, and no event waits."""
        self._library.batch_reset(self._batch)
        self.time, self._schedule = None, Schedule.nothing(self.system)

    def notify(self, event: str, members: ArrayLike, stamps: ArrayLike, **payload: ArrayLike) -> None:
        """Announce events of some members, to take effect at their stamps.

        Args:
            event: name of the triggered event.
            members: number of the member of each event, shape (k,), from 0; or one number.
            stamps: when each happens [s], shape (k,); events at the same instant happen in the order of announcement.
            payload: by name the payload of each, shape (k,), or one number for all; what is not given has its start
                value. Names may leave out the event's own: ``position`` for ``balise_position``.

        Raises:
            BatchError: there is no such event or payload, a member does not exist, or a stamp lies before now or is
                not a finite number.
        """
        added = Schedule.of(self.system, event, members, stamps, payload)
        added.check(self.members, self.time)
        waiting = self._schedule.without([self._library.batch_next_event(self._batch, i) for i in range(self.members)])
        self._schedule = waiting.joined(added)
        kept = self._schedule
        first = np.searchsorted(kept.members, np.arange(self.members + 1)).astype(np.int64)
        events = _Events(
            kept.kinds.ctypes.data, kept.stamps.ctypes.data, kept.payloads.ctypes.data, kept.payloads.shape[1]
        )
        self._library.batch_schedule(self._batch, first.ctypes.data, events)  # which stay in `_schedule`

    def advance(self, until: float) -> None:
        """One communication step of all members, with the inputs that stand there.

        Args:
            until: its end [s], after now.

        Raises:
            BatchError: time has not begun, or `until` does not lie after now.
        """
        self.run([until])

    def run(
        self,
        instants: ArrayLike,
        results: Sequence[str] = (),
        inputs: Mapping[str, ArrayLike] | None = None,
        progress: Callable[[int, int], None] | None = None,
        into: np.ndarray | None = None,
    ) -> np.ndarray:
        """Step all members through communication instants.

        Args:
            instants: ends of the communication steps [s], shape (k,), rising, the first after now.
            results: names of scalar variables to read, now and at each instant.
            inputs: values of scalar inputs by name, now and at each instant, held until the next one: shape (k + 1,),
                or (members, k + 1) where they differ by member. Inputs not named keep what was set.
            progress: called with the number of members done and of all.
            into: where results are written, an array or a view of the shape that is returned, of doubles of which those
                of an instant lie side by side; a new array by default.

        Returns:
            Results, shape (members, k + 1, len(results)); NaN from where a member failed.

        Raises:
            BatchError: time has not begun, the instants do not rise, a name is unknown, or a shape does not fit.
        """
        times = self._instants(instants)
        stated = self._inputs(inputs or {}, len(times))
        taken = self._place(into, (self.members, len(times), len(results)))
        sources = _Columns.of([self._scalar(name) for name in inputs or {}], stated)
        targets = _Columns.of([self._scalar(name) for name in results], taken)
        for first in range(0, self.members, _MEMBERS_AT_A_TIME):
            last = min(first + _MEMBERS_AT_A_TIME, self.members)
            self._library.batch_run(self._batch, first, last, times.ctypes.data, len(times), sources, targets)
            if progress is not None:
                progress(last, self.members)
        self.time = float(times[-1])
        return taken

    def _place(self, into: np.ndarray | None, shape: tuple[int, ...]) -> np.ndarray:
        """Where results are written."""
        if into is None:
            return np.empty(shape)
        beside = into.ndim == len(shape) and (shape[-1] < 2 or into.strides[-1] == into.itemsize)
        if into.shape != shape or into.dtype != np.float64 or not beside:
            raise BatchError(
                f"{self.system.name}: results go into doubles of shape {shape}, those of an instant side by side; got "
                f"{into.dtype} of shape {into.shape} with strides {into.strides}."
            )
        return into

    @property
    def failures(self) -> dict[int, str]:
        """Why members stand still, by number."""
        said = ((i, self._library.batch_failure(self._batch, i)) for i in range(self.members))
        return {i: text.decode() for i, text in said if text is not None}

    # -- internals --------------------------------------------------------------------------------------------------

    def _find(self, name: str) -> list[int]:
        """Value references of a variable; several of a vector."""
        if name in self._vectors:
            return self._vectors[name]
        if name in self._variables:
            return [self._variables[name]]
        near = get_close_matches(name, [*self._variables, *self._vectors], n=1, cutoff=0.5)
        raise BatchError(
            f"{self.system.name} has no variable {name!r}" + (f"; did you mean {near[0]!r}?" if near else ".")
        )

    def _scalar(self, name: str) -> int:
        if name in self._vectors:
            raise BatchError(f"{self.system.name}: {name} is a vector; name its elements, such as {name}[1].")
        return self._find(name)[0]

    def _rows(self, name: str, values: ArrayLike, width: int) -> np.ndarray:
        """Values by member and element, shape (members, width)."""
        stated, vector = np.asarray(values, dtype=float), name in self._vectors
        shapes = [(width,), (self.members, width)] if vector else [(), (self.members,)]
        if stated.shape not in shapes:
            expected = " or ".join(map(str, shapes))
            raise BatchError(f"{self.system.name}: {name}: expected shape {expected}, got {stated.shape}.")
        rows = stated if vector or stated.ndim == 0 else stated[:, np.newaxis]
        return np.ascontiguousarray(np.broadcast_to(rows, (self.members, width)))

    def _instants(self, instants: ArrayLike) -> np.ndarray:
        """Now, then the instants, shape (k + 1,)."""
        if self.time is None:
            raise BatchError("Time has not begun; call start() first.")
        times = np.concatenate([[self.time], np.atleast_1d(np.asarray(instants, dtype=float))])
        if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
            raise BatchError(f"The instants must be finite and rise from now ({self.time:g} s) on.")
        return times

    def _inputs(self, inputs: Mapping[str, ArrayLike], count: int) -> np.ndarray:
        """Inputs by member, instant and name; one row for all members where none differs by member."""
        columns = {name: np.asarray(values, dtype=float) for name, values in inputs.items()}
        for name, values in columns.items():
            if values.shape not in ((), (count,), (self.members, count)):
                expected = f"({count},) or ({self.members}, {count})"
                raise BatchError(f"{self.system.name}: input {name}: expected shape {expected}, got {values.shape}.")
        rows = self.members if any(values.ndim == 2 for values in columns.values()) else 1
        stacked = np.empty((rows, count, len(columns)))
        for i, values in enumerate(columns.values()):
            stacked[:, :, i] = values
        return np.broadcast_to(stacked, (self.members, count, len(columns)))


def _vectors(variables: Mapping[str, int]) -> dict[str, list[int]]:
    """Value references of the elements of each vector, by the vector's name."""
    vectors: dict[str, list[int]] = {}
    for name, reference in variables.items():
        if name.endswith("]"):
            vectors.setdefault(name.partition("[")[0], []).append(reference)
    return vectors


# -- the compiled loop: `batch.c` around the C of the system's FMU, compiled once and kept in the cache ---------------


MAIN = "batch.c"


class _Columns(ctypes.Structure):
    """Values of variables by member and instant, as in `batch.c`; a stride of zero repeats what stands there."""

    _fields_ = (
        ("references", ctypes.c_void_p),
        ("count", ctypes.c_int64),
        ("values", ctypes.c_void_p),
        ("member_stride", ctypes.c_int64),
        ("instant_stride", ctypes.c_int64),
    )

    @classmethod
    def of(cls, references: Sequence[int], values: np.ndarray) -> _Columns:
        """Columns over an array.

        Args:
            references: value references of the variables.
            values: shape (members, instants, variables), numbers of a row side by side; it must stay as long as the
                columns. A broadcast axis has a stride of zero.
        """
        numbers = np.array(references, dtype=np.uint32)
        strides = (values.strides[0] // 8, values.strides[1] // 8)
        columns = cls(numbers.ctypes.data, len(numbers), values.ctypes.data, *strides)
        columns.kept = numbers, values
        return columns

    kept: Any


class _Events(ctypes.Structure):
    """Events of all members, sorted by member and stamp, as in `batch.c`."""

    _fields_ = (
        ("kind", ctypes.c_void_p),
        ("stamp", ctypes.c_void_p),
        ("payload", ctypes.c_void_p),
        ("stride", ctypes.c_int64),
    )


def _load(plan: BuildPlan) -> ctypes.CDLL:
    """The library of a system's batch, compiled on the first call ever.

    Args:
        plan: of the system's FMU.

    Raises:
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
        OSError: the cache folder cannot be written, or the library not be loaded.
    """
    sources = plan.source_files() | plan.header_files() | {MAIN: (files("fmus.batch") / MAIN).read_bytes()}
    path = cached_library(f"{plan.system.name}_batch", sources, MAIN, find_compiler(), cache_folder())
    return _declared(path)


def _declared(path: Path) -> ctypes.CDLL:
    library = ctypes.CDLL(str(path))
    batch, number, columns = ctypes.c_void_p, ctypes.c_int64, ctypes.POINTER(_Columns)
    declarations: dict[str, tuple[Any, ...]] = {
        "batch_create": (batch, number),
        "batch_free": (None, batch),
        "batch_reset": (None, batch),
        "batch_start": (None, batch, ctypes.c_double),
        "batch_message": (ctypes.c_char_p, batch),
        "batch_failure": (ctypes.c_char_p, batch, number),
        "batch_set": (number, batch, columns),
        "batch_get": (None, batch, columns),
        "batch_schedule": (None, batch, ctypes.c_void_p, ctypes.POINTER(_Events)),
        "batch_next_event": (number, batch, number),
        "batch_run": (None, batch, number, number, ctypes.c_void_p, number, columns, columns),
    }
    for name, (result, *arguments) in declarations.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library

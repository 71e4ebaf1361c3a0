"""CVODE of SUNDIALS, as fmpy brings it: one internal step at a time, roots, dense output. Knows no FMU.

Variable order and step; BDF for stiff equations, Adams for others, both with Newton's method and a dense Jacobian, by a
function or by differences. Hindmarsh et al., "SUNDIALS", ACM Trans. Math. Softw. 31 (2005).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

from fmus.exchange.native_steps import CExchange, address
from fmus.fmi.standard import ERROR, Method

Rates = Callable[[float, Any, Any], int]
"""Of an instant [s] and states: writes derivatives, or root functions. Returns 0, 1 for a smaller step, -1 to give
up.
"""

_RATES = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
Jacobian = Callable[[float, Any, Any, int], int]
"""Of an instant [s], states and derivatives there: writes the derivatives of these by the states, column by column, to
the doubles at an address. Returns the same.
"""
_JACOBIAN = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, *[ctypes.c_void_p] * 7)
_WEIGHTS = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
Native = tuple[CExchange, Any]
"""A model as C calls it, and the library whose functions do."""
_LIBRARIES = (
    "sundials_core",
    "sundials_nvecserial",
    "sundials_sunmatrixdense",
    "sundials_sunlinsoldense",
    "sundials_cvode",
)
"""Each after those that it rests on."""
_FOLDERS = {"x86_64-darwin": "aarch64-darwin"}
"""Where fmpy keeps the libraries of a platform under the name of another one, whose files serve both."""
_ONE_STEP = 2
_AT_STOP = 1
AT_ROOT = 2
"""What CVODE says where a root function changed its sign."""
_START, _FINEST, _STARTED = 1e-3, 1e-12, 3
"""Below this order the tolerance is a thousandth: else each start, of order one, would err by as much as the whole run
may, and an input that jumps at every communication point adds them up. Not below the second number.
"""
_NUMBERS: dict[Method, int] = {"bdf": 2, "adams": 1}


class _Cause(IntEnum):
    """Why CVODE gives up, in its own numbers."""

    TOLERANCE = -2
    ERROR_TEST = -3
    CONVERGENCE = -4
    SETUP = -6
    RATES = -8
    FIRST_RATES = -9
    REPEATED_RATES = -10
    RATES_AFTER_ERROR = -11
    ROOTS = -12


WORDS = {
    _Cause.TOLERANCE: "the tolerance is finer than the numbers can show",
    _Cause.ERROR_TEST: "however small its step, the error does not fall below the tolerance",
    _Cause.CONVERGENCE: "however small its step, Newton's method does not converge",
    _Cause.SETUP: "the Jacobian cannot be factorised",
    _Cause.RATES: "the derivatives cannot be had",
    _Cause.FIRST_RATES: "the derivatives cannot be had at the very start",
    _Cause.REPEATED_RATES: "the derivatives cannot be had, however small the step",
    _Cause.RATES_AFTER_ERROR: "the derivatives cannot be had after a step that failed",
    _Cause.ROOTS: "the event indicators cannot be had",
}


_UNASKED = (_Cause.ROOTS, _Cause.RATES, _Cause.FIRST_RATES)
"""The FMU itself refused: no state is to blame."""


class SolverError(RuntimeError):
    """The solver cannot go on; the message says why, without time and place.

    Args:
        reason: why. worst: number of the state with the largest error; None where that says nothing.
        status: of FMI, by number.
    """

    def __init__(self, reason: str, worst: int | None = None, status: int = ERROR) -> None:
        super().__init__(reason)
        self.worst, self.status = worst, status


class Cvode:
    """``dx/dt = f(t, x)`` from one internal step to the next.

    `states` are those where the last step ended, shape (n,); `restart` begins anew from what stands in it.

    Args:
        count: number of states, at least one. root_count: number of root functions.
        rates, roots: see `Rates`.
        tolerance: relative. nominals: magnitudes of the states, shape (n,), by which absolute tolerances follow.
        method: multistep formula. native: functions in C for those in Python; None where there are none.
        jacobian: see `Jacobian`; None for differences.
    """

    def __init__(
        self,
        count: int,
        root_count: int,
        rates: Rates,
        roots: Rates,
        tolerance: float,
        nominals: np.ndarray,
        method: Method = "bdf",
        native: Native | None = None,
        jacobian: Jacobian | None = None,
    ) -> None:
        self._library = _libraries()
        self._count, self._root_count, self._method = count, root_count, _NUMBERS[method]
        self._memory: int | None = None
        self._made, self._arrays = list[tuple[str, ctypes.c_void_p]](), dict[int, Any]()
        self._context = ctypes.c_void_p()
        self._library.SUNContext_Create(0, ctypes.byref(self._context))
        self._library.SUNContext_ClearErrHandlers(self._context)
        self._x, self.states = self._vector()
        self._dense, self._states_between = self._vector()
        self.tolerance = tolerance
        self.absolute = tolerance * nominals
        self._weights, self._views = _WEIGHTS(self._weigh), dict[int, np.ndarray]()
        self._rates, self._roots = _RATES(self._with_arrays(rates)), _RATES(self._with_roots(roots, root_count))
        self._jacobian = None if jacobian is None else _JACOBIAN(self._with_matrix(jacobian))
        self._first_share = max(_START, min(1.0, _FINEST / tolerance))
        self.native: CExchange | None = None
        if native is not None:
            self._take(*native)
        self._reached, self._order, self._share = ctypes.c_double(), ctypes.c_int(), 1.0
        self._raised: Exception | None = None
        self._steps = 0
        self._begin()

    def restart(self, t: float) -> None:
        """Begin anew from what stands in `states`, with the tolerances that stand in `absolute`.

        Args:
            t: instant [s].
        """
        self._call("CVodeReInit", ctypes.c_double(t), self._x)
        self._share = self._first_share
        if self.native is not None:
            self.native.share = self._share

    def step(self, stop: float) -> tuple[float, bool]:
        """One internal step, which ends at `stop` [s] at the latest.

        Returns:
            The time reached [s], and whether a root function changed its sign there.

        Raises:
            SolverError: it cannot go on.
        """
        self._steps += 1
        self._call("CVodeSetStopTime", ctypes.c_double(stop))
        reached = self._reached
        flag = self._library.CVode(
            self._pointer(), ctypes.c_double(stop), self._x, ctypes.byref(reached), ctypes.c_int(_ONE_STEP)
        )
        if flag < 0:
            self.fail(flag)
        if self._share < 1.0:
            self._call("CVodeGetLastOrder", ctypes.byref(self._order))
            if self._order.value >= _STARTED:
                self._share = 1.0
                if self.native is not None:
                    self.native.share = 1.0
        return (stop if flag == _AT_STOP else float(reached.value)), flag == AT_ROOT

    def run(self, t: float, end: float) -> None:
        """From what stands in `states` to an end, where no root function is looked at.

        Args:
            t, end: [s].

        Raises:
            SolverError: it cannot go on.
        """
        self.restart(t)
        while t < end:
            t, _ = self.step(end)

    def fail(self, flag: int) -> None:
        """Raise what CVODE says.

        Args:
            flag: below zero.

        Raises:
            SolverError: always, unless a function raised something itself.
        """
        raised, self._raised = self._raised, None
        if raised is not None:
            raise raised
        if flag not in list(_Cause):
            raise SolverError(f"CVODE returned {flag}")
        raise SolverError(WORDS[_Cause(flag)], None if flag in _UNASKED else self._worst(_Cause(flag)))

    @property
    def steps(self) -> int:
        """How many internal steps it has taken, in Python or in C."""
        return self._steps + (0 if self.native is None else int(self.native.steps))

    @property
    def has_jacobian(self) -> bool:
        """Whether the Jacobian is a function; else it follows from differences."""
        return self._jacobian is not None

    def drop_jacobian(self) -> None:
        """From now on by differences."""
        self._jacobian = None
        self._call("CVodeSetJacFn", None)

    def changed_root(self) -> int:
        """Number of the first root function that changed its sign where the last step ended."""
        found = (ctypes.c_int * self._root_count)()
        self._call("CVodeGetRootInfo", found)
        return next((number for number, change in enumerate(found) if change), 0)

    def between(self, t: float) -> np.ndarray:
        """States at an instant within the last step [s], by the polynomial of the solver, shape (n,); valid until the
        next call.
        """
        self._call("CVodeGetDky", ctypes.c_double(t), ctypes.c_int(0), self._dense)
        return self._states_between

    def address(self, array: np.ndarray) -> Any:
        """An array of states as C takes it."""
        return self._array(array.ctypes.data)

    # -- internals --------------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        library, context = self._library, self._context
        self._memory = library.CVodeCreate(ctypes.c_int(self._method), context)
        self._call("CVodeInit", self._rates, ctypes.c_double(0.0), self._x)
        self._call("CVodeWFtolerances", self._weights)
        self._call("CVodeRootInit", ctypes.c_int(self._root_count), self._roots)
        size = ctypes.c_int64(self._count)
        matrix = ctypes.c_void_p(library.SUNDenseMatrix(size, size, context))
        solver = ctypes.c_void_p(library.SUNLinSol_Dense(self._x, matrix, context))
        self._made += [("SUNMatDestroy", matrix), ("SUNLinSolFree", solver)]
        self._call("CVodeSetLinearSolver", solver, matrix)
        if self._jacobian is not None:
            self._call("CVodeSetJacFn", self._jacobian)
        self._call("CVodeSetNoInactiveRootWarn")
        if self.native is not None:
            self.native.memory = self._memory
            self._call("CVodeSetUserData", ctypes.byref(self.native))
        self._call("CVodeSetMaxHnilWarns", ctypes.c_int(-1))  # a step that is too small fails in the end, and says so

    def _take(self, model: CExchange, functions: Any) -> None:
        """Have C in the place of the functions in Python."""
        library, model.x, model.tolerance = self._library, self._x.value, self.tolerance
        model.absolute, model.first_share = self.absolute.ctypes.data, self._first_share
        model.begin, model.steps, model.rates = address(library.CVodeReInit), 0, 0
        model.array, model.set_stop = address(library.N_VGetArrayPointer), address(library.CVodeSetStopTime)
        model.step, model.last_order = address(library.CVode), address(library.CVodeGetLastOrder)
        self._rates, self._roots = _RATES(address(functions.exchange_rates)), _RATES(address(functions.exchange_roots))
        self._weights, self.native = _WEIGHTS(address(functions.exchange_weights)), model
        if self._jacobian is not None:
            model.columns = address(library.SUNDenseMatrix_Data)
            self._jacobian = _JACOBIAN(address(functions.exchange_jacobian))

    def _vector(self) -> tuple[ctypes.c_void_p, np.ndarray]:
        """A vector of the solver, and its numbers."""
        vector = ctypes.c_void_p(self._library.N_VNew_Serial(ctypes.c_int64(self._count), self._context))
        self._made.append(("N_VDestroy", vector))
        return vector, np.ctypeslib.as_array(self._array(self._library.N_VGetArrayPointer(vector)))

    def _array(self, address: int) -> Any:
        """The doubles that lie at an address, as C takes them."""
        made = self._arrays.get(address)
        if made is None:
            made = self._arrays[address] = (ctypes.c_double * self._count).from_address(address)
        return made

    def _weigh(self, x: int, weights: int, _data: Any) -> int:
        """Weights of errors: one over the tolerated error of each state."""
        states, written = self._view(x), self._view(weights)
        tolerated = self._share * (self.tolerance * np.abs(states) + self.absolute)
        if not np.all(tolerated > 0.0):
            return -1
        np.divide(1.0, tolerated, out=written)
        return 0

    def _view(self, vector: int) -> np.ndarray:
        """The numbers of a vector, whose place is always the same."""
        found = self._views.get(vector)
        if found is None:
            address = self._library.N_VGetArrayPointer(vector)
            found = self._views[vector] = np.ctypeslib.as_array(self._array(address))
        return found

    def _with_arrays(self, rates: Rates) -> Callable[..., int]:
        place, array = self._library.N_VGetArrayPointer, self._array

        def called(t: float, x: int, written: int, _data: Any) -> int:
            return self._kept(rates, t, array(place(x)), array(place(written)))

        return called

    def _with_matrix(self, jacobian: Jacobian) -> Callable[..., int]:
        place, array, columns = self._library.N_VGetArrayPointer, self._array, self._library.SUNDenseMatrix_Data

        def called(t: float, x: int, rates: int, matrix: int, *_: Any) -> int:
            return self._kept(jacobian, t, array(place(x)), array(place(rates)), columns(matrix))

        return called

    def _kept(self, function: Callable[..., int], *arguments: Any) -> int:
        """What a function says; what it raises is raised once C has returned, through which nothing may pass."""
        try:
            return function(*arguments)
        except Exception as error:
            self._raised = error
            return -1

    def _with_roots(self, roots: Rates, count: int) -> Callable[..., int]:
        place, array, kind = self._library.N_VGetArrayPointer, self._array, ctypes.c_double * max(count, 1)

        def called(t: float, x: int, written: int, _data: Any) -> int:
            return roots(t, array(place(x)), kind.from_address(written))

        return called

    def _pointer(self) -> ctypes.c_void_p:
        return ctypes.c_void_p(self._memory)

    def _call(self, name: str, *arguments: Any) -> None:
        flag = getattr(self._library, name)(self._pointer(), *arguments)
        if flag < 0:
            raise SolverError(f"{name} returned {flag}")

    def _worst(self, cause: _Cause) -> int:
        """Number of the state whose error, or whose change where no step was tried, is the largest share of its
        tolerance.
        """
        (errors, e), (weights, w) = self._vector(), self._vector()
        self._call("CVodeGetErrWeights", weights)
        if cause is _Cause.ERROR_TEST:
            self._call("CVodeGetEstLocalErrors", errors)
        else:
            self._rates(self._reached, self._x, errors, None if self.native is None else ctypes.addressof(self.native))
        return int(np.argmax(np.nan_to_num(np.abs(e * w), nan=np.inf)))

    def __del__(self) -> None:
        if getattr(self, "_memory", None):
            self._library.CVodeFree(ctypes.byref(self._pointer()))
        for name, made in reversed(getattr(self, "_made", ())):
            getattr(self._library, name)(made)
        if getattr(self, "_context", None):
            self._library.SUNContext_Free(ctypes.byref(self._context))


class _Libraries:
    """The functions of all libraries of SUNDIALS that fmpy brings, by name."""

    def __init__(self) -> None:
        folder = Path(fmpy.__file__).parent / "sundials" / _FOLDERS.get(fmpy.platform_tuple, fmpy.platform_tuple)
        self._handles = [ctypes.CDLL(str(folder / f"{name}{fmpy.sharedLibraryExtension}")) for name in _LIBRARIES]
        for name in ("CVodeCreate", "N_VNew_Serial", "N_VGetArrayPointer", "SUNDenseMatrix", "SUNLinSol_Dense"):
            getattr(self, name).restype = ctypes.c_void_p
        self.SUNDenseMatrix_Data.restype = ctypes.c_void_p
        for read in (self.N_VGetArrayPointer, self.SUNDenseMatrix_Data):
            read.argtypes = [ctypes.c_void_p]

    def __getattr__(self, name: str) -> Any:
        for handle in self._handles:
            function = getattr(handle, name, None)
            if function is not None:
                setattr(self, name, function)
                return function
        raise AttributeError(f"SUNDIALS has no function {name}.")


@cache
def _libraries() -> _Libraries:
    return _Libraries()

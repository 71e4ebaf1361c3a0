"""Instances: what co-simulation and model exchange have in common, for every FMI version, native or a Python block.

An instance wraps an object with the call surface of fmpy's classes. Every call is guarded: whatever the FMU or fmpy
throws comes out as one kind of error, which the subclass makes in `failure`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription, ModelVariable

from fmus.fmi.call_warnings import CallWarnings
from fmus.fmi.derivatives import directional_derivative
from fmus.fmi.described import Described
from fmus.fmi.elements import layout
from fmus.fmi.exact_ports import Values
from fmus.fmi.native_log import forget
from fmus.fmi.ports import is_native
from fmus.fmi.standard import FATAL, MAX_EVENT_ITERATIONS
from fmus.fmi.types import getter_type
from fmus.fmi.values import element_reader, element_writer, exact_reader, exact_writer

INSTANTIATING = "instantiate"
FAILURES = (RuntimeError, ValueError, OSError)
"""What the calls of an instance raise: nothing else may come out of one, whatever its slave throws."""
NAMES_SHOWN = 6


class Instance(Described):
    """One instance, from `instantiate` to `free`.

    Args:
        name: of the instance.
        slave: object with fmpy's call surface, not yet instantiated.
        description: its model description.
    """

    mistakes: tuple[type[Exception], ...] = ()
    """What is passed on as it is: it says nothing of the FMU."""

    logging = False
    """Whether the FMU is asked to log."""

    without_states = ""
    """What to say of a state that cannot be had."""

    def __init__(self, name: str, slave: Any, description: ModelDescription) -> None:
        super().__init__(name, slave, description)
        self.failed_ends: list[str] = []
        self.terminated = self._alive = self._running = False
        self._loaded = is_native(slave)
        self.call_warnings, self.contradictions = CallWarnings(), CallWarnings()
        if self._loaded:
            slave.warned = lambda function: self.call_warnings.add(function, getattr(self, "time", math.nan))

    @property
    def running(self) -> bool:
        """Whether initialisation is over and the end has not come."""
        return self._running

    @property
    def usable(self) -> bool:
        """Whether the slave may still be called: instantiated, and no fatal error so far."""
        return self._alive

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Create the instance. Raises what `failure` makes where the slave refuses."""
        self.guard(INSTANTIATING, self._instantiate)
        self._alive = True

    def reset(self) -> None:
        """Back to the state after `instantiate`."""
        self.guard("reset", self.slave.reset)
        self._forget()
        self.terminated = self._running = False

    def terminate(self) -> None:
        """End the run; an error of a dying instance is kept in `failed_ends`."""
        if self._alive and self._running:
            self._running = False
            self._quietly("terminate", self.slave.terminate)

    def free(self) -> None:
        """Free the instance and its library."""
        if self._alive:
            self._alive = False
            self._quietly("freeInstance", self.slave.freeInstance)
        elif self._loaded and (self.slave.component is None or getattr(self.slave, "apart", False)):
            self._quietly("unloading", self.slave.freeLibrary)  # what freeInstance did not do
        self._loaded = False
        forget(self)

    def set_start(self, name: str, value: Any) -> None:
        """Set a numeric scalar or element before initialisation.

        Args:
            name: what is set.
            value: a number.
        """
        write, buffer = self.writer([name])
        buffer[0] = value
        write()

    @abstractmethod
    def begin_initialization(self, start_time: float, stop_time: float) -> None:
        """Set up the experiment and enter Initialization Mode, where the FMI version has one.

        Args:
            start_time: [s].
            stop_time: announced to the FMU [s].
        """

    def settle(self) -> None:
        """In Event Mode: update the discrete states until they do not change any more."""
        for _ in range(MAX_EVENT_ITERATIONS):
            if not self.update_discrete_states():
                return
        raise self.failure(f"discrete states do not settle in {MAX_EVENT_ITERATIONS} updates")

    def update_discrete_states(self) -> bool:
        """In Event Mode: end a super-dense instant; True where the slave needs another one."""
        raise NotImplementedError

    # -- values -----------------------------------------------------------------------------------------------------

    def reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        """A call that reads scalars and elements.

        Args:
            names: what is read.
            values: where to, shape (len(names),), a contiguous view of the caller's array.

        Returns:
            The call, prepared once; it takes no arguments.
        """
        return self.guarded(f"reading {shown(names)}", self._unguarded_reader(names, values))

    def writer(self, names: Sequence[str], values: np.ndarray | None = None) -> tuple[Callable[[], None], np.ndarray]:
        """A call that writes scalars and elements, prepared once, and the array that it writes from.

        Args:
            names: what is written. values: that array, shape (len(names),), contiguous; None for one of its own.
        """
        write, buffer = self._unguarded_writer(names, values)
        return self.guarded(f"writing {shown(names)}", write), buffer

    def exact_reader(self, name: str) -> Callable[[], Values]:
        """A call that returns the values of a whole variable as they are: texts, bytes, integers of any size.

        Args:
            name: of the variable. The values of an array come row by row.
        """
        read = exact_reader(self, self.variables[name])
        return lambda: self.guard(f"reading {name}", read)

    def exact_writer(self, name: str) -> Callable[[Sequence[Any]], None]:
        """A call that writes the values of a whole variable as they are.

        Args:
            name: of the variable.
        """
        write = exact_writer(self, self.variables[name])
        return lambda values: self.guard(f"writing {name}", write, values)

    def read(self, names: Sequence[str]) -> np.ndarray:
        """Values of numeric scalars and elements.

        Args:
            names: what is read.

        Returns:
            The values, shape (len(names),).
        """
        values = np.zeros(len(names))
        self.reader(names, values)()
        return values

    def get(self, variable: ModelVariable) -> Values:
        """The value of one variable of any type, by the getter of its type.

        Args:
            variable: a whole variable.
        """
        kind = getter_type(variable.type, self.fmi_version)
        values: Values = self.guard(f"get{kind} of {variable.name}", exact_reader(self, variable))
        return values

    def directional_derivative(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> np.ndarray:
        """See `derivative_call`: what that call gives."""
        found: np.ndarray = self.guard("getDirectionalDerivative", self.derivative_call(unknowns, knowns, seed))
        return found

    def derivative_call(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> Callable[[], np.ndarray]:
        """A call, unguarded, for derivatives of scalars and elements along a direction.

        Args:
            unknowns: outputs and the like. An array stands for all its elements.
            knowns: inputs and the like.
            seed: the direction, shape (len(knowns),).

        Returns:
            The call; it gives the derivatives, shape (len(unknowns),).
        """
        targets, sources = (
            layout([element for name in names for element in self.variables.expanded(name)])
            for names in (unknowns, knowns)
        )
        return directional_derivative(self.slave, targets, sources, seed)

    # -- state ------------------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """The state, to be restored any number of times and released once."""
        try:
            state = getattr(self.slave, self._get_state)()
            if getattr(state, "value", state) is None:  # a null pointer; to restore it would end the process
                raise RuntimeError("the slave gave no state")
        except self.mistakes:
            raise
        except Exception as error:
            raise self.explained(f"{self._get_state}{self.without_states}", error) from error
        return state, self._remember()

    def restore(self, state: Any) -> None:
        """Return to a saved state.

        Args:
            state: of this instance, from `save` or `deserialize`.
        """
        held, remembered = state
        self.guard(self._set_state, getattr(self.slave, self._set_state), held)
        self._recall(remembered)

    def release(self, state: Any) -> None:
        """Free a saved state.

        Args:
            state: of this instance.
        """
        if self._alive:
            self.guard(self._free_state, getattr(self.slave, self._free_state), state[0])

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes.

        Args:
            state: of this instance.
        """
        return bytes(self.guard("serializeFMUState", self.slave.serializeFMUState, state[0]))

    def deserialize(self, content: bytes) -> Any:
        """A saved state from bytes; what the slave's own state does not hold is as it is here and now.

        Args:
            content: from `serialize`, of this or another instance of the FMU.
        """
        return self.guard("deserializeFMUState", self.slave.deserializeFMUState, content), self._remember()

    # -- errors -----------------------------------------------------------------------------------------------------

    @abstractmethod
    def failure(self, reason: str, t: float | None = None) -> Exception:
        """An error of this instance, with what it logged last.

        Args:
            reason: what happened.
            t: when [s]; by default where it stands.
        """

    @abstractmethod
    def note(self, message: str | bytes | None, status: int | str = 0, category: str | bytes | None = None) -> None:
        """Take a message of the slave's own log.

        Args:
            message: the text.
            status: of FMI, by number or name.
            category: as the slave names it.
        """

    def guard(self, what: str, call: Callable[..., Any], *arguments: Any) -> Any:
        """Run a call of the slave; whatever it throws becomes an error of this instance.

        Args:
            what: the call, for the error.
            arguments: of the call.

        Returns:
            What the call returned.
        """
        try:
            return call(*arguments)
        except self.mistakes:
            raise
        except Exception as error:
            raise self.explained(what, error) from error

    def guarded(self, what: str, call: Callable[[], None]) -> Callable[[], None]:
        """The same for a call that is made often.

        Args:
            what: the call, for the error.
            call: takes no arguments.
        """
        mistakes = self.mistakes

        def guarded() -> None:
            try:
                call()
            except mistakes:
                raise
            except Exception as error:
                raise self.explained(what, error) from error

        guarded.native = getattr(call, "native", None)  # type: ignore[attr-defined]
        return guarded

    def explained(self, what: str, error: Exception, t: float | None = None) -> Exception:
        """The error of this instance for what a call threw. After a fatal one the slave is not called again.

        Args:
            what: the call.
            error: what it threw.
            t: when [s]; by default where it stands.
        """
        if isinstance(error, FMICallException) and getattr(error, "status", None) == FATAL:
            self._alive = self._running = False
        # of one that is stepped by a solver here, which says more; there is none while a library is loaded
        stated = getattr(getattr(self, "slave", None), "reason", "")
        return self.failure(f"{what} failed: {stated or error or type(error).__name__}", t)

    def discarded(self, error: Exception, asked: str, t: float) -> Exception:
        """The error of a discarded step: in the slave's own words, and with advice only where it said nothing.

        Args:
            error: what the call threw. asked: how far it was to go, and how far it came, in words. t: begin of it [s].
        """
        words, text = getattr(error, "reason", ""), f"doStep was discarded: {asked}"
        advice = "" if words or self.said_why else "; try a smaller communication step"
        return self.failure(f"{text}{': ' if words else ''}{words}{advice}", t)

    @property
    def said_why(self) -> bool:
        """Whether the slave itself said what is wrong, which `failure` then repeats."""
        return False

    # -- what versions and interface types add ----------------------------------------------------------------------

    _get_state: str
    _set_state: str
    _free_state: str
    """Names of the slave's functions that save, restore and free a state."""

    @abstractmethod
    def _instantiate(self) -> None: ...

    def _forget(self) -> None:
        """Drop what is remembered of a run; by default there is nothing."""

    def _remember(self) -> tuple[Any, ...]:
        """What belongs to a state beside the slave's own."""
        return (self.terminated,)

    def _recall(self, remembered: tuple[Any, ...]) -> None:
        """Return to what `_remember` gave."""
        self.terminated = remembered[0]

    # -- internals --------------------------------------------------------------------------------------------------

    def _unguarded_reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        return element_reader(self, names, values)

    def _unguarded_writer(
        self, names: Sequence[str], values: np.ndarray | None = None
    ) -> tuple[Callable[[], None], np.ndarray]:
        return element_writer(self, names, values)

    def _quietly(self, what: str, call: Callable[[], Any]) -> None:
        """Run a call that changes nothing any more where it fails; it is kept what failed."""
        try:
            self.guard(what, call)
        except Exception as error:
            self.failed_ends.append(str(error))


def shown(names: Sequence[str]) -> str:
    """The first names, and how many more there are.

    Args:
        names: of variables.
    """
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    return ", ".join(names[:NAMES_SHOWN]) + more

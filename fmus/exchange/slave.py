"""A model exchange FMU with the functions of co-simulation: what steps slaves cannot tell it from one.

The functions of co-simulation that its library lacks, and those that co-simulation uses otherwise, stand in fmpy's
table of functions as C functions: doStep, setters of inputs, saved states, ends of initialisation and of events. So
whoever calls a library calls them, the compiled stepper too.

In FMI 3 the slave has Event Mode and returns early at an event, which its master handles. In FMI 1 and 2 it handles
events itself. An input that changes is an event: the FMU goes through Event Mode before the next step.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException, fmi1EventInfo
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated
from fmpy.model_description import ModelDescription

from fmus.exchange.cvode import SolverError
from fmus.exchange.model_calls import EventIteration
from fmus.exchange.motion import Motion, Part, motion_of
from fmus.exchange.native_steps import CExchange, SharedField, address, load_steps
from fmus.exchange.sent import Key, SentValues
from fmus.exchange.states import StoredStates
from fmus.fmi.standard import DISCARD, ERROR, NEVER, OK, TIME_TOLERANCE, WARNING, Method, fmi_version
from fmus.fmi.types import BOOLEANS, CTYPES

TOLERANCE = 1e-8
"""Relative, where neither the FMU nor its user states one."""

_STEPS: dict[int, tuple[Any, ...]] = {
    1: (ctypes.c_double, ctypes.c_double, ctypes.c_char),
    2: (ctypes.c_double, ctypes.c_double, ctypes.c_int),
    3: (ctypes.c_double, ctypes.c_double, ctypes.c_bool, *[ctypes.c_void_p] * 4),
}
"""Arguments of doStep behind the instance, by version."""


class CoSimulationFunctions:
    """The functions of co-simulation over one instance, installed in fmpy's table of its functions.

    Args:
        slave: fmpy's model with its library loaded, not yet instantiated.
        description: its model description. method: of the solver.
    """

    reached, length = (
        SharedField("arrived", "Where the last step ended [s]."),
        SharedField("length", "How long it was to be [s]."),
    )

    def __init__(self, slave: Any, description: ModelDescription, method: Method = "bdf") -> None:
        self._slave, self._description, self._method = slave, description, method
        self._version, self._functions = fmi_version(description), dict(slave._functions)
        self.motion: Motion | None = None
        self.tolerance, self._start = TOLERANCE, 0.0
        self.sent, self.at, self._widths = SentValues(), CExchange(), dict[str, int]()
        self._kept, self._library = list[Any](), dict[str, Any]()
        for name, install in self._names().items():
            self._install(f"fmi{self._version}{name}", *install)
        for name in [n for n in self._functions if n[4:7] == "Set" and n[7:] in {*CTYPES, "Boolean"}]:
            self._install(name, self._setter(name), *self._types_of(name))
        self._share_steps()

    # -- what a master asks beside functions -------------------------------------------------------------------------

    def follow(self, part: Part | None) -> None:
        """Have somebody called for each internal step of the solver.

        Args:
            part: see `Motion.follower`; None for nobody.
        """
        if self.motion is not None:
            self.motion.follow(part)

    def look(self, t: float) -> None:
        """Put the FMU at an instant within the solver's last step, while somebody follows it.

        Args:
            t: instant [s].
        """
        self._motion.look(t)

    def last_time(self, kind: int) -> float:
        """fmi2GetRealStatus: where the last step ended [s].

        Args:
            kind: of status, in the numbers of FMI.
        """
        return self.reached if kind == fmi2LastSuccessfulTime else 0.0

    def has_terminated(self, kind: int = fmi2Terminated) -> bool:
        """fmi2GetBooleanStatus: whether the FMU asked for the end.

        Args:
            kind: of status, in the numbers of FMI.
        """
        return kind == fmi2Terminated and self.motion is not None and self.motion.terminated

    def summary(self) -> dict[str, Any]:
        """Which solver it is, and what it has taken since the FMU was initialised: steps and calls for derivatives."""
        said = {"name": "cvode", "method": self._method, "tolerance": self.tolerance}
        if self.motion is None:
            return said | {"steps": 0}
        steps, rates = self.motion.solver.steps, self.motion.derivative_calls
        return said | {"steps": steps, "derivatives": rates, "jacobian": self.motion.jacobian}

    # -- initialisation ---------------------------------------------------------------------------------------------

    def _set_up(self, call: Callable[..., int], instance: Any, *arguments: Any) -> int:
        """setupExperiment of FMI 2, enterInitializationMode of FMI 3: both begin with the tolerance."""
        defined, tolerance, self._start = arguments[:3]
        self.tolerance = tolerance if defined and tolerance > 0.0 else TOLERANCE
        self._stand_still()
        return call(instance, *arguments)

    def _initialised(self, call: Callable[..., int], instance: Any) -> int:
        status = call(instance)
        if status <= WARNING:
            self._begin()
            if self._version == 2:
                self._motion.settle()
        return status

    def initialize_first(self, tStart: float = 0.0, stopTime: float = 0.0, tolerance: float = TOLERANCE) -> None:
        """Initialisation of FMI 1: the model exchange function in place of fmiInitializeSlave.

        Args:
            tStart: [s]. stopTime: of no interest. tolerance: relative, of the solver.
        """
        slave, info, self.tolerance = self._slave, fmi1EventInfo(), tolerance
        slave.setTime(tStart)
        slave.fmi1Initialize(slave.component, b"\x00", 0.0, ctypes.byref(info))
        self._start = tStart
        self._begin()
        if self._motion.note(EventIteration.of_first(info)):
            self._motion.settle()
        else:
            self._motion.leave_event_mode()

    def _begin(self) -> None:
        slave, description, functions = self._slave, self._description, self._functions
        self.motion = motion_of(slave, description, functions, self.tolerance, self._method, self.at)
        self.reached = self._start

    def _stand_still(self) -> None:
        """Nothing moves it until it is initialised."""
        self.motion, self.at.elsewhere = None, True

    @property
    def _motion(self) -> Motion:
        if self.motion is None:
            raise SolverError("the FMU is not initialised")
        return self.motion

    # -- steps ------------------------------------------------------------------------------------------------------

    def native(self, name: str, references: bytes = b"") -> tuple[int, int] | None:
        """A function that steps or sets in C: its address, and what it takes in place of the instance; None where
        Python does it, through the table of functions.

        Args:
            name: of doStep, or of a setter. references: value references of what is set, as C has them.
        """
        library, installed = load_steps(), self._slave._functions.get(name)
        if library is None or name not in self._library:
            return None
        if name.endswith("DoStep"):
            return address(library[f"exchange_step{self._version}"]), ctypes.addressof(self.at)
        entry = self.sent.entry((name, references))
        entry.exchange, entry.function = ctypes.addressof(self.at), address(self._library[name])
        entry.otherwise = address(installed)
        return address(library.exchange_set), ctypes.addressof(entry)

    def _share_steps(self) -> None:
        """What C calls where it does not make a step itself."""
        call = self._kept_function(self._proceed, ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int64, ctypes.c_double))
        self.at.proceed = address(call)
        self.at.otherwise = address(self._slave._functions[f"fmi{self._version}DoStep"])
        self.at.returns = self._description.coSimulation.mightReturnEarlyFromDoStep

    def _proceed(self, ended: int, until: float) -> int:
        """See to what C left of a step."""
        self._motion.proceed(ended, until)
        return OK

    def _step(self, _call: Any, _instance: Any, t: float, h: float, _past: Any, *results: int) -> int:
        if self._version == 3:
            return self._step_to_event(t, t + h, *results)
        self.length, end = h, self._motion.step(t, t + h)
        self.reached = end.time
        return DISCARD if end.terminate else OK

    def _step_to_event(self, t: float, until: float, event: int, terminate: int, early: int, reached: int) -> int:
        """To the first event, or in one that does not declare early returns to an event at the very end."""
        self.length = until - t
        end = self._motion.advance(t, until, returns=self._description.coSimulation.mightReturnEarlyFromDoStep)
        returned = until - end.time > TIME_TOLERANCE
        for place, said in ((event, end.event), (terminate, end.terminate), (early, returned)):
            ctypes.c_bool.from_address(place).value = said
        ctypes.c_double.from_address(reached).value = self.reached = end.time
        return OK

    # -- inputs -----------------------------------------------------------------------------------------------------

    def _setter(self, name: str) -> Callable[..., int]:
        """A setter through Event Mode, where values differ from those that were set last."""
        kind = name[7:]
        held = (BOOLEANS[self._version] if kind == "Boolean" else CTYPES[kind])[0]
        width, of_values = ctypes.sizeof(held), self._version == 3
        self._widths[name] = width

        def set_values(
            call: Callable[..., int], instance: Any, references: int, n: int, values: int, *more: int
        ) -> int:
            key = name, ctypes.string_at(references, 4 * n)
            content = ctypes.string_at(values, width * (more[0] if of_values else n))
            if self.sent.get(key) == content:
                return OK
            if self.motion is not None:
                self.motion.enter_event_mode()
            status = call(instance, references, n, values, *more)
            if status <= WARNING:
                self.sent.put(key, content)
            return status

        return set_values

    # -- events of FMI 3, which the master handles ---------------------------------------------------------------------

    def _enter_event_mode(self, _call: Callable[..., int], _instance: Any) -> int:
        self._motion.enter_event_mode()
        return OK

    def _enter_step_mode(self, _call: Any, _instance: Any) -> int:
        self._motion.leave_event_mode()
        return OK

    def _update(self, call: Callable[..., int], instance: Any, *results: int) -> int:
        status = call(instance, *results)
        again, terminate, nominals, _, defined = (ctypes.c_bool.from_address(place).value for place in results[:5])
        due = ctypes.c_double.from_address(results[5]).value if defined else NEVER
        self._motion.note(EventIteration(again, terminate, due, nominals))
        return status

    # -- states, see `states.StoredStates` -----------------------------------------------------------------------------

    @property
    def moved(self) -> Motion:
        """What moves it."""
        return self._motion

    def put(self, key: Key, content: bytes) -> None:
        """Set variables as they were, through Event Mode.

        Args:
            key: function and value references. content: values as C has them.
        """
        name, references = key
        self._motion.enter_event_mode()
        held, values = (ctypes.create_string_buffer(kept, len(kept)) for kept in (references, content))
        more = (len(content) // self._widths[name],) if self._version == 3 else ()
        places = ctypes.addressof(held), len(references) // 4, ctypes.addressof(values)
        status = self._library[name](self._slave.component, *places, *more)
        if status > WARNING:
            raise FMICallException(name, status)
        self.sent.put(key, content)

    def get_reals(self, references: Sequence[int]) -> np.ndarray:
        """Real scalars, shape (n,).

        Args:
            references: of them.
        """
        get = self._slave.getReal if self._version == 2 else self._slave.getFloat64
        return np.array(get(list(references)) if references else [], dtype=float)

    def _reset(self, call: Callable[..., int], instance: Any) -> int:
        self._stand_still()
        self.sent.restore({})
        return call(instance)

    # -- installation -----------------------------------------------------------------------------------------------

    def _names(self) -> dict[str, tuple[Any, ...]]:
        """What is installed beside the setters: a function, and the types of its arguments behind the instance.

        Their first argument is the function of the library.
        """
        pointer, step = ctypes.c_void_p, {"DoStep": (self._step, *_STEPS[self._version])}
        if self._version == 1:
            return step
        flag: Any = ctypes.c_int if self._version == 2 else ctypes.c_bool
        begin = "SetupExperiment" if self._version == 2 else "EnterInitializationMode"
        common: dict[str, tuple[Any, ...]] = {
            begin: (self._set_up, flag, ctypes.c_double, ctypes.c_double, flag, ctypes.c_double),
            "ExitInitializationMode": (self._initialised,),
            "Reset": (self._reset,),
        }
        if self._description.coSimulation.canGetAndSetFMUstate:
            common |= StoredStates(self, self._description).functions(self._version)
        if self._version == 2:
            return step | common
        return (
            step
            | common
            | {
                "EnterEventMode": (self._enter_event_mode,),
                "EnterStepMode": (self._enter_step_mode,),
                "UpdateDiscreteStates": (self._update, *[pointer] * 6),
            }
        )

    def _types_of(self, name: str) -> Sequence[Any]:
        """Types of the arguments of a setter behind the instance."""
        size, pointer = ctypes.c_size_t, ctypes.c_void_p
        return (pointer, size, pointer, size) if name.startswith("fmi3") else (pointer, size, pointer)

    def _install(self, name: str, function: Callable[..., int], *types: Any) -> None:
        """Put a function in the place of that of the library, which it is given first; None where there is none."""
        prototype = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, *types)
        own = self._functions.get(name)
        library = None if own is None else prototype(ctypes.cast(own, ctypes.c_void_p).value or 0)
        self._library[name] = library

        installed = self._kept_function(lambda *arguments: function(library, *arguments), prototype)
        installed.argnames = tuple(f"argument {k}" for k in range(len(types) + 1))
        self._slave._functions[name] = installed
        if own is None:
            setattr(self._slave, name, lambda *arguments: self._slave._call(name, *arguments))

    def _kept_function(self, function: Callable[..., int], prototype: Any) -> Any:
        """A function for C, which returns a status; what went wrong stands in the slave's `reason`."""

        def called(*arguments: Any) -> int:
            self._slave.reason = ""
            try:
                return function(*arguments)
            except FMICallException as error:
                self._slave.reason = str(error)
                return int(error.status)
            except SolverError as error:
                self._slave.reason = str(error)
                return error.status
            except Exception as error:  # nothing may pass through C
                self._slave.reason = f"{type(error).__name__}: {error}"
                return ERROR

        self._kept.append(prototype(called))
        return self._kept[-1]


def as_slave(slave: Any, description: ModelDescription, method: Method = "bdf") -> Any:
    """fmpy's model of a model exchange FMU with the call surface of fmpy's slave; see `solver_of`.

    Args:
        slave: with its library loaded, not yet instantiated.
        description: its model description. method: of the solver.
    """
    functions = slave.solved = CoSimulationFunctions(slave, description, method)
    instantiate, names = slave.instantiate, {"loggingOn", "logMessage", "callbacks", "functions", "visible"}
    slave.instantiate = lambda **stated: instantiate(**{k: v for k, v in stated.items() if k in names})
    slave.getRealStatus, slave.getBooleanStatus = functions.last_time, functions.has_terminated
    if fmi_version(description) == 1:
        slave.initialize, slave.reset = functions.initialize_first, _no_reset
    return slave


def _no_reset() -> None:
    raise RuntimeError("model exchange of FMI 1.0 has no reset")


def solver_of(slave: Any) -> CoSimulationFunctions | None:
    """What moves a slave that was made by `as_slave`; None of another one.

    Args:
        slave: of a component.
    """
    found: CoSimulationFunctions | None = getattr(slave, "solved", None)
    return found

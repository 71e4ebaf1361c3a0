"""FMI 1.0: co-simulation slaves; no Initialization Mode, no saved states, aliases with the other sign.

Inputs and start values are set before fmiInitializeSlave, and nothing can be read before it: until then the outputs are
their declared start values, which is what the other components see while inputs and outputs are exchanged at the start
time.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException, fmi1LastSuccessfulTime
from fmpy.model_description import ModelDescription, ModelVariable

from fmus.fmi.described import EventPort
from fmus.fmi.exact_ports import Values
from fmus.fmi.native_log import fmi1_callbacks
from fmus.fmi.ports import is_native
from fmus.fmi.slave import WholeStepSlave, make_step, status_of
from fmus.fmi.values import negative

TRUE = b"\x01"
NOTHING = {"String": "", "Boolean": False}
"""What a variable without a declared start value is taken for; else 0."""


class FMI1Slave(WholeStepSlave):
    """A co-simulation slave of FMI 1.0.

    Args:
        name: of the instance.
        slave: object with fmpy's slave call surface, not yet instantiated.
        description: its model description.
    """

    fmi_version = 1
    event_needs_step = True

    def __init__(self, name: str, slave: Any, description: ModelDescription) -> None:
        super().__init__(name, slave, description)
        self._stop_time, self._initialized = 0.0, False
        self._held: dict[tuple[str, int], Any] = {}

    @property
    def can_save(self) -> bool:
        """Never: FMI 1.0 has no saved states."""
        return False

    def _instantiate(self) -> None:
        if is_native(self.slave):
            self.slave.instantiate(functions=fmi1_callbacks(self), loggingOn=self.logging)
            if not self.slave.component:
                raise RuntimeError("fmiInstantiateSlave returned no instance")
        else:
            self.slave.instantiate()
        self._do_step = make_step(self.slave, "fmi1DoStep", ctypes.c_char(TRUE))  # each step is new
        self._forget()

    def _forget(self) -> None:
        self._initialized = False
        self._held = {}
        for name, variable in self.variables.items():
            if variable.start is not None:
                self._hold(name, self._declared_start(variable))

    def _find_events(self) -> dict[str, EventPort]:
        return {}

    def begin_initialization(self, start_time: float, stop_time: float) -> None:
        """Only note the end: the slave is initialised when all start values and inputs are known.

        Args:
            start_time: [s].
            stop_time: [s].
        """
        self._stop_time = stop_time

    def exit_initialization(self) -> None:
        """Initialise the slave with the inputs and start values set so far."""
        call, start, stop = self.slave.initialize, self.time, self._stop_time
        tolerance, _ = self.tolerance_argument()  # of a solver here, never of co-simulation
        self.guard("fmiInitializeSlave", lambda: call(tStart=start, stopTime=stop, **tolerance))
        self._initialized = self._running = True

    def _after_discard(self, error: FMICallException, t: float, until: float) -> None:
        solved = getattr(self.slave, "solved", None)  # model exchange knows of an end, co-simulation of FMI 1 not
        if solved is not None and solved.has_terminated():
            self.time, self.terminated = solved.reached, True
            return
        raise self._not_done(error, t, until, status_of(self.slave.getRealStatus, fmi1LastSuccessfulTime)) from error

    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:
        raise self.failure(f"an FMI 1.0 slave takes no events (got '{event.name}')", t)

    def save(self) -> Any:
        raise self.failure("an FMI 1.0 slave cannot save its state")

    def restore(self, state: Any) -> None:
        raise self.failure("an FMI 1.0 slave cannot restore a state")

    def release(self, state: Any) -> None:
        """Nothing to free.

        Args:
            state: none.
        """

    # -- what is known before the slave is initialised -----------------------------------------------------------------

    def _hold(self, name: str, value: Any) -> None:
        """Remember a value as the slave has it: aliases share it."""
        variable = self.variables[name]
        held = negative(variable, value) if name in self.negated else value
        self._held[variable.type, variable.valueReference] = held

    def _known(self, name: str) -> Any:
        variable = self.variables[name]
        value = self._held.get((variable.type, variable.valueReference), NOTHING.get(variable.type, 0))
        return negative(variable, value) if name in self.negated else value

    def _declared_start(self, variable: ModelVariable) -> Any:
        text = str(variable.start)
        if variable.type == "String":
            return text
        if variable.type == "Boolean":
            return text.strip() in {"true", "1"}
        try:
            return float(text) if variable.type == "Real" else int(text)
        except ValueError as error:
            stated = f"{self.name}.{variable.name} declares the start value {text!r}"
            raise ValueError(f"{stated}, which is no {variable.type}.") from error

    def exact_reader(self, name: str) -> Callable[[], Values]:
        read = super().exact_reader(name)
        return lambda: read() if self._initialized else (self._known(name),)

    def exact_writer(self, name: str) -> Callable[[Sequence[Any]], None]:
        write = super().exact_writer(name)

        def write_and_hold(values: Sequence[Any]) -> None:
            write(values)
            self._hold(name, values[0])

        return write_and_hold

    def _unguarded_reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        read = super()._unguarded_reader(names, values)

        def read_or_show() -> None:
            if self._initialized:
                read()
            else:
                values[:] = [self._known(name) for name in names]

        return read_or_show

    def _unguarded_writer(
        self, names: Sequence[str], values: np.ndarray | None = None
    ) -> tuple[Callable[[], None], np.ndarray]:
        write, buffer = super()._unguarded_writer(names, values)

        def write_and_hold() -> None:
            write()
            if not self._initialized:
                for name, value in zip(names, buffer.tolist(), strict=True):
                    self._hold(name, value)

        return write_and_hold, buffer

"""The FMI 1.0 dialect of a component: no Initialization Mode, no saved states, aliases with the other sign.

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
from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.components.described import EventPort
from cosim.components.start_values import typed_value
from cosim.diagnostics.native_log import fmi1_callbacks
from cosim.errors import CouplingError
from fmus.fmi.exact_ports import Values
from fmus.fmi.native_calls import prepared_call
from fmus.fmi.standard import DISCARD, PENDING
from fmus.fmi.values import negative

TRUE = b"\x01"
NOTHING = {"String": "", "Boolean": False}
"""What a variable without a declared start value is taken for; else 0."""


class FMI1Component(Component):
    """An FMI 1.0 co-simulation slave.

    Args:
        name, slave, description: as for `Component`.
        negated: names of variables with ``alias="negatedAlias"``: the slave holds the value with the other sign.
        more: further arguments of `Component`.
    """

    fmi_version = 1
    real_type = "Real"
    event_needs_step = True

    def __init__(
        self,
        name: str,
        slave: Any,
        description: ModelDescription,
        *,
        negated: frozenset[str] = frozenset(),
        **more: Any,
    ) -> None:
        super().__init__(name, slave, description, **more)
        self.negated = negated
        self._stop_time = 0.0
        self._held: dict[tuple[str, int], Any] = {}
        self._forget()

    @property
    def can_save(self) -> bool:
        """Never: FMI 1.0 has no saved states."""
        return False

    def _instantiate(self) -> None:
        if hasattr(self.slave, "dll"):
            self.slave.instantiate(functions=fmi1_callbacks(self), loggingOn=self._logging_on)
            if not self.slave.component:
                raise RuntimeError("fmiInstantiateSlave returned no instance")
        else:
            self.slave.instantiate()
        self._do_step = _make_step(self.slave)
        self._forget()

    def _forget(self) -> None:
        self._initialized = False
        self._held = {}
        for name, variable in self.variables.items():
            if variable.start is not None:
                self._hold(name, _declared_start(self, name))

    def _find_events(self) -> dict[str, EventPort]:
        return {}

    def set_start(self, name: str, value: Any) -> None:  # noqa: D102 - see Component
        super().set_start(name, value)
        self._hold(name, typed_value(self.variables[name], value))

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Only note the times [s]: the slave is initialised when all start values and inputs are known."""
        self.time, self._stop_time = start_time, stop_time

    def exit_initialization(self) -> None:
        """Initialise the slave with the inputs and start values set so far."""
        call, start, stop = self.slave.initialize, self.time, self._stop_time
        self._guard("fmiInitializeSlave", lambda: call(tStart=start, stopTime=stop))
        self._initialized = self._running = True

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Component
        self._step_whole(self._do_step, self._refused, t, until)

    def _refused(self, error: FMICallException, t: float, until: float) -> None:
        if error.status == PENDING:
            raise self.pending(t) from error
        if error.status != DISCARD:
            raise self._explained("doStep", error, t) from error
        try:
            known = f"it came to {float(self.slave.getRealStatus(fmi1LastSuccessfulTime)):g} s"
        except Exception:  # a slave that cannot say how far it came
            known = "it does not say how far it came"
        reason = f"doStep was discarded: asked for {until:g} s, {known}; try a smaller communication step"
        raise self.failure(reason, t) from error

    def notify(self, event: EventPort, t: float, stamp: float, payload: Mapping[str, float]) -> None:  # noqa: D102 - see Component
        raise self.failure(f"an FMI 1.0 slave takes no events (got '{event.name}')", t)

    def save(self) -> Any:  # noqa: D102 - see Component
        raise self.failure("an FMI 1.0 slave cannot save its state")

    def restore(self, state: Any) -> None:  # noqa: D102 - see Component
        raise self.failure("an FMI 1.0 slave cannot restore a state")

    def release(self, state: Any) -> None:
        """Nothing to free."""

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

    def exact_reader(self, name: str) -> Callable[[], Values]:  # noqa: D102 - see Component
        read = super().exact_reader(name)
        return lambda: read() if self._initialized else (self._known(name),)

    def exact_writer(self, name: str) -> Callable[[Sequence[Any]], None]:  # noqa: D102 - see Component
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

    def _unguarded_writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        write, buffer = super()._unguarded_writer(names)

        def write_and_hold() -> None:
            write()
            if not self._initialized:
                for name, value in zip(names, buffer.tolist(), strict=True):
                    self._hold(name, value)

        return write_and_hold, buffer


def _make_step(slave: Any) -> Callable[[float, float], None]:
    """The slave's doStep(t, h) in [s]; each is a new one, none is repeated."""
    if not hasattr(slave, "dll"):
        return lambda t, h: slave.doStep(t, h, TRUE)
    start, length = ctypes.c_double(), ctypes.c_double()
    call = prepared_call(slave, "fmi1DoStep", slave.component, start, length, ctypes.c_char(TRUE))

    def do_step(t: float, h: float) -> None:
        start.value, length.value = t, h
        call()

    return do_step


def _declared_start(component: Component, name: str) -> Any:
    """The declared start value of a variable.

    Raises:
        CouplingError: it is none of the variable's type.
    """
    variable = component.variables[name]
    text = str(variable.start)
    if variable.type == "String":
        return text
    if variable.type == "Boolean":
        return text.strip() in {"true", "1"}
    try:
        return float(text) if variable.type == "Real" else int(text)
    except ValueError as error:
        raise CouplingError(
            f"{component.name}.{name} declares the start value {text!r}, which is no {variable.type}."
        ) from error

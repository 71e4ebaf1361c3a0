"""A sealed FMU as a model with a state: what co-simulation and model exchange have in common. Touches one instance.

The state goes in by start values: the instance is reset, its parameters and states are set, and it is initialised at
the instant asked for. FMI allows that for every state whose start is exact, in co-simulation and in model exchange.
"""

from __future__ import annotations

import shutil
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import repeat
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cosim.errors import CosimError, nearest
from fmus.check.checked_instance import SlaveError
from fmus.fmi.instance import Instance
from fmus.fmi.types import why_not_set

Array = NDArray[np.float64]
Way = Literal["restart", "step mode", "exchange"]
REALS = ("Real", "Float64", "Float32")
FAR = 1e6
"""End of the experiment that is announced, after the instant of a restart [s]."""


class FmuModelError(CosimError, ValueError):
    """An FMU cannot serve as a model; the message says which finding stands against it, and what to do."""


class SealedModel(ABC):
    """One instance of an FMU whose states are written by start values.

    Args:
        instance: loaded, not yet instantiated. folder: of its files, removed at the end.
        path: of the FMU, for messages.
        states: names of the states; None for those that the model description declares by their derivatives.
        outputs: names of what is read; None for all real outputs.
        inputs: names of what is written; None for all real inputs.
        parameters: start values by name.

    Raises:
        FmuModelError: a name is unknown, there are no states, or a state cannot be set.
    """

    way: Way
    """How states are written."""

    def __init__(
        self,
        instance: Any,
        folder: Path,
        path: str,
        *,
        states: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        inputs: Sequence[str] | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> None:
        self.instance, self.path = instance, path
        self._finalizer = weakref.finalize(self, _put_away, instance, folder)
        self.states = tuple(self._own_states(states))
        self.outputs = tuple(self._chosen(outputs, real_names(instance, "output"), "output"))
        self.inputs = tuple(self._chosen(inputs, real_names(instance, "input"), "input"))
        self.parameters = dict(parameters or {})
        self._demand_starts()
        self.called(instance.instantiate)
        self._states_read, self._outputs_read = np.zeros(len(self.states)), np.zeros(len(self.outputs))
        self._read_states = instance.reader(list(self.states), self._states_read)
        self._read_outputs = instance.reader(list(self.outputs), self._outputs_read)
        self._write_inputs, self._inputs = instance.writer(list(self.inputs))
        self.start, self.start_inputs = self.called(self._begun)
        self._demand_settable()
        self.parameters = {name: value for name, value in self.parameters.items() if name not in self.states}
        starts = self.states if all(map(self._has_start, self.states)) else ()
        self._settings = [name for name in self.parameters if name not in self.inputs]
        self._written = [*self._settings, *starts, *self.inputs]  # by one call
        self._write_values, self._values = instance.writer(self._written)
        self._state_values = self._values[len(self._settings) : len(self._settings) + len(starts)]
        self._input_values = self._values[len(self._settings) + len(starts) :]
        self.set_parameters({})
        self._quicken()

    def _quicken(self) -> None:
        """Prepare calls that are made often; by default nothing."""
        return

    def _begun(self) -> tuple[Array, Array]:
        """States and inputs where the FMU itself begins under its parameters."""
        for name, value in self.parameters.items():
            self.instance.set_start(name, float(value))
        begin = getattr(self.instance.description.defaultExperiment, "startTime", None)
        self._enter(float(begin or 0.0))
        return self.instance.read(list(self.states)), self.instance.read(list(self.inputs))

    def set_parameters(self, values: Mapping[str, float]) -> None:
        """Other values of parameters, from the next restart on.

        Args:
            values: by name, of parameters that the model was opened with.
        """
        self.parameters.update(values)
        self._values[: len(self._settings)] = [self.parameters[name] for name in self._settings]

    # -- one point ----------------------------------------------------------------------------------------------------

    def restart(self, t: float, x: Array, u: Array) -> None:
        """Stand at a state, at an instant, under inputs.

        Args:
            t: instant [s]. x: states, shape (n,). u: inputs, shape (m,).

        Raises:
            FmuModelError: the FMU refuses.
        """
        try:
            self._restart(t, x, u)
        except SlaveError as error:
            raise self._in_words(error) from error

    def _restart(self, t: float, x: Array, u: Array) -> None:
        self.instance.reset()
        self._write_point(x, u)
        self._enter(t)

    def _write_point(self, x: Array, u: Array) -> None:
        """Parameters, states and inputs, before initialisation."""
        self._state_values[:] = x[: len(self._state_values)]
        self._input_values[:] = self._inputs[:] = u
        if self._written:
            self._write_values()

    def set_inputs(self, u: Array) -> None:
        """Write the inputs where the instance stands.

        Args:
            u: inputs, shape (m,).
        """
        if len(self.inputs):
            self._inputs[:] = u
            self.called(self._write_inputs)

    def values_at(self, t: float, x: Array, u: Array) -> tuple[Array, Array]:
        """States and outputs just after a restart.

        Args:
            t: instant [s]. x: states, shape (n,). u: inputs, shape (m,).

        Returns:
            The states as they are read back, shape (n,), and the outputs, shape (q,).
        """
        self.restart(t, x, u)
        return self.read()

    def read(self) -> tuple[Array, Array]:
        """States, shape (n,), and outputs, shape (q,), where the instance stands."""

        self.called(self._read)
        return self._states_read.copy(), self._outputs_read.copy()

    def _read(self) -> None:
        self._read_states()
        if len(self.outputs):
            self._read_outputs()

    def advance(self, t: float, h: float) -> None:
        """Go on from where the instance stands, inputs held.

        Args:
            t: instant [s]. h: how far [s].

        Raises:
            FmuModelError: the FMU refuses the step.
        """
        try:
            self.instance.advance(t, t + h)
        except SlaveError as error:
            raise self._in_words(error) from error

    def transition(self, t: float, h: float, x: Array, u: Array) -> tuple[Array, Array]:
        """States and outputs after a step from any state.

        Args:
            t: begin of the step [s]. h: its length [s]. x: states, shape (n,). u: inputs, held, shape (m,).

        Returns:
            States, shape (n,), and outputs, shape (q,), at its end.
        """
        self.restart(t, x, u)
        self.advance(t, h)
        return self.read()

    # -- many points --------------------------------------------------------------------------------------------------

    def states_after(self, t: float, h: float, points: Array, u: Array) -> Array:
        """States after a step from each of several states; outputs are not read.

        Args:
            t: begin of the step [s]. h: its length [s]. points: states, shape (n, N).
            u: inputs, held, shape (m,), or (m, N) for inputs of each point.

        Returns:
            States at its end, shape (n, N).
        """
        found = np.empty((points.shape[1], len(self.states)))
        for row, x, driven in zip(found, points.T, repeat(u) if u.ndim == 1 else u.T, strict=False):
            self.restart(t, x, driven)
            self.advance(t, h)
            self.called(self._read_states)
            row[:] = self._states_read
        return found.T

    def outputs_at(self, t: float, points: Array, u: Array, chosen: Sequence[int] | None = None) -> Array:
        """Outputs just after a restart at each of several states; states are not read back.

        Args:
            t: instant [s]. points: states, shape (n, N). u: inputs, shape (m,).
            chosen: which outputs, k of them; None for all.

        Returns:
            Outputs, shape (k, N).
        """
        found = np.empty((points.shape[1], len(self.outputs)))
        for row, x in zip(found, points.T, strict=True):
            self.restart(t, x, u)
            if self.outputs:
                self.called(self._read_outputs)
            row[:] = self._outputs_read
        return found.T if chosen is None else np.ascontiguousarray(found[:, chosen]).T

    @abstractmethod
    def _enter(self, t: float) -> None:
        """Through initialisation at an instant [s]."""

    # -- names --------------------------------------------------------------------------------------------------------

    def unit(self, name: str) -> str:
        """Unit of a variable as its description names it, ``1`` where there is none.

        Args:
            name: of the variable.
        """
        return str(getattr(self.instance.variables[name], "unit", None) or "1")

    def nominal(self, name: str) -> float:
        """Nominal size of a variable, 1 where none is declared.

        Args:
            name: of the variable.
        """
        declared = getattr(self.instance.variables[name], "nominal", None)
        return abs(float(declared)) if declared else 1.0

    def close(self) -> None:
        """End the instance and remove its files."""
        self._finalizer()

    def _chosen(self, stated: Sequence[str] | None, own: Sequence[str], what: str) -> Sequence[str]:
        if stated is None:
            if what == "state" and not own:
                raise FmuModelError(
                    f"{self.path}: its description declares no continuous state (no derivative of a variable). Name "
                    "the variables that hold its state (states); an FMU without any has no memory that a filter could "
                    "estimate."
                )
            return own
        for name in stated:
            try:
                self.instance.variables.element(name)
            except KeyError as error:
                found = self.instance.description.modelVariables
                settable = [v.name for v in found if v.causality != "input" and v.initial in ("exact", "approx")]
                every = settable if what == "parameter" else [v.name for v in found]
                hint = nearest(name, own or every)
                raise FmuModelError(f"{self.path}: no {what} {name!r}; {hint}") from error
        return stated

    def _demand_starts(self) -> None:
        for name in self._chosen(list(self.parameters), [], "parameter"):
            if objection := why_not_set(self.instance.variables.element(name).variable):
                raise FmuModelError(f"{self.path}: {name} cannot be set: it {objection}.")

    def _own_states(self, stated: Sequence[str] | None) -> Sequence[str]:
        return self._chosen(stated, declared_states(self.instance), "state")

    def _has_start(self, name: str) -> bool:
        """Whether a start value of a state may be set."""
        variable = self.instance.variables.element(name).variable
        return variable.causality in ("parameter", "input") or (
            variable.initial in ("exact", "approx") and variable.variability != "constant"
        )

    @abstractmethod
    def _demand_settable(self) -> None:
        """Refuse states that nothing moves; the instance stands at its start."""

    def called(self, call: Callable[[], Any]) -> Any:
        """What a call of the FMU gives; its failure in words with the file.

        Args:
            call: takes no arguments.

        Raises:
            FmuModelError: the call failed.
        """
        try:
            return call()
        except SlaveError as error:
            raise self._in_words(error) from error

    def _in_words(self, error: SlaveError) -> FmuModelError:
        return FmuModelError(f"{self.path}: {str(error).rstrip('.')}.")


def real_names(instance: Instance, causality: str) -> list[str]:
    """Names of the continuous real scalars and elements of one causality.

    Args:
        instance: of the FMU. causality: in the words of FMI.
    """
    return [n for n in instance.names(causality) if instance.variables.element(n).variable.type in REALS]


def declared_states(instance: Instance) -> list[str]:
    """Names of the continuous states that a model description declares, in the order of the state vector.

    They are counted by its ModelStructure: an output that aliases a state may have a derivative too. Co-simulation may
    leave that list out; then every variable with a derivative is a state, aliases once.

    Args:
        instance: of the FMU.
    """
    description = instance.description
    rates = [unknown.variable for unknown in description.derivatives]
    if not rates:
        rates = [variable for variable in description.modelVariables if variable.derivative is not None]
    found = [rate.derivative for rate in rates if rate.derivative is not None]
    if not description.derivatives:
        first = {(state.type, state.valueReference): state for state in reversed(found)}
        found = [state for state in found if first[state.type, state.valueReference] is state]
    names = [element.name for state in found for element in instance.variables.expanded(state.name)]
    return list(dict.fromkeys(names))


def _put_away(instance: Instance, folder: Path) -> None:
    with suppress(Exception):  # an FMU that fails at its end changes nothing any more
        instance.terminate()
        instance.free()
    shutil.rmtree(folder, ignore_errors=True)

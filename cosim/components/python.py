"""A user's plain Python object as a component. Knows one object.

It has the call surface of an FMI 3.0 slave, as a block has: to whoever steps components it is as an FMU. Its
event ``balise`` is a triggered input clock with the fields of a telegram that the object's ``balise`` takes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

from cosim.components.fmi3 import FMI3Component
from cosim.components.python_model import UNKNOWN_UNIT, NamedInputs, PythonModel, slices
from fmu_observer.annotated_variable import MARKS, AnnotatedVariable
from plant_models.hybrid.signal import Signal

EVENT = "balise"
NO_TIME = float("nan")


@dataclass
class _EventCounters:
    """What became of the telegrams.

    Args:
        accepted: those that it used. ignored: those of which its ``balise`` returned False.
    """

    accepted: int = 0
    ignored: int = 0


class _PythonSlave:
    """A Python object with the call surface of fmpy's `FMU3Slave`.

    Args:
        model: the object's class, and its declarations.
    """

    def __init__(self, model: PythonModel) -> None:
        self.model = model
        self.component = self
        self.counters = _EventCounters()
        self._inputs, self._parameters = slices(model.inputs), slices(model.parameter_signals)
        fields = [name for name in model.telegram or () if name != "stamp"]
        telegram = [Signal(f"{EVENT}_{name}", UNKNOWN_UNIT, "input", "discrete") for name in fields]
        telegram += [] if model.telegram is None else [Signal(f"{EVENT}_time", "s", "input", "discrete")]
        self._groups = model.inputs, model.outputs, model.parameter_signals, tuple(telegram)
        widths = [sum(signal.width for signal in group) for group in self._groups]
        self._ends = [0, *np.cumsum(widths).tolist()]
        self._values = np.array([x for group in self._groups for s in group for x in s.start_values])
        self._stated: dict[str, Any] = {}
        self._made: Any = None
        self._time, self._notified = NO_TIME, False
        self.model_description = self.modelDescription = self._describe()

    def _describe(self) -> ModelDescription:
        model = self.model
        clock = ModelVariable(
            name=EVENT,
            valueReference=self._ends[-1] + 1,
            type="Clock",
            causality="input",
            variability="discrete",
            intervalVariability="triggered",
        )
        names = [(s, n) for group in self._groups for s in group for n in s.scalar_names]
        variables = [_variable(s, n, i, model, clock) for i, (s, n) in enumerate(names, start=1)]
        outputs = [variable for variable in variables if variable.causality == "output"]
        by_name = {variable.name: variable for variable in variables}
        direct = {
            output: [by_name[n] for i in inputs for n in _scalars(model.inputs, i)]
            for output, inputs in model.direct.items()
        }
        abilities = CoSimulation(
            modelIdentifier="python",
            canHandleVariableCommunicationStepSize=True,
            canGetAndSetFMUstate=True,
            hasEventMode=model.telegram is not None,
        )
        return ModelDescription(
            fmiVersion="3.0",
            modelName=model.cls.__name__,
            instantiationToken=model.identity,
            description=" ".join((model.cls.__doc__ or "").split()),
            generationTool="Python",
            coSimulation=abilities,
            modelVariables=variables + ([clock] if model.telegram is not None else []),
            outputs=[Unknown(variable=v, dependencies=direct.get(v.name.partition("[")[0], [])) for v in outputs],
        )

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self, **_: Any) -> None:
        """Nothing to do: the object is made when its parameters are known."""

    def reset(self) -> None:
        """Back to before initialisation."""
        self._made, self._time, self._notified, self.counters = None, NO_TIME, False, _EventCounters()

    def enterInitializationMode(self, startTime: float = 0.0, stopTime: float | None = None, **_: Any) -> None:
        """Make the object with its parameters; its attributes are the first outputs.

        Args:
            startTime: [s]. stopTime: [s], without effect.
        """
        self._made, self._time = self.model.make(self._stated), startTime
        self._take(None, "")

    def exitInitializationMode(self) -> None:
        """Nothing to do."""

    def terminate(self) -> None:
        """Nothing to do."""

    def freeInstance(self) -> None:
        """Forget the object."""
        self._made = None

    def freeLibrary(self) -> None:
        """Nothing to do."""

    # -- time -------------------------------------------------------------------------------------------------------

    def doStep(self, t: float, h: float, *_: Any) -> tuple[bool, bool, bool, float]:
        """The object's ``step``.

        Args:
            t: time [s]. h: length of the step [s].
        """
        inputs = NamedInputs()
        for signal in self.model.inputs:
            values = self._values[self._inputs[signal.name]]
            inputs[signal.name] = float(values[0]) if signal.size is None else values.copy()
        self._take(self.model.step(self._made, t, inputs, h), "step")
        self._time = t + h
        return False, False, False, self._time

    def enterEventMode(self) -> None:
        """The event happens in `updateDiscreteStates`."""

    def setClock(self, vr: Sequence[int], values: Sequence[bool]) -> None:
        """A telegram comes; it takes effect in `updateDiscreteStates`."""
        self._notified = any(values)
        self._values[self._ends[3] :] = NO_TIME

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        """The object's ``balise``, where a telegram came."""
        if self._notified:
            self._notified = False
            fields = [signal.name.removeprefix(f"{EVENT}_") for signal in self._groups[3]]
            telegram = dict(zip(fields, self._values[self._ends[3] :].tolist(), strict=True))
            telegram["stamp"] = telegram.pop("time")
            returned = self.model.balise(self._made, telegram)
            used = returned is not False
            self.counters = replace(
                self.counters, accepted=self.counters.accepted + used, ignored=self.counters.ignored + (not used)
            )
            self._take(None if isinstance(returned, bool) else returned, "balise")
        return False, False, False, False, False, 0.0

    def enterStepMode(self) -> None:
        """Nothing to do."""

    def getFMUState(self) -> Any:
        """A copy of the object, and of the values around it."""
        return self.model.save(self._made), self._values.copy(), self._time, self.counters

    def setFMUState(self, state: Any) -> None:
        """Go back to a copy."""
        held, values, self._time, self.counters = state
        self._made = self.model.restore(self._made, held)
        self._values[:] = values

    def freeFMUState(self, state: Any) -> None:
        """Nothing to do."""

    def _take(self, returned: Any, call: str) -> None:
        """The outputs after a call; those that a telegram's dict leaves out stay as they are."""
        place = slice(self._ends[1], self._ends[2])
        held = self._values[place] if call == "balise" else None
        self._values[place] = self.model.output_values(self._made, returned, call, held)

    # -- values -----------------------------------------------------------------------------------------------------

    def getFloat64(self, vr: Sequence[int], nValues: int | None = None) -> list[float]:
        """Values of variables."""
        return [float(self._values[reference - 1]) for reference in vr]

    def getBoolean(self, vr: Sequence[int], nValues: int | None = None) -> list[bool]:
        """Truth values of parameters."""
        return [bool(self._values[reference - 1]) for reference in vr]

    def setFloat64(self, vr: Sequence[int], values: Sequence[Any]) -> None:
        """Set inputs, parameters and fields of a telegram."""
        self._values[np.array(vr, dtype=np.intp) - 1] = values
        if any(self._ends[2] < reference <= self._ends[3] for reference in vr):
            self._stated = {
                signal.name: self.model.as_stated(signal, self._values[self._ends[2] :][self._parameters[signal.name]])
                for signal in self.model.parameter_signals
            }

    setBoolean = setFloat64

    def prepared_get(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that reads variables.

        Args:
            references: of the variables. values: to read them into, shape (len(references),).
        """
        places, held = np.array(references, dtype=np.intp) - 1, self._values

        def read() -> None:
            held.take(places, out=values, mode="clip")

        return read


class PythonComponent(FMI3Component):
    """The component.

    Args:
        name: in the scenario. model: the object's class, and its declarations. source: where it comes from.
    """

    def __init__(self, name: str, model: PythonModel, source: str) -> None:
        slave, self._model = _PythonSlave(model), model
        super().__init__(name, slave, slave.model_description, source=source, kind="block")

    def declare_missing(self, names: Sequence[str], where: str) -> None:
        """As for `Described`; the object may give NaN for these outputs."""
        super().declare_missing(names, where)
        self._model.declare_missing(names)


def _variable(signal: Signal, name: str, reference: int, model: PythonModel, clock: ModelVariable) -> ModelVariable:
    truth = model.kinds.get(signal.name) is bool
    start = signal.start_values[signal.scalar_names.index(name)]
    clocked = signal.variability == "discrete" and signal.causality == "input"
    return AnnotatedVariable(
        marks=[mark for mark in MARKS if getattr(signal, mark)],
        name=name,
        valueReference=reference,
        type="Boolean" if truth else "Float64",
        causality=signal.causality,
        variability=signal.variability,
        start=None if signal.causality == "output" else str(bool(start)).lower() if truth else repr(start),
        unit=None if signal.unit in (UNKNOWN_UNIT, "1") else signal.unit,
        clocks=[clock] if clocked else None,
    )


def _scalars(signals: Sequence[Signal], name: str) -> tuple[str, ...]:
    return next((signal.scalar_names for signal in signals if signal.name == name), ())

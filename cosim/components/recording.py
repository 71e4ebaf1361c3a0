"""A recording as a component: its columns are outputs, played back in time. Knows one recording.

It has the call surface of an FMI 3.0 slave, so that whoever steps components cannot tell it from a plant. What jumped
in the recording (two rows of the same time) is a time event: the step that ends there ends with the row before it,
Event Mode brings the row after it. So whoever listens gets the very inputs it had beside the plant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

from cosim.components.fmi3 import FMI3Component
from cosim.components.recording_data import Interpolation, Recording, make_recording, whole_number_columns
from cosim.errors import CosimError, CouplingError, ScenarioError
from cosim.results.load import load_result
from fmu_observer.annotated_variable import CAN_BE_MISSING, AnnotatedVariable

KIND = "recording"


class RecordingSlave:
    """A recording with the call surface of fmpy's `FMU3Slave`.

    Args:
        recording: what is played back.
    """

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.model_description = self.modelDescription = describe(recording)
        self.component = self
        self._values = np.zeros(len(recording.signals))
        self._time, self._before = 0.0, False

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self, **_: Any) -> None:
        """Nothing to do: everything is known."""

    def reset(self) -> None:
        """Nothing to do."""

    def enterInitializationMode(self, startTime: float = 0.0, stopTime: float | None = None, **_: Any) -> None:
        """Go to the start [s]; of an event there the row after it.

        Args:
            startTime: [s].
            stopTime: [s], without effect.
        """
        self._go(startTime, before=False)

    def exitInitializationMode(self) -> None:
        """Nothing to do."""

    def terminate(self) -> None:
        """Nothing to do."""

    def freeInstance(self) -> None:
        """Nothing to do."""

    def freeLibrary(self) -> None:
        """Nothing to do."""

    # -- time -------------------------------------------------------------------------------------------------------

    def doStep(self, t: float, h: float, *_: Any) -> tuple[bool, bool, bool, float]:
        """Go to `t` + `h` [s]; of an event there the row before it."""
        self._go(t + h, before=True)
        return False, False, False, t + h

    def enterEventMode(self) -> None:
        """The event happens in `updateDiscreteStates`."""

    def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
        """The row after the event, and when the next one is due."""
        changed, following = self._before, self.recording.next_event(self._time)
        self._go(self._time, before=False)
        return False, False, False, changed, bool(np.isfinite(following)), following

    def enterStepMode(self) -> None:
        """Nothing to do."""

    def getFMUState(self) -> tuple[float, bool]:
        """Where it stands."""
        return self._time, self._before

    def setFMUState(self, state: tuple[float, bool]) -> None:
        """Go there.

        Args:
            state: from `getFMUState`.
        """
        self._go(state[0], before=state[1])

    def freeFMUState(self, state: tuple[float, bool]) -> None:
        """Nothing to do.

        Args:
            state: from `getFMUState`.
        """

    def _go(self, t: float, *, before: bool) -> None:
        self._values[:] = self.recording.at(t, before=before)
        self._time, self._before = t, before

    # -- values -----------------------------------------------------------------------------------------------------

    def getFloat64(self, vr: Sequence[int], nValues: int | None = None) -> list[float]:
        """Values of columns.

        Args:
            vr: value references.
            nValues: without effect: columns are scalars.
        """
        return [float(self._values[reference - 1]) for reference in vr]

    def getInt32(self, vr: Sequence[int], nValues: int | None = None) -> list[int]:
        """Values of columns of whole numbers.

        Args:
            vr: value references.
            nValues: without effect: columns are scalars.
        """
        return [int(self._values[reference - 1]) for reference in vr]

    def prepared_get(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that reads columns into `values`.

        Args:
            references: value references.
        """
        places, held = np.array(references, dtype=np.intp) - 1, self._values

        def read() -> None:
            held.take(places, out=values, mode="clip")

        return read


class RecordingComponent(FMI3Component):
    """The component; columns with gaps are refused only where somebody asks for them.

    Args:
        name: in the scenario. recording: what it plays back.
    """

    def __init__(self, name: str, recording: Recording) -> None:
        slave = RecordingSlave(recording)
        self.recording = recording
        super().__init__(name, slave, slave.model_description, source=recording.source, kind=KIND)
        self.held_outputs = recording.held_over_steps

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """As for `Described`; a column that was left out is refused with the reason.

        Args:
            name: of a column.
            causalities: those that it may have; none for any.
        """
        if name in self.recording.left_out:
            raise CouplingError(f"{self.name}.{name} cannot be played back: {self.recording.left_out[name]}.")
        return super().variable(name, *causalities)


def describe(recording: Recording) -> ModelDescription:
    """The model description of a recording: one output for each column, nothing else."""
    whole = whole_number_columns(recording)
    outputs = [
        AnnotatedVariable(
            marks=[CAN_BE_MISSING] if signal.can_be_missing else [],
            name=signal.name,
            valueReference=i,
            type="Int32" if is_whole else "Float64",
            causality="output",
            variability="discrete" if is_whole else signal.variability,
            description=signal.description,
            unit=None if signal.unit == "1" else signal.unit,
            displayUnit=signal.display_unit,
        )
        for i, (signal, is_whole) in enumerate(zip(recording.signals, whole, strict=True), start=1)
    ]
    abilities = CoSimulation(
        modelIdentifier=KIND,
        canHandleVariableCommunicationStepSize=True,
        canGetAndSetFMUstate=True,
        hasEventMode=bool(len(recording.events)),
    )
    return ModelDescription(
        fmiVersion="3.0",
        modelName=Path(recording.source).name,
        instantiationToken=recording.digest,
        description="A recording",
        generationTool=KIND,
        coSimulation=abilities,
        modelVariables=outputs,
        outputs=[Unknown(variable=variable, dependencies=[]) for variable in outputs],
    )


def load_recording(
    path: Path,
    name: str,
    component: str | None,
    interpolation: Interpolation,
    span: tuple[float, float] | None,
    where: str,
    can_be_missing: Sequence[str] = (),
) -> Recording:
    """The recording of a results folder or table.

    Args:
        path: of it. name: of the component that plays it back. component: whose columns to take, see `make_recording`.
        interpolation: between the rows. span: start and stop of the run [s], or None. where: place for messages.
        can_be_missing: columns in which NaN stands for a missing value.

    Raises:
        ScenarioError: it cannot be read, or cannot be played back.
    """
    try:
        return make_recording(load_result(path), str(path), component, name, interpolation, span, can_be_missing)
    except ScenarioError as error:
        raise ScenarioError(f"{where}: {error}") from error
    except CosimError as error:
        raise ScenarioError(f"{where}: recording {path} cannot be read: {error}") from error

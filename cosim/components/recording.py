"""A recording as a component: its columns are outputs, played back in time. Knows one recording.

It has the call surface of an FMI 3.0 slave, so that to whoever steps components it is as a plant. What jumped
in the recording (two rows of the same time) is a time event: the step that ends there ends with the row before it,
Event Mode brings the row after it. So whoever listens gets the very inputs it had beside the plant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from cosim.components.description import description_of_outputs
from cosim.components.fmi3 import FMI3Component
from cosim.components.recording_data import Chosen, Recording, make_recording
from cosim.errors import CosimError, CouplingError, ScenarioError
from cosim.results.load_result import load_result
from cosim.results.read_once import read_once
from cosim.results.result import Result
from fmu_observer.annotated_variable import CAN_BE_MISSING, AnnotatedVariable
from fmus.fmi.standard import TIME_TOLERANCE

KIND = "recording"


class RecordingSlave:
    """A recording with the call surface of fmpy's `FMU3Slave`.

    Args:
        recording: what is played back.

    `values` are the columns where it stands, shape (n,), `stands` says where: the time [s], and 1 where it stands
    before an event of this time. The compiled stepper moves both as well.
    """

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.model_description = self.modelDescription = describe(recording)
        self.component = self
        self.values, self.stands = np.zeros(len(recording.signals)), np.zeros(2)

    # -- life -------------------------------------------------------------------------------------------------------

    def instantiate(self, **_: Any) -> None:
        """Nothing to do: everything is known."""

    def reset(self) -> None:
        """Nothing to do."""

    def enterInitializationMode(self, startTime: float = 0.0, stopTime: float | None = None, **_: Any) -> None:
        """Go to the start [s]; of an event there the row after it. What jumps when initialisation ends is what it was.

        Args:
            startTime: [s].
            stopTime: [s], without effect.
        """
        self._go(startTime, before=False)
        for place, signal in enumerate(self.recording.signals):
            self.values[place] = self.recording.before_start.get(signal.name, self.values[place])

    def exitInitializationMode(self) -> None:
        """The first row."""
        self._go(float(self.stands[0]), before=False)

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
        time, changed = self.getFMUState()
        following = self.recording.next_event(time)
        self._go(time, before=False)
        return False, False, False, changed, bool(np.isfinite(following)), following

    def enterStepMode(self) -> None:
        """Nothing to do."""

    def getFMUState(self) -> tuple[float, bool]:
        """Where it stands."""
        return float(self.stands[0]), bool(self.stands[1])

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
        self.values[:] = self.recording.at(t, before=before)
        self.stands[:] = t, before

    # -- values -----------------------------------------------------------------------------------------------------

    def getFloat64(self, vr: Sequence[int], nValues: int | None = None) -> list[float]:
        """Values of columns.

        Args:
            vr: value references.
            nValues: without effect: columns are scalars.
        """
        return [float(self.values[reference - 1]) for reference in vr]

    def getInt32(self, vr: Sequence[int], nValues: int | None = None) -> list[int]:
        """Values of columns of whole numbers.

        Args:
            vr: value references.
            nValues: without effect: columns are scalars.
        """
        return [int(self.values[reference - 1]) for reference in vr]

    def prepared_get(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call that reads columns into `values`.

        Args:
            references: value references.
        """
        places, held = np.array(references, dtype=np.intp) - 1, self.values

        def read() -> None:
            held.take(places, out=values, mode="clip")

        return read


@dataclass(frozen=True)
class ColumnCourse:
    """Some columns as functions of time, wherever the component stands; it ends with the last row.

    Args:
        recording: what is played back. places: of the columns, shape (m,).
    """

    recording: Recording
    places: np.ndarray

    def at(self, t: float, *, before: bool) -> np.ndarray:
        """Values at `t` [s], shape (m,).

        Args:
            before: of several rows of this time the first one instead of the last one.
        """
        return np.asarray(self.recording.at(min(t, self._end), before=before)[self.places])

    def mean(self, t: float, until: float) -> np.ndarray:
        """Means from `t` to `until` [s], shape (m,)."""
        if until > self._end or until - t <= 2.0 * TIME_TOLERANCE:
            return np.asarray(0.5 * (self.at(t, before=False) + self.at(until, before=True)))
        return np.asarray(self.recording.mean(t, until)[self.places])

    @property
    def _end(self) -> float:
        return float(self.recording.time[-1])


class RecordingComponent(FMI3Component):
    """The component; columns with gaps are refused only where somebody asks for them.

    Args:
        name: in the scenario. recording: what it plays back.
    """

    def __init__(self, name: str, recording: Recording) -> None:
        self.recording = recording
        slave = RecordingSlave(recording)
        super().__init__(name, slave, slave.model_description, source=recording.source, kind=KIND)
        self._player = slave
        self._take(recording)

    def _take(self, recording: Recording) -> None:
        self.recording = self._player.recording = recording
        self.held_outputs, self.line_outputs = recording.held_over_steps, recording.lines

    def connected(self, name: str, *, flows: bool, target: str) -> None:
        """A column is connected: where nobody said whether it is held, its targets do.

        Args:
            name: of the column. flows: whether the target is continuous. target: its name, for messages.

        Raises:
            CouplingError: it is said to run on lines, and the target takes no lines.
        """
        if flows or name not in self.recording.lines:
            return
        if name in self.recording.chosen:
            raise CouplingError(
                f"{self.name}.{name} is said to run on lines (interpolation 'linear'), and {target} is discrete: it "
                f"keeps its value from row to row. Set interpolation to 'hold' for {name!r}, or leave it out."
            )
        self._take(self.recording.kept(name))
        self.variables[name].variability = "discrete"

    def known_values(self, name: str) -> list[tuple[float, str]] | None:
        """Every value of a column, with the row of the table in which it first stands.

        Args:
            name: of the column.
        """
        values, rows = np.unique(self.recording.values[:, self._place(name)], return_index=True)
        first, time = self.recording.first_row, self.recording.time
        return [(float(values[i]), f"row {first + rows[i] + 1} (t = {time[rows[i]]:.6g} s)") for i in np.argsort(rows)]

    def texts(self, name: str) -> Sequence[str]:
        """The texts that the numbers of a column stand for, 1 for the first; none of a column of numbers.

        Args:
            name: of the column.
        """
        return self.recording.texts.get(name, ())

    def _place(self, name: str) -> int:
        return [signal.name for signal in self.recording.signals].index(name)

    def course_of(self, name: str, *, sampled: bool) -> bool:
        """Whether an input follows a column wherever the component stands.

        Args:
            name: of the column. sampled: whether the input is read at the end of a step alone: of a table also a held
                column is known there.
        """
        return name in self.line_outputs or (sampled and name in self.held_outputs and not self.recording.of_run)

    def course(self, names: Sequence[str]) -> ColumnCourse:
        """How columns run within a step.

        Args:
            names: of the columns.
        """
        places = np.array([self._place(name) for name in names], dtype=np.intp)
        return ColumnCourse(self.recording, places)

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """As for `Described`; a column that was left out is refused with the reason."""
        if name in self.recording.left_out:
            raise CouplingError(f"{self.name}.{name} cannot be played back: {self.recording.left_out[name]}.")
        return super().variable(name, *causalities)


def describe(recording: Recording) -> ModelDescription:
    """The model description of a recording: one output for each column, nothing else."""
    whole = _whole_number_columns(recording)
    outputs = [
        AnnotatedVariable(
            marks=[CAN_BE_MISSING] if signal.can_be_missing else [],
            name=signal.name,
            valueReference=i,
            type="Int32" if is_whole else "Float64",
            causality="output",
            variability="discrete" if is_whole or held else signal.variability,
            description=signal.description or _listed(recording.texts.get(signal.name, ())),
            unit=None if signal.unit == "1" else signal.unit,
            displayUnit=signal.display_unit,
        )
        for i, (signal, is_whole, held) in enumerate(zip(recording.signals, whole, recording.held, strict=True), 1)
    ]
    return description_of_outputs(
        Path(recording.source).name,
        recording.digest,
        "A recording",
        outputs,
        modelIdentifier=KIND,
        canHandleVariableCommunicationStepSize=True,
        canGetAndSetFMUstate=True,
        hasEventMode=bool(len(recording.events)),
    )


def load_recording(
    path: Path,
    name: str,
    component: str | None,
    interpolation: Chosen,
    span: tuple[float, float] | None,
    where: str,
    can_be_missing: Sequence[str] = (),
) -> Recording:
    """The recording of a results folder or table.

    Args:
        path: of it. name: of the component that plays it back. component: whose columns to take, see `make_recording`.
        interpolation: whether columns are held or run on lines. span: start and stop of the run [s], or None.
        where: place for messages. can_be_missing: columns in which NaN stands for a missing value.

    Raises:
        ScenarioError: it cannot be read, or cannot be played back.
    """
    try:
        return make_recording(
            read_once(_load_with_texts, path), str(path), component, name, interpolation, span, can_be_missing
        )
    except ScenarioError as error:
        raise ScenarioError(f"{where}: {error}") from error
    except CosimError as error:
        raise ScenarioError(f"{where}: recording {path} cannot be read: {error}") from error


def _listed(texts: Sequence[str]) -> str:
    return ", ".join(f"{number} {text}" for number, text in enumerate(texts, 1))


def _load_with_texts(path: Path) -> Result:
    return load_result(path, texts=True)


def _whole_number_columns(recording: Recording) -> Sequence[bool]:
    """For each column whether it is a discrete pure number that was whole throughout: a mode, a count, a truth
    value.
    """
    largest = 2.0**31 - 1.0
    return [
        s.variability == "discrete"
        and s.unit == "1"
        and bool(np.all((column == np.rint(column)) & (np.abs(column) <= largest)))
        for s, column in zip(recording.signals, recording.values.T, strict=True)
    ]

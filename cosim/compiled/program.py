"""The program of the stepper: the plan as the C structures of ``stepper.h``, over the functions of the loaded FMUs and
of recordings.

Everything a structure points to is kept alive here. Knows no balise service and no master.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Any

import numpy as np

from cosim.compiled.journal import StepperCall, StepperJournal
from cosim.compiled.recorded_returns import RecordedReturn
from cosim.compiled.recordings import FollowedInputs, NativeRecording
from cosim.compiled.structures import CPlantMonitor, CPort, CProgram, CSlave
from cosim.compiled.turns import reason_for_python
from cosim.components.component import Component
from cosim.components.recording import RecordingSlave
from cosim.components.recording_data import Recording
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.errors import CosimError
from cosim.master.axis import TimeAxis
from cosim.master.interpolation.interpolators import MeanInterpolator
from cosim.process.last_call import LAST_CALL
from fmus.exchange.slave import solver_of
from fmus.fmi.call_warnings import CONTRADICTIONS
from fmus.fmi.elements import Element
from fmus.fmi.types import CTYPES, c_type, getter_type, size

FMI3 = 3
EQUAL_TO = {"Real": "Float64", "Integer": "Int32"}
KINDS = (*(kind for kind in CTYPES if kind not in EQUAL_TO), "Boolean8", "Boolean32")  # the order of ``stepper.h``


class Stop(IntEnum):
    """Why a chunk ended, as in ``stepper.h``."""

    DONE = 0
    TIME = 1
    NEAR = 2
    REFUSED = 3
    WRITE = 4
    STEP = 5
    READ = 6
    CROSSED = 7
    NOT_FINITE = 8
    SENT = 9  # in Python only: the inputs were sent, and no more was to be done
    ARRIVE = 10
    HANDED = 11
    TURN = 12
    EVENTS = 13


class NotCompilable(CosimError):  # noqa: N818 - no error unless somebody demanded the compiled stepper
    """A plan that the compiled stepper cannot execute; the message says why."""


class Program:
    """The plan in C.

    Args:
        plan: prepared; components instantiated, and not to be instantiated anew.
        axis: communication points. library: the stepper, which plays recordings back itself.

    Attributes `head` and `slaves` are the structures; `writes` and `reads` the names of the functions of each slave's
    ports; `in_python` says of the components that Python moves why, by their places in the plan.

    Raises:
        NotCompilable: Python must move all of them; why.
    """

    def __init__(self, plan: Plan, axis: TimeAxis, library: Any) -> None:
        self.plan = plan
        self._recordings = {
            step.component.name: NativeRecording(step.component.slave, library)
            for step in plan.steps
            if isinstance(step.component.slave, RecordingSlave)
        }
        self._followed: dict[str, FollowedInputs] = {}
        self.in_python: dict[int, str] = {}
        self._kept: list[Any] = []
        self.writes: list[list[str]] = []
        self.reads: list[list[str]] = []
        self.slaves = (CSlave * len(plan.steps))(*(self._member(i, step) for i, step in enumerate(plan.steps)))
        if len(self.in_python) == len(plan.steps):
            raise NotCompilable(next(iter(self.in_python.values()), "there are no components"))
        self.head = CProgram(start=axis.start, step=axis.step, step_count=axis.count)
        self.head.values, self.head.value_count = plan.values.ctypes.data, len(plan.values)
        self.head.slaves, self.head.slave_count = ctypes.addressof(self.slaves), len(plan.steps)
        self.head.watch.slave = -1
        if plan.can_be_missing.any():
            self.head.can_be_missing = self.keep(plan.can_be_missing.astype(np.uint8))
        self.head.last_call = LAST_CALL.address
        self.head.last_time = LAST_CALL.address + 8
        self._nobody_reads = ctypes.c_int64()
        self.count_rows_at(None, 0)
        self._versions = [step.component.fmi_version for step in plan.steps]
        calls = [len(writes) + len(reads) + 1 for writes, reads in zip(self.writes, self.reads, strict=True)]
        self.journal = StepperJournal(
            self.head.journal, sum(calls), sum(int(r.raw_bytes) for s in self.slaves for r in _ports_read(s))
        )

    def count_rows_at(self, place: int | None, before: int) -> None:
        """Have the stepper count the rows it fills.

        Args:
            place: address of the count; None where nobody reads it. before: rows that are filled already.
        """
        self.head.rows_reported = ctypes.addressof(self._nobody_reads) if place is None else place
        self.head.rows_before = before

    def watch(
        self, slave: int, position: int, speed: int, units: tuple[float, ...], places: np.ndarray, limit: float
    ) -> None:
        """Have the stepper leave steps in which a balise may be passed.

        Args:
            slave: place of the plant in the plan. position, speed: columns.
            units: factor and offset of each, to [m] and [m/s].
            places: of the balises [m], increasing. limit: acceleration [m/s2].
        """
        columns = self.plan.steps[slave].columns
        self.head.watch = CPlantMonitor(
            slave=slave,
            first_output=columns.start,
            output_count=columns.stop - columns.start,
            position=position,
            speed=speed,
            position_factor=units[0],
            position_offset=units[1],
            speed_factor=units[2],
            speed_offset=units[3],
            acceleration_limit=limit,
            places=self.keep(np.ascontiguousarray(places, dtype=np.float64)),
            place_count=len(places),
            cursor=0,
        )

    @property
    def address(self) -> int:
        """Where the program is."""
        return ctypes.addressof(self.head)

    def reads_straight(self, which: int) -> bool:
        """Whether the outputs of an FMI 3 slave are read by one call, as doubles, into their place.

        Args:
            which: number of the component.
        """
        reads = ctypes.cast(self.slaves[which].reads, ctypes.POINTER(CPort))
        return self.reads[which] == ["fmi3GetFloat64"] and reads[0].places is None

    def said(self, which: int, stop: Stop) -> dict[str, list[RecordedReturn]]:
        """What a slave has said in a move that ended with `stop`, by function; `which`: its place in the plan."""
        head, writes, reads = self.head, self.writes[which], self.reads[which]
        if stop is Stop.REFUSED:
            return {}
        if stop is Stop.WRITE:
            return {name: [RecordedReturn()] for name in writes[: head.port]} | {
                writes[head.port]: [RecordedReturn(head.status)]
            }
        said = {name: [RecordedReturn()] for name in writes}
        if stop is Stop.SENT:
            return said
        version = self.plan.steps[which].component.fmi_version
        results: tuple[Any, ...] = (False, False, False, math.inf)  # arrived, as it did
        if stop is Stop.STEP or head.early:
            results = bool(head.event), bool(head.terminate), bool(head.early), float(head.reached)
        early = [RecordedReturn(0, (False, False, True, reached)) for reached in head.returns[: head.return_count]]
        last = RecordedReturn(head.status if stop is Stop.STEP else 0, results if version == FMI3 else ())
        said[f"fmi{version}DoStep"] = [*early, last]
        if stop is Stop.READ:
            said[reads[head.port]] = [RecordedReturn(head.status)]
        return said

    def hand_over_warnings(self, which: int, component: Component) -> None:
        """Add the warnings and contradictions of a slave that were counted here to those of its component.

        Args:
            which: its place in the plan. component: whose slave it is.
        """
        slave, version = self.slaves[which], component.fmi_version
        for call in StepperCall:
            if slave.warnings[call]:
                ports = {StepperCall.SET: self.writes, StepperCall.GET: self.reads}.get(call, [])
                name = call.function(version) or " or ".join(ports[which])
                component.call_warnings.add(name, float(slave.first_warnings[call]), int(slave.warnings[call]))
                slave.warnings[call] = 0
        for place, text in enumerate(CONTRADICTIONS):
            if slave.contradictions[place]:
                first = float(slave.first_contradictions[place])
                component.contradictions.add(text, first, int(slave.contradictions[place]))
                slave.contradictions[place] = 0

    def journalled(self) -> dict[int, dict[str, list[RecordedReturn]]]:
        """What slaves have said since the journal was begun: by place in the plan, then by function, in order."""
        said: dict[int, dict[str, list[RecordedReturn]]] = {}
        for place, call, port, response in self.journal.read(self._versions):
            name = call.function(self._versions[place])
            name = (
                {StepperCall.SET: self.writes, StepperCall.GET: self.reads}[call][place][port] if name is None else name
            )
            said.setdefault(place, {}).setdefault(name, []).append(response)
        return said

    # -- slaves -----------------------------------------------------------------------------------------------------

    def _member(self, place: int, step: PlannedComponent) -> CSlave:
        """A component as the stepper knows it, which may be that Python moves it."""
        reason = reason_for_python(step, self.plan)
        try:
            made = self._slave(step) if reason is None else None
        except NotCompilable as error:
            made, reason = None, str(error)
        if made is None:
            made = CSlave(in_python=1)
            made.no_way_back = ctypes.addressof(step.component.no_way_back)
            made.left_at = ctypes.addressof(step.component.left_at)
            self.in_python[place] = str(reason)
            self.writes.append([])
            self.reads.append([])
        made.every, made.special = step.every, made.in_python or step.every != 1
        return made

    def _slave(self, step: PlannedComponent) -> CSlave:
        component, inputs = step.component, step.inputs
        instance = self._instance(component)
        outputs = [s.name.removeprefix(f"{component.name}.") for s in self.plan.signals[step.columns]]
        made = CSlave(instance=instance, fmi_version=component.fmi_version)
        made.do_step, made.stepped = self._called(component, f"fmi{component.fmi_version}DoStep")
        made.no_way_back, made.left_at = ctypes.addressof(component.no_way_back), ctypes.addressof(component.left_at)
        made.numbers = LAST_CALL.numbers(component.name)
        made.returns_early = component.capabilities.mightReturnEarlyFromDoStep
        made.usual_step, made.rounding = component.usual_step, component.rounding
        made.heeds_events = bool(getattr(component, "has_event_mode", False))
        sent = [(int(place), inputs.names[place]) for place in inputs.passing]
        writes, setters = self._ports(component, "Set", sent, inputs.buffer)
        reads, getters = self._ports(component, "Get", list(enumerate(outputs)), step.outputs)
        made.writes, made.write_count = ctypes.addressof(writes), len(writes)
        made.reads, made.read_count = ctypes.addressof(reads), len(reads)
        made.input_count, made.sources = len(inputs), self.keep(inputs.places.astype(np.int64))
        if np.any(inputs.factors != 1.0) or np.any(inputs.offsets != 0.0):
            made.factors, made.offsets = self.keep(inputs.factors), self.keep(inputs.offsets)
        made.inputs = self.keep(inputs.buffer)
        if isinstance(step.interpolator, MeanInterpolator):
            self._followed[component.name] = FollowedInputs(step.interpolator, inputs, self._native_of)
            made.followed = self._followed[component.name].address
        self.writes.append(setters)
        self.reads.append(getters)
        return made

    def _native_of(self, recording: Recording) -> int:
        """Address of a recording of the plan."""
        return next(native.address for native in self._recordings.values() if native.recording is recording)

    def _instance(self, component: Component) -> int:
        """Address of the instance in C."""
        if component.name in self._recordings:
            return self._recordings[component.name].address
        return _address_of(component.slave.component)

    def _ports(
        self, component: Component, verb: str, names: Sequence[tuple[int, str]], values: np.ndarray
    ) -> tuple[ctypes.Array[CPort], list[str]]:
        groups: dict[str, list[tuple[int, Element]]] = {}
        for place, name in names:
            element = component.variables.element(name)
            if element.variable.name in component.negated:
                raise NotCompilable(f"{component.name}.{name} is an alias with the other sign")
            groups.setdefault(getter_type(element.variable.type, component.fmi_version), []).append((place, element))
        ports = [self._port(component, verb, kind, members, values) for kind, members in groups.items()]
        array = (CPort * len(ports))(*ports)
        self._kept.append(array)
        return array, [f"fmi{component.fmi_version}{verb}{kind}" for kind in groups]

    def _port(
        self, component: Component, verb: str, kind: str, members: Sequence[tuple[int, Element]], values: np.ndarray
    ) -> CPort:
        version = component.fmi_version
        word = f"Boolean{32 if version == 2 else 8}" if kind == "Boolean" else EQUAL_TO.get(kind, kind)
        first, total = _first_values([element for _, element in members])
        if verb == "Set" and total != len(members):
            raise NotCompilable(f"some elements of an array of {component.name} have a source and others have none")
        places = [place for place, _ in members]
        elements = [first[element.variable.name] + (element.index or 0) for _, element in members]
        port = CPort(reference_count=len(first), raw_count=total, count=len(members), kind=KINDS.index(word))
        port.raw_bytes = total * np.dtype(c_type(kind, version)[2]).itemsize
        references = np.array([component.variables[n].valueReference for n in first], dtype=np.uint32)
        port.references, port.values = self.keep(references), self.keep(values)
        port.function, port.instance = self._called(component, f"fmi{version}{verb}{kind}", references.tobytes())
        if word == "Float64" and elements == list(range(total)) and places == list(range(places[0], places[0] + total)):
            port.raw = self.keep(values[places[0] :])
            return port
        port.places, port.elements = (self.keep(np.array(numbers, dtype=np.int64)) for numbers in (places, elements))
        port.raw = self.keep(np.zeros(total, dtype=c_type(kind, version)[2]))
        return port

    def _called(self, component: Component, name: str, references: bytes = b"") -> tuple[int, int]:
        """Address of a function, and what it takes in place of the instance."""
        solver = solver_of(component.slave)
        native = None if solver is None else solver.native(name, references)
        return native or (self.function(component, name), self._instance(component))

    def function(self, component: Component, name: str) -> int:
        """Address of a function of the component's library.

        Args:
            name: of a C function.
        """
        if component.name in self._recordings:
            return self._recordings[component.name].function(name)
        return _address_of(component.slave._functions[name])

    def keep(self, array: np.ndarray) -> int:
        """Address of an array, which is kept alive."""
        self._kept.append(array)
        return int(array.ctypes.data)


def _ports_read(slave: CSlave) -> list[CPort]:
    return list(ctypes.cast(slave.reads, ctypes.POINTER(CPort))[: slave.read_count])


def _first_values(elements: Sequence[Element]) -> tuple[dict[str, int], int]:
    """Where the values of each whole variable begin when they are read in order of first use, and how many there
    are.
    """
    first: dict[str, int] = {}
    total = 0
    for element in elements:
        if element.variable.name not in first:
            first[element.variable.name] = total
            total += size(element.variable)
    return first, total


def _address_of(pointer: Any) -> int:
    """The address of a function or an instance, however ctypes holds it."""
    return int(pointer if isinstance(pointer, int) else ctypes.cast(pointer, ctypes.c_void_p).value or 0)

"""Turns: components that Python moves while the stepper does the others, and why; rates of their own.

The stepper calls back where it is the turn of such a component, with whatever it has done so far in the values of the
plan. Knows no balise service: a component that is notified of something in a step is moved in Python anyway.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from time import perf_counter

from cosim.compiled.recordings import follows_recordings
from cosim.compiled.structures import CProgram
from cosim.components.component import Component
from cosim.components.recording import RecordingSlave
from cosim.coupling.chain import Position
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent, PlannedInterpolator
from cosim.master.axis import TimeAxis
from cosim.master.interpolation.interpolators import InputInterpolator
from fmus.fmi.ports import is_native

_KNOWN_STAGES = frozenset({Position.RATE, Position.EVENTS, Position.BALISES, Position.COMPILED})
_Turn = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_double)


def reason_for_python(step: PlannedComponent, plan: Plan) -> str | None:
    """Why Python must move a component, in words; None where the stepper can.

    Args:
        step: of the plan. plan: prepared, services and rates in place.
    """
    return next(_reasons(step, plan), None)


def _reasons(step: PlannedComponent, plan: Plan) -> Iterator[str]:
    name, texts = step.component.name, step.inputs.non_numeric
    yield from _reasons_of_slave(step.component)
    if any(stage.position not in _KNOWN_STAGES for stage in step.stages):
        yield f"{name} is moved by something in Python"
    if texts is not None:
        yield f"inputs of {name} are no doubles: {', '.join(texts.names)}"
    if any(c.exact and c.source[0] == name for c in plan.connections):
        yield f"outputs of {name} that are no doubles are passed on"
    if step.inputs.tables:
        yield f"inputs of {name} are mapped by tables of values"
    if step.interpolator is not None and not follows_recordings(step.interpolator):
        yield f"inputs of {name} follow lines between communication points"
    if step.substeps != 1:
        yield f"{name} takes {step.substeps} steps for one"


def _reasons_of_slave(component: Component) -> Iterator[str]:
    slave, name = component.slave, component.name
    if isinstance(slave, RecordingSlave):  # which the stepper plays back itself
        return
    if component.kind != "FMU" or not is_native(slave) or not hasattr(slave, "_functions"):
        yield f"{name} runs in Python ({component.kind})"
    elif slave.fmiCallLogger is not None:
        yield f"the calls of {name} are logged"
    elif getattr(getattr(component, "_intermediate", None), "requested", False):
        yield f"{name} is given inputs during its steps"


def stands(step: PlannedComponent, axis: TimeAxis, k: int) -> float:
    """Where a component stands when the run is at communication point `k` [s]: at its own rate, the end of its last
    step.

    Args:
        step: of the plan. axis: communication points. k: number of the point.
    """
    return axis[k if k == axis.count else k - k % step.every]


class Turns:
    """Components of a plan that Python moves.

    Args:
        head: the program. plan: prepared. axis: communication points.
        places: theirs in the plan. at_once: everybody is prepared before anybody moves (Jacobi).

    `failure` is what the last turn raised, `seconds` were spent in all of them.
    """

    def __init__(self, head: CProgram, plan: Plan, axis: TimeAxis, places: Sequence[int], *, at_once: bool) -> None:
        self._plan, self._axis, self._at_once = plan, axis, at_once
        self._steps = plan.steps
        self._interpolators = {place: self._sources(plan.steps[place].interpolator) for place in places}
        self._copies = len(plan.non_numeric) > 0
        self._begun = -1
        self.failure: BaseException | None = None
        self.seconds = 0.0
        self._call = _Turn(self._take)  # kept alive: the program knows its address only
        if places:
            head.turn = ctypes.cast(self._call, ctypes.c_void_p).value

    def raise_failure(self) -> None:
        """Raise what the last turn raised, if anything."""
        failure, self.failure = self.failure, None
        if failure is not None:
            raise failure

    def _take(self, place: int, t: float, until: float) -> int:
        """Move the component at `place` from `t` to `until` [s]; 0 where the step is Python's from here on."""
        begin = perf_counter()
        step = self._steps[place]
        try:
            if self._copies or self._interpolators[place]:
                self._begin(place, until)
            step.prepare(t, until)
            step.drive(t, until)
            return not step.component.terminated
        except BaseException as error:  # it would be lost in the stepper, an interrupt too
            self.failure = error
            return 0
        finally:
            self.seconds += perf_counter() - begin

    def _begin(self, place: int, until: float) -> None:
        """What else begins with a step, when the first one who needs it has its turn."""
        k = round((until - self._axis.start) / self._axis.step)
        if self._copies and self._begun != k:
            self._begun = k
            self._plan.non_numeric_start[:] = self._plan.non_numeric
        interpolator, sources = self._steps[place].interpolator, self._interpolators[place]
        if interpolator is None:
            return
        for source in sources:  # the stepper notes where components stand when it is done
            self._steps[source].component.time = stands(self._steps[source], self._axis, k - 1)
        interpolator.begin()
        for source in () if self._at_once else sources:
            if source < place:
                self._steps[source].component.time = stands(self._steps[source], self._axis, k)

    def _sources(self, interpolator: PlannedInterpolator | None) -> list[int]:
        """Places in the plan of the components that give the lines of an interpolator."""
        if not isinstance(interpolator, InputInterpolator):
            return []
        return [
            i for i, step in enumerate(self._plan.steps) if any(step.component is c for c in interpolator.hold.sources)
        ]

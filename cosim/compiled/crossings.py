"""Crossings: steps over a balise that the stepper does by itself, where everything about them is ordinary.

The plant is localised by rollback, or a recording with its telegrams, and everybody is notified at once: such a step
ends with a record of the crossing, which Python makes into a telegram when the chunk is over. Knows no master.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from cosim.balises.delivery import OUTCOMES
from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localiser import ACCELERATION_LIMIT
from cosim.balises.recorded import RecordedLocaliser, recorded_crossing
from cosim.balises.rollback import RollbackLocaliser
from cosim.balises.service import BaliseService
from cosim.balises.telegram import Crossing
from cosim.compiled.journal import StepperCall
from cosim.compiled.notifying import CompiledDelivery
from cosim.compiled.program import Program
from cosim.compiled.structures import CPassed
from cosim.components.recording import RecordingComponent
from cosim.coupling.plan import Plan
from cosim.master.axis import TimeAxis
from cosim.results.result import BaliseRecord
from fmus.fmi.standard import NEVER, TIME_TOLERANCE

AT_MOST = 256
"""Crossings in one chunk."""

WORDS = (*OUTCOMES, "notified")
"""By rank; the last one stands for an outcome that is not known."""


class Crossings:
    """What the stepper needs for steps over balises.

    Args:
        program: the plan in C. plan: prepared. axis: communication points. service: of the run.
        deliveries: of the receivers that can be notified by the stepper, by place in the plan.
    """

    def __init__(
        self,
        program: Program,
        plan: Plan,
        axis: TimeAxis,
        service: BaliseService,
        deliveries: dict[int, CompiledDelivery],
    ) -> None:
        assert isinstance(service.localiser, RollbackLocaliser | RecordedLocaliser)
        self.service, self.localiser, self._head = service, service.localiser, program.head.balises
        self._deliveries, self._slaves, self._delivered = deliveries, len(plan.steps), 0
        self._places = {delivery.component.name: place for place, delivery in sorted(deliveries.items())}
        self._possible = set(self._places) == {r.planned.component.name for r in service.receivers} and self._is_plain()
        self._ordinary = np.zeros(0, dtype=bool)
        self.recorded = isinstance(self.localiser, RecordedLocaliser)
        if isinstance(self.localiser, RecordedLocaliser):
            self._ordinary = _are_ordinary(self.localiser.records, axis) & self._possible
        self._prepare(program, plan)

    @property
    def idle_until(self) -> float:
        """Up to here [s] no recorded telegram is due but those that the stepper delivers; where there are `recorded`
        ones.
        """
        assert isinstance(self.localiser, RecordedLocaliser)
        ahead = np.flatnonzero(~self._ordinary[self.localiser.next :])
        return self.localiser.records[self.localiser.next + int(ahead[0])].stamp if len(ahead) else NEVER

    def allow(self, wanted: bool) -> bool:
        """Whether the coming chunk may hold such steps; to be asked before each.

        Args:
            wanted: whether crossings may be handled in C.
        """
        idle = wanted and self._possible and self.service.has_nothing_found
        idle = idle and all(delivery.component.next_event == NEVER for delivery in self._deliveries.values())
        self._head.on = idle
        if idle:
            for delivery in self._deliveries.values():
                delivery.begin()
        return idle

    def collect(self) -> None:
        """Log what was passed in the chunk."""
        count = int(self._head.passed_count)
        if not count:
            return
        for i, passed in enumerate(self._passed[:count]):
            first = i * self._slaves
            outcomes = {name: WORDS[self._outcomes[first + place]] for name, place in self._places.items()}
            self.service.delivered_elsewhere(self._crossing(passed), passed.reading, outcomes)
        for delivery in self._deliveries.values():
            delivery.end()
        self._head.passed_count = 0
        self._delivered += count

    def _crossing(self, passed: CPassed) -> Crossing:
        """The crossing that the stepper noted."""
        if isinstance(self.localiser, RecordedLocaliser):
            self.localiser.next += 1
            return recorded_crossing(self.localiser.records[self.localiser.next - 1])
        layout = self.localiser.layout
        balise = layout.balises[passed.which] if isinstance(layout, TrackLayout) else None
        return self.localiser.crossing(passed.stamp, balise, passed.position, passed.speed)

    def close(self) -> None:
        """Add events and states to the counters of the components; they are timed with the steps that they belong
        to.
        """
        for delivery in self._deliveries.values():
            # a step to the telegram and one from there on: inputs and outputs once more
            for kind in ("event", "get", "set"):
                delivery.component.call_statistics[kind].add(0.0, self._delivered)
        plant = self.localiser.watch.component.call_statistics
        for kind, count in (
            ("save", self._delivered),
            ("restore", self._plant.more_calls),
            ("release", self._delivered),
        ):
            plant[kind].add(0.0, int(count))  # each step of the plant beyond the first begins with its state restored
        self._delivered = 0

    # -- set-up -----------------------------------------------------------------------------------------------------

    def _is_plain(self) -> bool:
        """Whether every telegram is delivered at once and as it is, and the plant is a plain one."""
        channel, layout, plant = self.service.channel, self.localiser.layout, self.localiser.watch.component
        if isinstance(self.localiser, RecordedLocaliser):
            return isinstance(plant, RecordingComponent)
        if self.localiser.method != "rollback":
            return False
        changed = channel.missed_fraction or channel.missed or channel.latency or channel.latency_jitter
        if channel.position_noise and isinstance(layout, TrackLayout):
            changed = changed or any(balise.location_accuracy for balise in layout.balises)
        return not changed and plant.fmi_version in (2, 3) and plant.can_save and not getattr(plant, "clocks", False)

    def _instants(self, layout: InstantLayout, program: Program) -> np.ndarray:
        """Instants of the balises that the stepper handles [s]; of recorded ones it also knows what they said."""
        if not isinstance(self.localiser, RecordedLocaliser):
            return layout.instants.astype(np.float64)
        known = [r for r, ordinary in zip(self.localiser.records, self._ordinary, strict=True) if ordinary]
        said = np.array([(r.position, r.location_accuracy, r.odometer_reading) for r in known], dtype=np.float64)
        self._head.recorded = program.keep(np.ascontiguousarray(said.reshape(-1, 3)))
        return np.array([r.stamp for r in known], dtype=np.float64)

    def _prepare(self, program: Program, plan: Plan) -> None:
        watch, layout, head, keep = self.localiser.watch, self.localiser.layout, self._head, program.keep
        place = [step.component.name for step in plan.steps].index(self.service.plant)
        first = plan.steps[place].columns.start
        columns = first + watch.position_column, first + watch.speed_column
        places = layout.positions if isinstance(layout, TrackLayout) else np.zeros(0)
        self._plant = program.slaves[place]
        program.watch(place, *columns, (*watch.to_metres, *watch.to_speed), places, ACCELERATION_LIMIT)
        if isinstance(layout, InstantLayout):
            instants = self._instants(layout, program)
            head.by_instant, head.instant_count, head.instants = True, len(instants), keep(instants)
        else:
            head.accuracies = keep(np.array([balise.location_accuracy for balise in layout.balises]))
        if self._possible:
            for name, call in (
                ("save_state", StepperCall.SAVE),
                ("restore_state", StepperCall.RESTORE),
                ("release_state", StepperCall.RELEASE),
            ):
                setattr(head, name, program.function(watch.component, str(call.function(watch.component.fmi_version))))
        head.odometer = -1 if self.service.odometer is None else self.service.odometer
        head.continuous = keep(plan.continuous.astype(np.uint8))
        by_place = [self._deliveries.get(i) for i in range(self._slaves)]
        self._telegrams = (ctypes.c_void_p * self._slaves)(
            *(None if t is None else ctypes.addressof(t.telegram) for t in by_place)
        )
        head.telegrams = ctypes.addressof(self._telegrams)
        for name in ("start", "final", "there", "arrived"):
            setattr(head, name, keep(np.zeros(len(plan.values))))
        self._passed, self._outcomes = (CPassed * AT_MOST)(), (ctypes.c_int64 * (AT_MOST * self._slaves))()
        head.passed, head.passed_limit = ctypes.cast(self._passed, ctypes.POINTER(CPassed)), AT_MOST
        head.outcomes = ctypes.cast(self._outcomes, ctypes.POINTER(ctypes.c_int64))


def _are_ordinary(records: Sequence[BaliseRecord], axis: TimeAxis) -> np.ndarray:
    """Mask of the recorded telegrams that are alone at their stamps, within a step, and were delivered there at once.

    Args:
        records: in order of their stamps.
    """
    stamps = np.array([record.stamp for record in records], dtype=float)
    apart = np.diff(stamps) > 2.0 * TIME_TOLERANCE
    alone = np.append(True, apart) & np.append(apart, True) if len(stamps) else np.zeros(0, dtype=bool)
    points = np.rint((stamps - axis.start) / axis.step)
    within = np.abs(stamps - (axis.start + points * axis.step)) > 2.0 * TIME_TOLERANCE
    at_once = np.array([r.kind == "true" and r.delivered_at == r.stamp for r in records], dtype=bool)
    return np.asarray(alone & within & (stamps > axis.start) & at_once)

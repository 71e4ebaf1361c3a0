"""An exchange of inputs and outputs between all components at one instant, in Initialization Mode and after it."""

from __future__ import annotations

import numpy as np

from cosim.coupling.feedthrough import declared_feedthrough
from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.diagnostics.messages import OF_THE_RUN, MessageLog
from cosim.errors import RunError

_LEFT = (
    f"{OF_THE_RUN}it refuses to be read in Initialization Mode, which FMI demands of it; so it was initialised once "
    "for each value of its inputs, and read behind that"
)


class ExchangeInInitialization:
    """Exchanges in Initialization Mode, where every output may have changed with every input.

    One that refuses to be read there leaves it at once, and is initialised again where its inputs have other values.

    Args:
        plan: of the run, all components in Initialization Mode.
        start_time, stop_time: as they were initialised [s].
    """

    def __init__(self, plan: Plan, start_time: float, stop_time: float) -> None:
        self._plan, self._times = plan, (start_time, stop_time)
        self._left = dict[str, np.ndarray]()  # the inputs that each was initialised with

    def __call__(self) -> None:
        """Exchange once."""
        for step in self._plan.steps:
            step.inputs.gather_now()
            if not self.has_left(step):
                step.inputs.send()
                if not _read_or_initialised_again(step, *self._times):
                    step.component.note(_LEFT, "warning")
                    self._left[step.component.name] = step.inputs.buffer.copy()
        for relay in self._plan.relays:
            relay()

    def has_left(self, step: PlannedComponent) -> bool:
        """Whether a component is behind Initialization Mode; then it is there with the inputs that were gathered.

        Args:
            step: of the plan.
        """
        name = step.component.name
        if name in self._left and not _is_equal(step, self._left[name]):
            _initialise_again(step, *self._times)
            self._left[name] = step.inputs.buffer.copy()
        return name in self._left


class ExchangeAtInstant:
    """Exchanges after Initialization Mode, without a step between them; made where all outputs have just been read.

    An FMU may refuse fmi2Get after fmi2Set until its next step (FMI 2.0.5, 4.2.4). So outputs are read again only where
    an input that acts on them at once has another value than before; otherwise they are what they were. One that
    refuses there is initialised again, with these inputs.

    Args:
        plan: all components in step mode, their inputs sent and their outputs read.
        start_time, stop_time: as they were initialised [s].
    """

    def __init__(self, plan: Plan, start_time: float, stop_time: float) -> None:
        self._plan, self._times = plan, (start_time, stop_time)
        self._acted_on = [_acted_on_at_once(plan, step) for step in plan.steps]
        self._read = [step.outputs.copy() for step in plan.steps]

    def __call__(self) -> None:
        """Exchange once."""
        for step, acted_on, known in zip(self._plan.steps, self._acted_on, self._read, strict=True):
            sent = step.inputs.buffer.copy()
            step.write()
            if acted_on and not _is_equal(step, sent):
                self.read_after_set(step)
                known[:] = step.outputs
            else:
                step.outputs[:] = known  # a search for what is fed back may have tried other values
        for relay in self._plan.relays:
            relay()

    def read_after_set(self, step: PlannedComponent) -> bool:
        """Read the outputs of a component whose inputs were set, initialised again where it refuses that.

        Args:
            step: of the plan.

        Returns:
            Whether it took it.

        Raises:
            RunError: it cannot be read anyway.
        """
        return _read_or_initialised_again(step, *self._times)


def _read_or_initialised_again(step: PlannedComponent, start_time: float, stop_time: float) -> bool:
    """Read a component; whether it took it. One that did not is initialised again and read behind that.

    Raises:
        RunError: it cannot be read anyway.
    """
    component = step.component
    own, component.messages = component.messages, MessageLog(component.name)  # a refusal is no fault
    try:
        step.read()
        return True
    except RunError as error:
        component.messages = own
        try:
            _initialise_again(step, start_time, stop_time)
        except RunError:
            raise error from None
        return False
    finally:
        component.messages = own


def _initialise_again(step: PlannedComponent, start_time: float, stop_time: float) -> None:
    """Reset a component, and bring it behind Initialization Mode with the inputs that were gathered."""
    component = step.component
    component.reset()
    for name, value in list(component.starts.items()):
        component.set_start(name, value)
    component.enter_initialization(start_time, stop_time)
    step.inputs.send()
    component.exit_initialization()
    step.read()


def _is_equal(step: PlannedComponent, sent: np.ndarray) -> bool:
    return step.inputs.non_numeric is None and np.array_equal(step.inputs.buffer, sent, equal_nan=True)


def _acted_on_at_once(plan: Plan, step: PlannedComponent) -> bool:
    """Whether a connected input may act at once on anything that is read: what is not declared may."""
    component, declared = step.component, declared_feedthrough(step.component)
    connected = {c.target_variable[1] for c in plan.connections if c.target[0] == component.name}
    read = {signal.name.partition(".")[2] for signal in plan.signals[step.columns]}
    read |= {c.source_variable[1] for c in plan.connections if c.source[0] == component.name}
    variables = {name if name in component.variables else name.partition("[")[0] for name in read}
    return any(name not in declared or not connected.isdisjoint(declared[name]) for name in variables)

"""Interpolators: how a slave is informed that its inputs follow a line during a step.

| interpolator | needs | what the slave sees |
|---|---|---|
| ``derivatives`` | FMI 1 or 2 with ``canInterpolateInputs`` | value at the start and slope: the line itself |
| ``intermediate`` | FMI 3 with ``providesIntermediateUpdate`` | the line, set at each instant at which it asks |
| ``mean`` | nothing | the mean of the line over the step, held, and its value at the end where the step ends |

An input without influence on any declared derivative, a sample or direct feedthrough, has the value at the end already
during the step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np

from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.feedthrough import acting_on_derivatives, declared_feedthrough
from cosim.coupling.inputs import Inputs
from cosim.master.interpolation.first_order_hold import FirstOrderHold


class InputInterpolator(ABC):
    """Gives one component the line of its inputs.

    Args:
        hold: the course of the inputs. inputs: the connected inputs it belongs to.
    """

    name: ClassVar[str]

    def __init__(self, hold: FirstOrderHold, inputs: Inputs) -> None:
        self.hold, self._inputs = hold, inputs

    @abstractmethod
    def send(self, t: float, until: float) -> None:
        """Give the line for a step from `t` to `until` [s]."""

    def begin(self) -> None:
        """A step begins: what is held over it was true where its source stands now."""
        self.hold.begin()

    def prepare(self, until: float, *, ends_known: bool | np.ndarray = False) -> None:
        """Gather the inputs and update the line for a step to `until` [s]; arguments as for `FirstOrderHold.update`.

        Args:
            ends_known: for which inputs the value at the end of the step is known.
        """
        self._inputs.gather()
        self.hold.update(self._inputs.buffer, until, held=self._inputs.held, ends_known=ends_known)

    def arrive(self, until: float) -> None:
        """The component stands at `until` [s]: where only a mean was given, outputs follow from the value there."""
        return

    def forget(self, jumped: np.ndarray) -> None:
        """Values of the plan that jumped, as a mask of shape (n,): no line of an input leads over it."""
        self.hold.forget(jumped[self._inputs.sources])

    def save(self) -> Any:
        """What a step changes here."""
        return self.hold.save()

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        self.hold.restore(state)


class MeanInterpolator(InputInterpolator):
    """Holds the mean of the line: exact for its integral, so of second order where states integrate the input.

    Args:
        hold: of the inputs. inputs: the connected inputs of the component. component: that receives them.

    `over` is the mask of the inputs that get the mean, `passes` of those that outputs show, shape (m,).
    """

    name = "mean"

    def __init__(self, hold: FirstOrderHold, inputs: Inputs, component: Component) -> None:
        super().__init__(hold, inputs)
        direct = {name for names in declared_feedthrough(component).values() for name in names}
        acting = acting_on_derivatives(component)
        if acting is None:
            acting = set(inputs.names) - direct
        over = [name in acting and not component.can_be_missing(name) for name in inputs.names]  # those are samples
        self.over = np.array(over, dtype=bool)
        self.passes = self.over & np.array([name in direct for name in inputs.names], dtype=bool)

    def send(self, t: float, until: float) -> None:  # noqa: D102 - see InputInterpolator
        self._inputs.buffer[:] = np.where(self.over, self.hold.mean(t, until), self.hold.at(until))
        self._inputs.send()

    def arrive(self, until: float) -> None:  # noqa: D102 - see InputInterpolator
        if self.passes.any():
            self._inputs.buffer[:] = self.hold.at(until)
            self._inputs.send()


class _BeginningInterpolator(InputInterpolator):
    """Sets the values at the start of the step; `moving` are the inputs that do not stay there."""

    def __init__(self, hold: FirstOrderHold, inputs: Inputs) -> None:
        super().__init__(hold, inputs)
        self.moving = np.flatnonzero(hold.continuous)
        self.names = [inputs.names[i] for i in self.moving]

    def send(self, t: float, until: float) -> None:
        self._inputs.buffer[:] = self.hold.at(t, begins=True)
        self._inputs.send()


class _DerivativeInterpolator(_BeginningInterpolator):
    """Sets value and first derivative at the start of the step (setRealInputDerivatives)."""

    name = "derivatives"

    def __init__(self, hold: FirstOrderHold, inputs: Inputs, component: Component) -> None:
        super().__init__(hold, inputs)
        self._write_slopes, self._slopes = component.make_derivative_writer(self.names)

    def send(self, t: float, until: float) -> None:
        super().send(t, until)
        self._slopes[:] = self.hold.slopes(t, until)[self.moving]
        self._write_slopes()


class _IntermediateInterpolator(_BeginningInterpolator):
    """Sets the value of the line whenever the slave asks for it within its step (intermediateUpdate)."""

    name = "intermediate"

    def __init__(self, hold: FirstOrderHold, inputs: Inputs, component: FMI3Component) -> None:
        super().__init__(hold, inputs)
        self._set_moving, self._now = component.writer(self.names)
        self.taken = component.follow_within_step(self.names, self._set)

    def _set(self, time: float) -> None:
        self._now[:] = self.hold.at(time)[self.moving]
        self._set_moving()


def make_interpolator(hold: FirstOrderHold, inputs: Inputs, component: Component) -> InputInterpolator:
    """The best interpolator that a component takes.

    Args:
        hold: of the inputs. inputs: the connected inputs of the component.
    """
    if component.fmi_version in (1, 2) and component.capabilities.canInterpolateInputs and component.kind == "FMU":
        return _DerivativeInterpolator(hold, inputs, component)
    if isinstance(component, FMI3Component):
        interpolator = _IntermediateInterpolator(hold, inputs, component)
        if interpolator.taken:
            return interpolator
    return MeanInterpolator(hold, inputs, component)

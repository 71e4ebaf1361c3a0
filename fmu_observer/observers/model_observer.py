"""Base of the generic observers: signals, gains and conditions of an observer of any `ObserverModel`.

It knows models and hybrid systems, and nothing of how an observer corrects itself.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any, ClassVar, Literal

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel, named_as, stacked_of
from fmu_observer.observers.evaluated_observer import EvaluatedObserver
from fmu_observer.observers.model_signals import (
    arrival_event,
    estimate_outputs,
    estimate_states,
    matrix_parameter,
    measured_inputs,
    sampling_event,
)
from plant_models.hybrid import Array, Signal, discrete_output, memory, output_signal, parameter, state
from plant_models.hybrid.missing import or_else

Timing = Literal["continuous", "periodic", "event"]


class ModelObserver(EvaluatedObserver):
    """Base of the observers of a model ``dx = A x + B u + phi(x, u)``, ``y = C x`` (`ObserverModel`).

    The contract:

    1. A subclass sets `timing`: measurements are ``continuous`` inputs ``measured_<y>``; or such inputs read at a
       ``periodic`` event `sampling`; or the payload ``<event>_<y>`` of a triggered ``event``, the model's own.
    2. The estimates are the states ``estimated_<x>``, n of them, which flow: as a vector by `estimates`, and back by
       `named_estimates`. Behind them stand `extra_states`, continuous too, then `extra_memory`. Where `discrete` is set
       the estimates are memory and stand behind `extra_states`. A subclass sets both before ``super().__init__``.
    3. A measurement of an event may be missing (NaN): the event does not occur then, unless `leaves_out` is set and the
       jump leaves it out itself, by `innovation` for instance.
    4. It writes `flow` or `jump` or both, and `condition_of`, the existence or stability condition for the gains in
       use.
    5. Gains are parameters (`gain_parameter`), so they can be changed in an FMU; their starts come from a design rule
       that the subclass names. Matrices are flat, row by row; `as_matrix` restores them.
    6. Outputs are the estimates under the names of the model's states.

    Args:
        model: a model or the name of one in `MODELS`.
        options: further options of the subclass.

    Raises:
        ValueError: the model is unknown, or it does not suit the observer.
    """

    timing: ClassVar[Timing] = "continuous"
    discrete: ClassVar[bool] = False
    leaves_out: ClassVar[bool] = False
    estimate_prefix: ClassVar[str] = "estimated_"
    extra_states: tuple[Signal, ...] = ()
    extra_memory: tuple[Signal, ...] = ()
    gain_parameters: tuple[Signal, ...] = ()
    extra_outputs: tuple[Signal, ...] = ()
    option_choices = {"model": tuple(MODELS)}

    def __init__(self, model: str | ObserverModel = "pendulum", **options: Any) -> None:
        self.model = find_model(model)
        estimates = self._estimates()
        self.states = (*self.extra_states, *estimates) if self.discrete else (*estimates, *self.extra_states)
        self.states = (*self.states, *self.extra_memory)
        measured = () if self.timing == "event" else measured_inputs(self.model.measurements)
        self.inputs = (*self.model.inputs, *measured)
        kind = discrete_output if self.discrete else output_signal
        self.outputs = (*estimate_outputs(self.model.states, kind), *self.extra_outputs)
        period = parameter(
            "sample_period", "s", self.model.sample_period, "Sampling period of the measurements", min=1e-6
        )
        self.parameters = (*self.gain_parameters, *((period,) if self.timing == "periodic" else ()))
        self.events = self._events()
        super().__init__(model=self.model.name, **options)

    @abstractmethod
    def condition_of(self, p: Any) -> Finding:
        """Existence or stability condition for the gains in the named tuple `p` of all parameters."""

    # -- what it may use --------------------------------------------------------------------------------------------

    def estimates(self, x: Any) -> Array:
        """The estimates within the state, shape (n,)."""
        return stacked_of(x, self.model.states, self.estimate_prefix)

    def named_estimates(self, values: Iterable[Array]) -> dict[str, Array]:
        """The way back: estimates, or their derivatives, by name of the state.

        Args:
            values: shape (n,), or a list.
        """
        return named_as(self.model.states, values, self.estimate_prefix)

    def known(self, u: Any) -> Array:
        """The model's inputs, shape (m,)."""
        return stacked_of(u, self.model.inputs)

    def measured(self, u: Any) -> Array:
        """The measurements, shape (q,); at a triggered event only in its jump."""
        return stacked_of(u, self.model.measurements, f"{self.model.event}_" if self.timing == "event" else "measured_")

    def gain_parameter(self, name: str, start: np.ndarray, description: str, unit: str = "1") -> Signal:
        """A gain as a parameter, flat, row by row; a single number where it has only one element and one dimension.

        Args:
            start: default, shape (n, q). unit: SI, as FMI writes units.
        """
        values = np.asarray(start, dtype=float)
        if values.ndim == 0:
            return parameter(name, unit, float(values), description)
        return matrix_parameter(name, values, description, unit)

    def innovation(self, x: Any, u: Any) -> Array:
        """``C xh - y``, shape (q,); zero where a measurement is missing."""
        expected = self.model.measured(self.estimates(x))
        return expected - or_else(self.measured(u), expected)

    # -- what follows -----------------------------------------------------------------------------------------------

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return named_as(self.model.states, self.estimates(x))

    # -- internals --------------------------------------------------------------------------------------------------

    def _estimates(self) -> tuple[Signal, ...]:
        kind = memory if self.discrete else state
        return estimate_states(self.model.states, kind, self.estimate_prefix)

    def _events(self) -> tuple[Any, ...]:
        measurements, leaves_out = self.model.measurements, self.leaves_out
        if self.timing == "periodic":
            return (sampling_event([f"measured_{s.name}" for s in measurements], leaves_out=leaves_out),)
        if self.timing == "event":
            return (arrival_event(self.model.event, measurements, leaves_out=leaves_out),)
        return ()


def as_matrix(flat: Array, rows: int, columns: int) -> Array:
    """A flat parameter, row by row, as a matrix of shape (rows, columns)."""
    return np.reshape(flat, (rows, columns))

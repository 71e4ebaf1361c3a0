"""Base of filters that carry members, each of which runs through the model: ensemble and particle filters."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.formulas.filtering.kalman import decoupled
from fmu_observer.formulas.filtering.particles import drawn
from fmu_observer.models.filter_models import Known, noise_over
from fmu_observer.models.moving_system import Steps
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.traced_system_model import Source, find_filter_model
from fmu_observer.observers.evaluated_observer import EvaluatedObserver
from fmu_observer.observers.generic.discrete.arrivals import INITIALISED
from fmu_observer.observers.generic.discrete.covariance_requirements import positive
from fmu_observer.observers.generic.discrete.filter_condition import steady_condition, within_steps
from fmu_observer.observers.model_observer import as_matrix
from fmu_observer.observers.model_signals import (
    LAST_NIS,
    deviation_outputs,
    estimate_outputs,
    estimate_states,
    matrix_parameter,
    measured_inputs,
    sampling_event,
)
from plant_models.hybrid import Array, PeriodicEvent, Signal, discrete_output, input_signal, memory, parameter
from plant_models.hybrid.missing import is_there, or_else
from plant_models.hybrid.noise import Purpose
from plant_models.hybrid.signal import within_bounds

DENSITY = 1e-2  # of the default process noise in every state or noise input [x2/s] [ours]
VARIANCE = 1e-4  # of the default measurement noise [y2] [ours]
MOST, DEFAULT = 50, 20  # members: each stands in the generated C once


class Sample(NamedTuple):
    """What a filter with members gets at a sample.

    Attributes:
        y: measurements, shape (q,). seen: what each member measures, shape (q, M). noise: RN, shape (q, q).
        count: how many of them there are.
    """

    y: Array
    seen: Array
    noise: Array
    count: Array


class CorrectedMembers(NamedTuple):
    """What a sample makes of the members.

    Attributes:
        estimate: shape (n,). nis: normalised innovation squared. variances: shape (n,). members: shape (n, M).
        more: values of `own_memory` by name.
    """

    estimate: Array
    nis: Array
    variances: Array
    members: Array
    more: Mapping[str, Array] = {}


class MemberFilter(EvaluatedObserver):
    """Base of filters of any `FilterModel` whose belief is a number of members.

    The contract:

    1. A subclass sets `own_parameters`, `own_memory` and `own_outputs` before ``super().__init__``, and writes
       `corrected`.
    2. At the first sample members are drawn around the start of the estimates with `start_covariance`; at later ones
       each runs through the model over the period and feels process noise of its own. Noises are of (seed, signal,
       index), so that block, FMU and a run that is done again draw the same.
    3. The states are the estimates, NIS, standard deviations, the members, what the subclass adds, how many
       measurements there were last, and whether a sample has come. What is missing (NaN) is left out.

    Args:
        model: name of an observer model or of a plant, ``file.py:Class``, or a model or system itself.
        members: how many, 2 to 50.
        outputs, inputs, process_noises: of a plant, see `models.system_model`. period, substeps: see `GaussianFilter`.

    Raises:
        ValueError: an option is not legal, or the model does not suit; the message says which.
    """

    internal_step = 0.1  # nothing flows between samples
    purpose = Purpose.MEMBERS
    perturbs: ClassVar[bool] = False
    own_parameters: tuple[Signal, ...] = ()
    own_memory: tuple[Signal, ...] = ()
    own_outputs: tuple[Signal, ...] = ()
    option_choices = {
        "model": (),
        "members": range(2, MOST + 1),
        "outputs": (),
        "inputs": (),
        "process_noises": (),
        "period": (),
        "substeps": (),
    }

    def __init__(
        self,
        model: Source = "pendulum",
        members: int = DEFAULT,
        *,
        outputs: Sequence[str] = (),
        inputs: Sequence[str] | None = None,
        process_noises: Sequence[str] = (),
        period: float | None = None,
        substeps: int | None = None,
    ) -> None:
        self.model = find_filter_model(model, outputs, inputs, process_noises, (), Steps(period, substeps))
        if self.model.measurement_noises:
            raise ValueError(
                f"{self.name}: measurement noise of {self.model.name!r} enters by inputs; expected additive noise. Use "
                "'unscented_kalman_filter'."
            )
        if not 2 <= members <= MOST:
            raise ValueError(
                f"{self.name}: members = {members!r}; expected 2 to {MOST}, since each stands in the generated C. "
                "Use the functions of fmu_observer.formulas.filtering for more."
            )
        self.members = members
        self._declare()
        super().__init__(model=self.model.name, members=members)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def corrected(self, members: Array, x: Any, sample: Sample, u: Any, p: Any) -> CorrectedMembers:
        """What a sample makes of the members; where all of it is missing they stay as they are.

        Args:
            members: predictions, shape (n, M). sample: what was measured, and what each member measures.
        """

    # -- what follows -----------------------------------------------------------------------------------------------

    def known(self, t: Array, u: Any, p: Any) -> Known:
        """Time, inputs and parameters of the model."""
        return Known(t, stacked_of(u, self.model.inputs), stacked_of(p, self.model.parameters))

    def spread(self, members: Array, p: Any) -> Array:
        """The members before a correction, shape (n, M).

        Args:
            members: predictions, shape (n, M).
        """
        return members

    def sample(self, members: Array, y: Array, known: Known, p: Any) -> Sample:
        """What was measured. What is missing is zero to all members, and of a variance of its own.

        Args:
            members: shape (n, M). y: measurements, shape (q,). known: time, inputs and parameters of the model.
        """
        none, q, there = self.model.no_reading_noise(), y.shape[0], is_there(y)
        seen = np.stack([self.model.measured(members[:, i], none, known) for i in range(self.members)], axis=1)
        noise = decoupled(as_matrix(p.measurement_covariance, q, q), there)
        return Sample(or_else(y, 0.0), seen * there.reshape(q, 1), noise, there @ np.ones(q))

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Members drawn at the first sample, or moved over the period, then corrected."""
        n, states = self.model.order, self.model.states
        estimate = stacked_of(x, states, "estimated_")
        normal = np.reshape(u.process_normal, (-1, self.members))[:n]
        start = estimate.reshape(n, 1) + drawn(as_matrix(p.start_covariance, n, n), normal)
        members = np.where(x.primed > 0.5, self._moved(x.drawn_members, t, u, p), start)
        y = stacked_of(u, self.model.measurements, "measured_")
        sample = self.sample(self.spread(members, p), y, self.known(t, u, p), p)
        found = self.corrected(members, x, sample, u, p)
        return {
            **named_as(states, found.estimate, "estimated_"),
            "last_nis": np.where(sample.count > 0.5, found.nis, x.last_nis),
            "deviations": np.sqrt(np.maximum(found.variances, 0.0)),
            "drawn_members": found.members.T,
            **found.more,
            "last_count": np.where(sample.count > 0.5, sample.count, x.last_count),
            "primed": 1.0,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        names = [s.name for s in self.model.states]
        values = {name: getattr(x, f"estimated_{name}") for name in names}
        values |= {f"{name}_std": x.deviations[i] for i, name in enumerate(names)}
        return values | {"nis": x.last_nis, "nis_degrees": x.last_count}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Covariances are symmetric and positive; other parameters within their bounds."""
        n, r, q = self.model.order, self.model.noise_count, len(self.model.measurements)
        needed = super().requirements(p) | within_bounds(self.own_parameters, p) | within_steps(self.model, p)
        needed |= positive("process_covariance", p.process_covariance, r, definite=False)
        needed |= positive("start_covariance", p.start_covariance, n, definite=False)
        return needed | positive("measurement_covariance", p.measurement_covariance, q, definite=True)

    def condition_of(self, p: Any) -> Finding:
        """Whether the Kalman filter of the model, linearised at the start, has a stable steady state; members add
        sampling errors of ``1 / sqrt(members)``.
        """
        r, q = self.model.noise_count, len(self.model.measurements)
        noise, readings = (
            as_matrix(np.asarray(v), k, k) for v, k in ((p.process_covariance, r), (p.measurement_covariance, q))
        )
        start, known = self.model.start, self._at_start()
        return steady_condition(self.model, start, known, float(p.sample_period), noise, readings, self.source)

    # -- internals --------------------------------------------------------------------------------------------------

    def _moved(self, before: Array, t: Array, u: Any, p: Any) -> Array:
        """All members a period later, with noise, shape (n, M)."""
        known, count, r = self.known(t - p.sample_period, u, p), self.members, self.model.noise_count
        draws = np.reshape(u.process_normal, (-1, count))[:r]
        noise, none = drawn(as_matrix(p.process_covariance, r, r), draws), self.model.no_noise()
        if self.model.process_noises:
            columns = [self.model.moved(before[i], noise[:, i], known, p.sample_period) for i in range(count)]
            return np.stack(columns, axis=1)
        return np.stack([self.model.moved(before[i], none, known, p.sample_period) for i in range(count)], 1) + noise

    def _at_start(self) -> Known:
        inputs = self.model.start_inputs
        parameters = np.array([value for s in self.model.parameters for value in s.start_values])
        return Known(0.0, inputs, parameters)

    def _declare(self) -> None:
        """Signals and the event, from the model."""
        model, period = self.model, "Sampling period of the measurements"
        self.states = self._memory()
        self.inputs = (*model.inputs, *measured_inputs(model.measurements))
        self.events = (self._sample_event(),)
        self.outputs = (
            *estimate_outputs(model.states, discrete_output),
            *deviation_outputs(model.states, discrete_output),
            discrete_output("nis", "1", "Normalised innovation squared of the last sample"),
            discrete_output("nis_degrees", "1", "Degrees of freedom of the normalised innovation squared"),
            *self.own_outputs,
        )
        period_of = parameter("sample_period", "s", model.sample_period, period, min=1e-6)
        self.parameters = (*self._noises(), *self.own_parameters, *model.parameters, period_of)

    def _memory(self) -> tuple[Signal, ...]:
        n, q = self.model.order, len(self.model.measurements)
        return (
            *estimate_states(self.model.states, memory),
            LAST_NIS,
            memory("deviations", "1", (1.0,) * n, "Standard deviations of the estimates, SI units", size=n),
            memory("drawn_members", "1", 0.0, "Members, one after the other, SI units", shape=(self.members, n)),
            *self.own_memory,
            memory("last_count", "1", float(q), "How many measurements there were last"),
            INITIALISED,
        )

    def _sample_event(self) -> PeriodicEvent:
        """The event of a sample, with the numbers that are drawn for it."""
        model = self.model
        q, drawn_for_each = len(model.measurements), {"process_normal": max(model.order, model.noise_count)}
        if self.perturbs:
            drawn_for_each["measurement_normal"] = q
        text = "Standard normal numbers of this sample"
        noises = tuple(
            input_signal(name, "1", 0.0, text, variability="discrete", size=k * self.members)
            for name, k in drawn_for_each.items()
        )
        read = [f"measured_{s.name}" for s in model.measurements]
        return replace(sampling_event(read, leaves_out=True), noises=noises)

    def _noises(self) -> tuple[Signal, ...]:
        model, n, r, q = self.model, self.model.order, self.model.noise_count, len(self.model.measurements)
        density, period = DENSITY * np.eye(r), self.model.sample_period
        if model.process_noises or not model.any_period:
            QN = density / period if model.process_noises else density * period
        else:
            QN = np.asarray(noise_over(model, model.start, self._at_start(), period, density))
        return (
            matrix_parameter("process_covariance", QN, "Covariance QN of the process noise of one period, row by row"),
            matrix_parameter(
                "measurement_covariance", VARIANCE * np.eye(q), "Covariance RN of the measurements, row by row"
            ),
            matrix_parameter("start_covariance", np.eye(n), "Covariance of the first estimate, row by row"),
        )

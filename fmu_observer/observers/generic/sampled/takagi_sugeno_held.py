"""Base of the Takagi-Sugeno observers whose innovation is held from sample to sample.

It knows Takagi-Sugeno models and certificates.
"""

from __future__ import annotations

from abc import abstractmethod
from functools import reduce
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.quadratic import QuadraticCondition as Inequalities
from fmu_observer.certificates.quadratic import common_quadratic_form, decrease, flow_condition
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.known_models import find_takagi_sugeno_model
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.model_signals import (
    arrival_event,
    estimate_outputs,
    estimate_states,
    matrix_parameter,
    measured_inputs,
    sampling_event,
)
from plant_models.hybrid import Array, Signal, memory, parameter, vector

SPEED, _SPEED_GAP = 2.0, 0.4  # default poles from -min(SPEED [1/s], _SPEED_GAP / longest gap) on [ours]
SHARES = (0.75, 0.5, 0.25)  # of the first vertex in the mixtures that are certified
_SUITED = ("pendulum", "takagi_sugeno_train")  # their default gains are certified for their gaps


class _TakagiSugenoHeld(GatedObserver, GapCertified):
    """Base of ``dxh = sum_i h_i [A_i xh + B_i u - L_i eta]``, ``eta = C xh - y`` set at samples and held between them.

    All measurements of the model are sampled together, at the event of the model or, where `periodic` is set, at a
    period. A subclass says from what the weights come (`weights`).

    Default L_i: poles of ``A_i - L_i C`` the same at every vertex, real from ``-min(2, 0.4 / longest gap)`` 1/s on
    [ours].
    """

    internal_step = 5e-3
    option_choices = {"model": _SUITED}
    periodic: ClassVar[bool] = False
    extra_memory: tuple[Signal, ...] = ()

    def __init__(self, model: str | TakagiSugenoModel = "pendulum") -> None:
        self.model = find_takagi_sugeno_model(model)
        self.parameters = (self._gain_parameter(), *self.timing_parameters())
        self.states = (
            *estimate_states(self.model.states),
            *(
                memory(f"innovation_{s.name}", s.unit, 0.0, f"Held error: {s.description}")
                for s in self.model.measurements
            ),
            *self.weight_memory(),
        )
        measurements = self.model.measurements
        self.outputs = estimate_outputs(self.model.states)
        if self.periodic:
            self.inputs = (*self.model.inputs, *measured_inputs(measurements))
            self.events = (sampling_event([f"measured_{s.name}" for s in measurements]),)
        else:
            self.inputs, self.events = self.model.inputs, (arrival_event(self.model.event, measurements),)
        super().__init__(model=self.model.name)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def weights(self, x: Any, u: Any) -> tuple[Array, ...]:
        """Weights h_i in use now, N numbers."""

    @abstractmethod
    def premise_remark(self) -> str:
        """What the certificate leaves out of the premises."""

    def timing_parameters(self) -> tuple[Signal, ...]:
        """Parameters besides the gains."""
        return ()

    def weight_memory(self) -> tuple[Signal, ...]:
        """Memory of the weights, if they are frozen."""
        return ()

    def held_weights(self, estimate: Array, u: Any) -> dict[str, Array]:
        """What goes into that memory at a sample, by name, of the estimate there."""
        return {}

    # -- what follows -----------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        weights, eta = self.weights(x, u), stacked_of(x, self.model.measurements, "innovation_")
        total = self.model.blend(weights, self.estimates(x), self.known(u))
        for weight, L in zip(weights, self.gains(p), strict=True):
            total = total - weight * (L @ eta)
        return named_as(self.model.states, total, "estimated_")

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew, and the weights where they are frozen; the estimates stay continuous."""
        estimate = self.estimates(x)
        innovation = self.model.C @ estimate - self.measured(u)
        return named_as(self.model.measurements, innovation, "innovation_") | self.held_weights(estimate, u)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return named_as(self.model.states, self.estimates(x))

    def estimates(self, x: Any) -> Array:
        """The estimates within the state, shape (n,)."""
        return stacked_of(x, self.model.states, "estimated_")

    def known(self, u: Any) -> Array:
        """The model's inputs, shape (m,)."""
        return stacked_of(u, self.model.inputs)

    def measured(self, u: Any) -> Array:
        """The measurements at a sample, shape (q,)."""
        prefix = "measured_" if self.periodic else f"{self.model.event}_"
        return stacked_of(u, self.model.measurements, prefix)

    def gains(self, p: Any) -> tuple[Array, ...]:
        """L_i, N of them, each of shape (n, q)."""
        size = self.model.order * len(self.model.measurements)
        shape = (self.model.order, len(self.model.measurements))
        return tuple(np.reshape(p.gain[i * size : (i + 1) * size], shape) for i in range(self.model.vertices))

    def condition_of(self, p: Any) -> Finding:
        """One quadratic function for all ``A_i - L_i C``, and the unknown slope it tolerates: samples without gaps."""
        closed = self._closed(p)
        inequalities = reduce(Inequalities.joined, (flow_condition(matrix) for matrix in closed))
        candidate = common_quadratic_form(inequalities)
        margin = -np.inf if candidate is None else -float(decrease(inequalities, candidate.P).max())
        largest = np.nan if candidate is None else float(np.linalg.eigvalsh(candidate.P)[-1])
        return condition_found(
            holds=margin > 0.0,
            numbers={
                "abscissa [1/s]": max(float(np.linalg.eigvals(matrix).real.max()) for matrix in closed),
                "margin": margin,
                "tolerated_slope [1/s]": max(0.0, 0.5 * margin / largest) if margin > 0.0 else 0.0,
            },
            statement="one P > 0 decreases for all A_i - L_i C (margin > 0) and an unknown f with |f| <= "
            "tolerated_slope |e|; gaps have a finding of their own",
            source=self.source,
        )

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over the vertices and mixtures of every two: three mixtures if there are two vertices, else
        one.
        """
        gains = [np.asarray(L, dtype=float) for L in self.gains(p)]
        shares = SHARES if len(gains) == 2 else (0.5,)
        mixtures = [(i, i, 1.0) for i in range(len(gains))]
        mixtures += [(i, j, s) for i, j in combinations(range(len(gains)), 2) for s in shares]
        vertices = tuple(
            self._error(s * self.model.A[i] + (1.0 - s) * self.model.A[j], s * gains[i] + (1.0 - s) * gains[j])
            for i, j, s in mixtures
        )
        model = (
            f"error equations of the Takagi-Sugeno model {self.model.name!r} at its vertices and mixtures of every "
            f"two, weights constant over a gap; {self.premise_remark()}, disturbances and noise are left out"
        )
        certificate = certify_sampled_error(vertices, gap, model)
        return certificate if self.weight_memory() else with_switching_noted(certificate, vertices, "weights")

    # -- internals --------------------------------------------------------------------------------------------------

    def _error(self, A: np.ndarray, L: np.ndarray) -> ImpulsiveError:
        q = len(self.model.measurements)
        return ImpulsiveError.with_innovation(A, L, np.zeros((q, q)), self.model.C)

    def _closed(self, p: Any) -> list[np.ndarray]:
        return [A - np.asarray(L, dtype=float) @ self.model.C for A, L in zip(self.model.A, self.gains(p), strict=True)]

    def _gain_parameter(self) -> Signal:
        model = self.model
        poles = -min(SPEED, _SPEED_GAP / model.max_gap) * (1.0 + 0.25 * np.arange(model.order))
        states, who = tuple(s.name for s in model.states), f"{self.name} of {model.name}"
        gains = np.concatenate([observer_gain(A, model.C, poles, states, who).ravel() for A in model.A])
        text = "Gains L_i, vertex after vertex, each row by row"
        return matrix_parameter("gain", gains, text)


class TakagiSugenoAperiodic(_TakagiSugenoHeld):
    """Takagi-Sugeno observer at aperiodic samples, innovation and weights held: Bouchama 2024, (1.55).

    ``dxh = sum_i h_i(z(t_k)) [A_i xh + B_i u + L_i (y(t_k) - C xh(t_k))]`` on ``[t_k, t_k+1)``. Weights and innovation
    are frozen at the sample; the premises are read from the measurements there, and from the estimate where these do
    not give them. Printed with damaged brackets; repaired.

    Frozen weights leave an error of the order of what the premises change within a gap: it does not die out while the
    plant moves.
    """

    name = "takagi_sugeno_aperiodic"
    description = "Takagi-Sugeno observer at aperiodic samples, innovation and weights held"
    source = "Bouchama 2024, (1.55)"

    def weight_memory(self) -> tuple[Signal, ...]:
        """The weights, until the first sample those of the start."""
        start = self.model.weights(self.model.premise_values(self.model.start, np.zeros(len(self.model.inputs))))
        weights = tuple(map(float, start))
        return (memory("weight", "1", weights, "Weights h_i of the vertices at the last sample", size=len(weights)),)

    def held_weights(self, estimate: Array, u: Any) -> dict[str, Array]:
        """Weights at the sample."""
        measured, count = self.measured(u), len(self.model.sampled)
        best = self.model.informed(estimate, measured[:count], measured[count:] if self.model.continuous else None)
        return {"weight": vector(*self.model.weights(self.model.premise_values(best, self.known(u))))}

    def weights(self, x: Any, u: Any) -> tuple[Array, ...]:
        """Weights of the last sample."""
        return tuple(x.weight)

    def premise_remark(self) -> str:
        """The weights are those of the last sample."""
        return "what the premises change within a gap, an input to the error"


class TakagiSugenoPeriodic(_TakagiSugenoHeld):
    """Takagi-Sugeno observer at periodic samples, innovation held: Bouchama 2024, (1.38)-(1.41).

    ``dxh = sum_i h_i(zh) [A_i xh + B_i u + L_i (y(kT) - C xh(kT))]`` on ``[kT, (k+1) T)``. The printed bracket is
    damaged; repaired to the held innovation with the sign that corrects. The weights follow the estimate. The unknown f
    of (1.38) with ``|f| <= alpha |F x|`` is met by `condition`, as the slope it tolerates.
    """

    name = "takagi_sugeno_periodic"
    description = "Takagi-Sugeno observer at periodic samples, innovation held"
    source = "Bouchama 2024, (1.38)-(1.41)"
    periodic = True

    def timing_parameters(self) -> tuple[Signal, ...]:
        """The sampling period."""
        return (parameter("sample_period", "s", self.model.max_gap, "Sampling period of the measurements", min=1e-6),)

    def weights(self, x: Any, u: Any) -> tuple[Array, ...]:
        """Weights at the estimate."""
        return self.model.weights(self.model.premise_values(self.estimates(x), self.known(u)))

    def premise_remark(self) -> str:
        """The weights are those of the estimate."""
        return "their change within a gap, the difference between the weights of estimate and truth"

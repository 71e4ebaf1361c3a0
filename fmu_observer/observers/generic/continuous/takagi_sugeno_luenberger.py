"""O7: the Takagi-Sugeno Luenberger observer, all measurements continuous."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from math import inf
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.quadratic import QuadraticCondition, common_quadratic_form, decrease, flow_condition
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.checks import checked_matrix
from fmu_observer.models.known_models import TAKAGI_SUGENO_MODELS, find_takagi_sugeno_model
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observers.evaluated_observer import EvaluatedObserver
from fmu_observer.observers.model_signals import estimate_outputs, estimate_states, matrix_parameter, measured_inputs
from plant_models.hybrid import Array, output_signal, state
from plant_models.hybrid.option import require_chosen


@dataclass(frozen=True)
class _VertexDecrease:
    """Common quadratic Lyapunov function of the vertex errors ``A_i - K_i C``.

    Attributes:
        margin: smallest decrease ``-lmax((A_i - K_i C)' P + P (A_i - K_i C))`` over the vertices, recomputed, at
        trace(P) = n in the
            model's scaled coordinates [1/s]; -inf when no P was found. abscissa: largest real part at the vertices
            [1/s].
    """

    margin: float
    abscissa: float


Premise = Literal["measured", "estimated"]
PREMISES: tuple[Premise, ...] = ("measured", "estimated")
SPEED = 2.0  # [1/s] of the default poles, at -SPEED, -1.25 SPEED, ... [ours]


class TakagiSugenoLuenberger(EvaluatedObserver):
    """Takagi-Sugeno Luenberger observer ``dxh = sum_i h_i [A_i xh + B_i u - K_i (C xh - y)]``: Bouchama 2024,
    (1.19)-(1.28).

    All measurements of the model, those it calls sampled too, are continuous inputs here. The premises are read from
    the state nearest to the estimate that agrees with the measurements (``measured``), or from the estimate as printed
    in (1.19) (``estimated``). Where the measurements give all premises the error obeys
    ``de = sum h_i (A_i - K_i C) e``, and the inequalities of (1.26) decide: ``A_i' P + P A_i - L_i C - C' L_i' < 0``,
    ``K_i = inv(P) L_i``. Repaired: the print has ``L_i' C'``. `condition` seeks P for the gains in use and recomputes
    the inequalities.

    Default gains [ours]: the same poles at every vertex, from -2 1/s on;
    `design.takagi_sugeno_luenberger.designed_gains` solves the inequalities instead. Premises outside their bounds use
    the nearer vertices; `premise_outside_time` says for how long.

    Args:
        model: a Takagi-Sugeno model or the name of one. premise: see above.
        gains: K_i, shape (N, n, q), for the starts of the parameter; None for the default.

    Raises:
        ValueError: model or premise is unknown, gains are of another shape, or a vertex is not observable.
    """

    name = "takagi_sugeno_luenberger"
    description = "Takagi-Sugeno Luenberger observer, continuous measurements"
    source = "Bouchama 2024, (1.19)-(1.28), inequality (1.26) repaired"
    internal_step = 5e-3
    option_choices = {"model": tuple(TAKAGI_SUGENO_MODELS), "premise": PREMISES}

    def __init__(
        self,
        model: str | TakagiSugenoModel = "pendulum",
        premise: Premise = "measured",
        gains: np.ndarray | None = None,
    ) -> None:
        self.model = chosen = find_takagi_sugeno_model(model)
        require_chosen(self.name, self.option_choices, premise=premise)
        self.premise = premise
        n, shape = chosen.order, (chosen.vertices, chosen.order, len(chosen.measurements))
        K = _placed_gains(chosen, -SPEED * (1.0 + 0.25 * np.arange(n))) if gains is None else gains
        K = checked_matrix(self.name, "gain", K, shape, "vertices, states, measurements")
        self.states = (
            *estimate_states(chosen.states),
            state("time_outside", "s", 0.0, "For how long a premise was outside its bounds"),
        )
        self.inputs = (*chosen.inputs, *measured_inputs(chosen.measurements))
        self.outputs = (
            *estimate_outputs(chosen.states),
            output_signal("premise_outside_time", "s", "For how long a premise was outside its bounds"),
        )
        self.parameters = (matrix_parameter("gain", K, "Gains K_i: by vertex, state, measurement, in SI units"),)
        super().__init__(model=chosen.name, premise=premise)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        model = self.model
        estimate, known = stacked_of(x, model.states, "estimated_"), stacked_of(u, model.inputs)
        y = stacked_of(u, model.measurements, "measured_")
        count = len(model.sampled)
        seen = model.informed(estimate, y[:count], y[count:]) if self.premise == "measured" else estimate
        values = model.premise_values(seen, known)
        h, error = model.weights(values), model.C @ estimate - y
        moved = model.blend(h, estimate, known)
        for i, weight in enumerate(h):
            moved = moved - weight * (self._gain_of(p, i) @ error)
        return named_as(model.states, moved, "estimated_") | {"time_outside": model.outside(values)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        estimate = stacked_of(x, self.model.states, "estimated_")
        return named_as(self.model.states, estimate) | {"premise_outside_time": x.time_outside}

    def condition_of(self, p: Any) -> Finding:
        """Whether one quadratic Lyapunov function covers all vertices for the gains in use."""
        found = _vertex_decrease(
            self.model, np.stack([np.asarray(self._gain_of(p, i)) for i in range(self.model.vertices)])
        )
        hidden = len(self.model.unmeasured) if self.premise == "measured" else len(self.model.premises)
        return condition_found(
            holds=found.margin > 0.0 and not hidden,
            numbers={
                "vertices": self.model.vertices,
                "abscissa [1/s]": found.abscissa,
                "margin": found.margin,
                "premises_not_measured": hidden,
            },
            statement="one P > 0 makes (A_i - K_i C)' P + P (A_i - K_i C) < 0 at every vertex (margin > 0), premises "
            "measured",
            source="Bouchama 2024, (1.26), repaired",
        )

    def _gain_of(self, p: Any, vertex: int) -> Array:
        n, q = self.model.order, len(self.model.measurements)
        return np.reshape(p.gain[vertex * n * q : (vertex + 1) * n * q], (n, q))


def _placed_gains(model: TakagiSugenoModel, poles: np.ndarray) -> np.ndarray:
    """Gains K_i that give every vertex the same poles, shape (N, n, q).

    All measurements of the model count as continuous. The same poles at every vertex are not yet a common Lyapunov
    function:
    `_vertex_decrease` says whether there is one.
    """
    names, T = tuple(s.name for s in model.states), np.asarray(model.scaling)
    gains = []
    for i, A in enumerate(model.A):
        name = f"{model.name}, vertex {i + 1}"
        gains.append(observer_gain(A * T[:, None] / T, model.C / T, poles, names, name) / T[:, None])
    return np.stack(gains)


def vertex_errors(model: TakagiSugenoModel, gains: np.ndarray) -> list[np.ndarray]:
    """``A_i - K_i C`` in the model's scaled coordinates, N matrices of shape (n, n).

    Args:
        gains: of all vertices.
    """
    T = np.asarray(model.scaling)
    return [(A - K @ model.C) * T[:, None] / T for A, K in zip(model.A, gains, strict=True)]


def _vertex_decrease(model: TakagiSugenoModel, gains: np.ndarray) -> _VertexDecrease:
    """Seek one P for all vertices by semidefinite programming and recompute what it gives."""
    errors = vertex_errors(model, gains)
    abscissa = max(float(np.linalg.eigvals(error).real.max()) for error in errors)
    conditions = reduce(QuadraticCondition.joined, map(flow_condition, errors))
    found = common_quadratic_form(conditions) if abscissa < 0.0 else None
    margin = -inf if found is None else -float(decrease(conditions, found.P).max())
    return _VertexDecrease(margin, abscissa)

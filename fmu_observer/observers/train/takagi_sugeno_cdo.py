"""S2: Takagi-Sugeno continuous-discrete observer that fuses the odometer with balises."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.design.certified_gains import balise_family, certified_gains
from fmu_observer.observers.evaluated_observer import Evaluate
from fmu_observer.observers.train.train_observer import Estimate, TrainObserver
from fmu_observer.observers.train.train_signals import BALISE_INNOVATION, MOTION, POSITION, SPEED
from plant_models.hybrid import Array, memory, parameter
from plant_models.hybrid.option import require_chosen

Premise = Literal["frozen", "live", "estimated"]

_PRINTED_GAINS = {  # (3.48), one value a vertex: lowest speed, highest speed
    "balise_gain_position": (9.9036, 9.9036),
    "balise_gain_speed": (25.4133, 25.4071),
    "odometer_gain_position": (-0.1618e-4, -0.1618e-4),
    "odometer_gain_speed": (-0.0126e-4, -0.0130e-4),
}


_LONG_GAPS = {  # ours; as `design_takagi_sugeno(trust="odometer")`
    "innovation_decay": 3.0,
    "balise_gain_position": (2.4, 2.4),
    "balise_gain_speed": (0.0, 0.0),
    "odometer_gain_position": (0.7, 0.7),
    "odometer_gain_speed": (1.6, 1.6),
}


class TakagiSugenoCdo(TrainObserver):
    """Takagi-Sugeno observer with a continuous odometer and aperiodic balises: Bouchama 2024, (3.44)-(3.48), (2.6).

    ``dx = sum_i h_i [A_i x + B u - K_i2 (v - y) - K_i1 eta]``, ``d eta = -decay eta``, ``eta = p - balise_position`` at
    a balise, with ``A_i = [[0, 1], [0, -(b + c v_i)/M]]`` at the vertices ``v_1 = premise_min``, ``v_2 = premise_max``,
    ``u = effort - a``, and ``h_1 = (v_2 - y)/(v_2 - v_1)`` limited to [0, 1], so that speeds outside the range use the
    nearer vertex. K_i1 belongs to the balise and K_i2 to the odometer; (3.47) copies the wiring of chapter 2, where the
    two outputs are swapped.

    The applied effort stands for the adhesion force: the inertia of the wheels is neglected, which biases the speed by
    about half of ``(J / r^2) / M`` times the acceleration.

    Args:
        premise: what the weights h depend on: ``frozen`` at the odometer reading of the last balise, as in (2.6);
            ``live`` on the odometer now; ``estimated`` on the estimated speed.

    Presets: `as_published` with decay 3 1/s, unstable beyond constant gaps of 0.286 s although designed for 0.5 s;
    `repaired` (default) with decay 9.9 1/s, the value consistent with the printed K_i1, certified to 0.779 s;
    `long_gaps`, which is ours: the speed follows the odometer and each balise takes the share
    (2.4 / 3) (1 - exp(-3 gap)) of the position error away, between 0 and 1 for every gap, so a constant gap of any
    length is stable. Gaps that change are certified up to 100.6 s. Its price: slip of the wheels is taken for speed.
    """

    name = "takagi_sugeno_cdo"
    description = "Takagi-Sugeno continuous-discrete observer of the train, odometer and balises"
    source = "Bouchama 2024, (3.44)-(3.48)"
    frictions = (SPEED.name,)
    estimator_states = (*MOTION, BALISE_INNOVATION)
    estimator_parameters = (
        parameter("innovation_decay", "1/s", 9.9, "Decay rate eta of the balise gain since the last balise", min=0.0),
        parameter("premise_min", "m/s", 5.0, "Speed of the first vertex", min=0.0),
        parameter("premise_max", "m/s", 50.0, "Speed of the second vertex", min=0.0),
        parameter(
            "balise_gain_position", "1/s", _PRINTED_GAINS["balise_gain_position"], "First entries of K_11, K_21", size=2
        ),
        parameter(
            "balise_gain_speed", "1/s2", _PRINTED_GAINS["balise_gain_speed"], "Second entries of K_11, K_21", size=2
        ),
        parameter(
            "odometer_gain_position",
            "1",
            _PRINTED_GAINS["odometer_gain_position"],
            "First entries of K_12, K_22",
            size=2,
        ),
        parameter(
            "odometer_gain_speed", "1/s", _PRINTED_GAINS["odometer_gain_speed"], "Second entries of K_12, K_22", size=2
        ),
    )
    stability_parameters = ("innovation_decay", "premise_min", "premise_max", *_PRINTED_GAINS)
    presets = {
        "as_published": {"innovation_decay": 3.0, **_PRINTED_GAINS},
        "repaired": {"innovation_decay": 9.9, **_PRINTED_GAINS},
        "long_gaps": _LONG_GAPS,
    }
    default_preset = "repaired"
    option_choices = {"premise": ("frozen", "live", "estimated")}

    def __init__(self, premise: Premise = "frozen") -> None:
        require_chosen(self.name, self.option_choices, premise=premise)
        self.premise = premise
        if premise == "frozen":
            self.estimator_memory = (
                memory("vertex_weight", "1", 1.0, "Weight h_1 of the first vertex at the last balise"),
            )
        super().__init__(premise=premise)

    def vertex_weight(self, x: Any, u: Any, p: Any) -> Array:
        """Weight h_1 of the first vertex in use [1]."""
        if self.premise == "frozen":
            return x.vertex_weight
        return self._weight_at(u.odometer if self.premise == "live" else x.estimated_speed, p)

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        speed, innovation = x.estimated_speed, x.balise_innovation
        h = self.vertex_weight(x, u, p)
        vertex_speed = _blend(h, (p.premise_min, p.premise_max))
        odometer_error = speed - u.odometer
        on_position = (
            _blend(h, p.balise_gain_position) * innovation + _blend(h, p.odometer_gain_position) * odometer_error
        )
        on_speed = _blend(h, p.balise_gain_speed) * innovation + _blend(h, p.odometer_gain_speed) * odometer_error
        traction = np.maximum(u.effort, 0.0)  # a negative effort is a brake: see friction
        acceleration = (traction - (p.davis_b + p.davis_c * vertex_speed) * speed) / p.mass
        return {
            POSITION.name: speed - on_position,
            SPEED.name: acceleration - on_speed,
            BALISE_INNOVATION.name: -p.innovation_decay * innovation,
        }

    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        return Estimate(x.estimated_position, x.estimated_speed, u.effort, x.balise_innovation)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """At a balise the innovation is set anew, and the weight is frozen at the odometer reading of that moment."""
        weight = {"vertex_weight": self._weight_at(u.odometer, p)} if self.premise == "frozen" else {}
        return {BALISE_INNOVATION.name: x.estimated_position - u.balise_position} | weight

    def premise_range(self, p: Any) -> tuple[str, float, float]:
        """Input or output that the weights depend on, and the speeds of the vertices [m/s], between which they are
        exact.
        """
        signal = "speed" if self.premise == "estimated" else "odometer"
        low, high = sorted((float(p.premise_min), float(p.premise_max)))
        return signal, low, high

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over the two vertices and three mixtures of them; live and estimated weights may change at any
        time.
        """
        vertices = tuple(self._error_at(h, p) for h in (1.0, 0.75, 0.5, 0.25, 0.0))
        slowest, fastest = float(p.premise_min), float(p.premise_max)
        frozen = self.premise == "frozen"
        changes = (
            "constant over a gap, as frozen ones are" if frozen else f"changing at any time, {self._span(vertices)}"
        )
        model = (
            f"position and speed error at both vertices ({slowest:g} and {fastest:g} m/s) and three mixtures, weights "
            f"{changes}; standstill, slip and the neglected wheel inertia, the latter inputs to it, are left out"
        )
        return certify_sampled_error(vertices, gap, model, switching=not frozen)

    def alternative(self, gap: float, p: Any, evaluate: Evaluate) -> str | None:
        """A decay that is consistent with the balise gains in use, else the largest high gain that is certified."""
        consistent = round(float(p.balise_gain_position[0]), 1)
        if consistent > 0.0 and evaluate({"innovation_decay": consistent}).holds:
            return f"innovation_decay = {consistent:g} is certified for {gap:.3g} s"
        gains = certified_gains(gap, balise_family, evaluate)
        if gains is None:
            return None
        position, speed = gains["balise_gain_position"], gains["balise_gain_speed"]
        return (
            f"innovation_decay = balise_gain_position = {position:g}, balise_gain_speed = {speed:g} and odometer gains "
            f"of 0 are certified for {gap:.3g} s"
        )

    def _error_at(self, h: float, p: Any) -> SampledError:
        # Estimated weights multiply the estimate's own error too: c (v^2 - w^2) has the slope c (v + w), twice the
        # vertex's.
        doubled = 2.0 if self.premise == "estimated" else 1.0
        slope = (p.davis_b + doubled * p.davis_c * _blend(h, (p.premise_min, p.premise_max))) / p.mass
        drift = [
            [0.0, 1.0 - _blend(h, p.odometer_gain_position)],
            [0.0, -slope - _blend(h, p.odometer_gain_speed)],
        ]
        gain = (_blend(h, p.balise_gain_position), _blend(h, p.balise_gain_speed))
        return SampledError.of(drift, gain, float(p.innovation_decay))

    @staticmethod
    def _span(vertices: Sequence[SampledError]) -> str:
        """By how much the weights move the error equations, in words."""
        slopes = [vertex.drift[1][1] for vertex in vertices]
        on_position, on_speed = zip(*(vertex.gain for vertex in vertices), strict=True)
        spans = [max(values) - min(values) for values in (slopes, on_position, on_speed)]
        return "by {:.1e} 1/s in the slope of the speed error, {:.1e} 1/s and {:.1e} 1/s2 in the balise gains".format(
            *spans
        )

    @staticmethod
    def _weight_at(speed: Array, p: Any) -> Array:
        span = p.premise_max - p.premise_min  # at equal vertices any weight is right
        return np.clip((p.premise_max - speed) / np.where(span == 0.0, 1.0, span), 0.0, 1.0)


def _blend(h: Array, values: Sequence[Array]) -> Array:
    return h * values[0] + (1.0 - h) * values[1]

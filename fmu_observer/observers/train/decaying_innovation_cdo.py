"""High-gain train observer for holes between balises: the innovation of the last one is held and decays to an end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fmu_observer.certificates.decaying_innovation_error import decaying_error
from fmu_observer.certificates.finding import Finding, as_printed, limit_found, to_simulate
from fmu_observer.certificates.gap_error import GapError, first_unstable_gap
from fmu_observer.certificates.limit_search import LimitSearch
from fmu_observer.certificates.printed_bounds.sampled_gain_bounds import decay_bounds
from fmu_observer.design.certified_gains import certified_gains
from fmu_observer.formulas.correction.innovation_decay import ELAPSED, correction, decay_parameters, innovation_left
from fmu_observer.models.observer_model import shift_matrix
from fmu_observer.observers.evaluated_observer import Evaluate
from fmu_observer.observers.train.high_gain_observer import TOP_SPEED, HighGainTrainObserver
from fmu_observer.observers.train.train_resistance import drag_slope_range
from fmu_observer.observers.train.train_signals import POSITION, SPEED
from plant_models.hybrid import Array, Signal, memory, scalar_names

_RUN_SPEED, _RUN_ERROR = 20.0, 5.0  # [m/s], [m] of the start; a tenth of it in m/s
_LONGEST_HOLE = 100.0  # [s]
_DECAY_OVER_THETA = 1.25  # [ours]; at a = 0.5 and K = (2, 1) 85 % of a position error seen is corrected


class DecayingInnovationCdo(HighGainTrainObserver):
    """High-gain observer of a train whose balise innovation decays by ``phi' = -eta phi^a``: Hann 2014, (3.72).

    ``dp = v - theta K1 phi eps``, ``dv = (F - a sgn(v) - b v - c v|v|)/M - theta^2 K2 phi eps``, ``eps = p -
    balise_position`` held from the balise, phi = 1 there. The applied effort stands for the adhesion force, so slip of
    the wheels does not bias it. Of an innovation eps the position gets the share ``theta K1/((2 - a) eta)`` and the
    speed ``theta^2 K2/((2 - a) eta)`` 1/s times it, and both are done ``1/((1 - a) eta)`` after the balise: in a hole
    the train runs on the model, whatever the length of the hole. With a = 1 and ``eta = theta K1`` it is the correction
    of the other high-gain observers, with ``eta = 0`` the constant gain of (3.112), for which holes may last ``1 /
    theta`` only.

    Preset `balise_holes` [ours]: for holes up to 32 s; the innovation ends 13 s after the balise.
    """

    name = "decaying_innovation_cdo"
    description = "High-gain continuous-discrete observer, balise innovation held and decaying to an end"
    source = "Hann 2014, (3.72)-(3.112), on the train of Bouchama 2024, (3.1)-(3.3)"
    innovation_state = ELAPSED
    estimator_memory = (memory("balise_innovation", "m", 0.0, "Position error seen at the last balise"),)
    stability_parameters = ("theta", "high_gain", "decay_rate", "decay_exponent")
    presets = {
        "dense_balises": {},
        "balise_holes": {"theta": 0.12, "decay_rate": 0.15},
    }
    default_preset = "dense_balises"

    def gain_parameters(self) -> tuple[Signal, ...]:
        return (*super().gain_parameters(), *decay_parameters(10.0, 0.5))

    def acting_innovation(self, x: Any, p: Any) -> Array:
        """What is left of the innovation of the last balise [m]."""
        return innovation_left(x.elapsed, p.decay_rate, p.decay_exponent) * x.balise_innovation

    def innovation_flow(self, x: Any, p: Any) -> Array:
        """Time goes on, 1 s/s."""
        return 1.0

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """At a balise the innovation is set anew; position and speed stay continuous."""
        return super().update(event, t, x, u, p) | {ELAPSED.name: 0.0}

    def alternative(self, gap: float, p: Any, evaluate: Evaluate) -> str | None:
        """The largest theta that is certified with a decay that fits it."""
        rule = lambda theta: {self.theta_name: theta, "decay_rate": _DECAY_OVER_THETA * theta}  # noqa: E731
        gains = certified_gains(gap, rule, evaluate)
        if gains is None:
            return None
        words = " and ".join(f"{name} = {value:g}" for name, value in gains.items())
        return f"{words} are certified for {gap:.3g} s"

    def vertex_error(self, drift: Sequence[Sequence[float]], p: Any) -> GapError:
        """Error equations of position and speed between two balises, for one drag slope in `drift`, shape (2, 2)."""
        gain = np.array(correction(float(p.theta), p.high_gain, 1.0), dtype=float)[:, None]
        rate, exponent = float(p.decay_rate), float(p.decay_exponent)
        return decaying_error(np.array(drift), gain, np.array([[1.0, 0.0]]), rate, exponent, (0, 1))

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """How long a hole may last: (3.109), the exact limit, and runs beside a train at 20 m/s.

        Args:
            values: of all parameters, shape (k,).
        """
        what, p = "gap between balises", self.unpack_parameters(values)
        K, slope = np.array(p.high_gain, dtype=float)[:, None], float(max(drag_slope_range(p, 0.0, TOP_SPEED)))
        printed = decay_bounds(shift_matrix(2), K, np.eye(1, 2), float(p.theta), float(p.decay_rate), slope).longest_gap
        premise = f"tau_MASP, sigma to zero, if theta is above 1 1/s; L = {slope:.3g} 1/s, the steepest drag slope"
        yield as_printed(what, printed, premise, "Hann 2014, (3.109)")
        exact = first_unstable_gap(self.vertices(p), _LONGEST_HOLE)
        test = "first gap at which the error grows from balise to balise, at the drag slope of one speed"
        yield limit_found(what, exact, _LONGEST_HOLE, test)
        high = min(2.0 * exact, _LONGEST_HOLE)
        if high > 0.0:
            yield to_simulate(self._search(high, values), what)

    def _search(self, high: float, values: np.ndarray) -> LimitSearch:
        p = self.unpack_parameters(values)
        effort = float(p.davis_a + p.davis_b * _RUN_SPEED + p.davis_c * _RUN_SPEED**2)
        known = dict(zip(scalar_names(self.parameter_signals), map(float, values), strict=True))
        return LimitSearch(
            system=self,
            varied="period",
            low=high / 50.0,
            high=high,
            event="balise",
            payload=lambda t: {"position": _RUN_SPEED * t},
            inputs=lambda t: {"effort": effort + 0.0 * t, "odometer": _RUN_SPEED + 0.0 * t},
            truth=lambda t: {"position": _RUN_SPEED * t, "speed": _RUN_SPEED + 0.0 * t},
            settings={**known, POSITION.name: _RUN_ERROR, SPEED.name: _RUN_SPEED + 0.1 * _RUN_ERROR},
            stop=30.0 * high,
        )

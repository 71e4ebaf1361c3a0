"""S5: discrete unknown-input observer with the wheel slip as an unknown input; continuous between its samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sample_products import TwoRateError, certify_two_rate_error
from fmu_observer.design.uio_design import uio_matrices
from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.train.train_observer import Estimate, TrainObserver
from fmu_observer.observers.train.train_signals import LAST_INNOVATION, POSITION
from plant_models.hybrid import Array, parameter, state

# Steady-state Kalman gains for the drag slope of the default train, rounded to five digits; a test recomputes them.
_ODOMETER_GAIN = (0.0, 0.41889, 0.0, 1.13024, 0.0, 1.52461)
_BALISE_GAIN = (0.94689, 0.0, 1.17481, 0.0, 0.7288, 0.0)
ORDER = 6


class DiscreteUio(TrainObserver):
    """Unknown-input observer of six states at two sampling rates: Bouchama 2024, (3.88)-(3.91).

    ``x = [p, y, d1, d2, d1', d2']``: position, odometer speed, slip speed ``v - y``, acceleration disturbance, and
    their rates; ``dp = y + d1``, ``dy = -(b + c v_lin) y / M + d2 + u / M``, ``d1'' = d2'' = 0``, ``u = effort - a``;
    the speed is ``y + d1``.
    Corrections: ``x -= K_o (y - odometer)`` at every odometer sample, ``x -= K_b (p - balise_position)`` at a balise.

    The model flows continuously between samples, which equals the printed A_d, B_d at each of them, so that a balise
    acts at its own stamp. The printed matrix has the slip disturbance in the wrong column (see `uio_design`). The gains
    are not printed: ours are steady-state Kalman gains for white second derivatives of d1 (0.1 m2/s5) and d2 (0.1
    m2/s7), 5 cm/s on an odometer reading every 0.1 s and 10 cm on a balise every second.
    It leans on the odometer: while the wheels of a locomotive spin its position is off by metres, and true balises may
    lie outside the gate, which then finds its way back by the ones that follow.

    The adhesion force [ours] is ``effort - (J / r^2) dy``, the wheelset's balance.
    """

    name = "discrete_uio"
    description = "Discrete unknown-input observer, slip and acceleration disturbance as unknown inputs"
    source = "Bouchama 2024, (3.88)-(3.91)"
    estimator_states = (
        POSITION,
        state("odometer_speed", "m/s", 1.0, "Estimate of the odometer speed y"),
        state("slip_speed", "m/s", 0.0, "Estimate of the slip speed d1 = v - y"),
        state("disturbance", "m/s2", 0.0, "Estimate of the acceleration disturbance d2 of the wheel"),
        state("slip_speed_rate", "m/s2", 0.0, "Rate of d1"),
        state("disturbance_rate", "m/s3", 0.0, "Rate of d2"),
    )
    estimator_memory = (LAST_INNOVATION,)
    estimator_parameters = (
        parameter("linearisation_speed", "m/s", 50.0 / 3.6, "Speed at which the drag slope is taken", min=0.0),
        parameter("odometer_period", "s", 0.1, "Sampling period of the odometer", min=1e-4),
        parameter("odometer_gain", "1", _ODOMETER_GAIN, "Gain K_o per odometer sample, state i per m/s", size=ORDER),
        parameter("balise_gain", "1", _BALISE_GAIN, "Gain K_b per balise, state i per m", size=ORDER),
    )
    estimator_events = (ODOMETER_SAMPLE,)
    stability_parameters = ("linearisation_speed", "odometer_period", "odometer_gain", "balise_gain")

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """``A x + B u``, with the Davis constant turned off smoothly below slip_floor."""
        speed = x.odometer_speed
        at_rest = np.clip(speed / p.slip_floor, -1.0, 1.0)
        acceleration = (u.effort - p.davis_a * at_rest) / p.mass - _drag_slope(p) * speed + x.disturbance
        rates = (speed + x.slip_speed, acceleration, x.slip_speed_rate, x.disturbance_rate, 0.0, 0.0)
        return named_as(self.estimator_states, rates)

    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        """Position, ``v = y + d1``, adhesion force from the wheelset, and the innovation of the last balise."""
        wheel_acceleration = self.estimator_flow(0.0, x, u, p)["odometer_speed"]
        adhesion = u.effort - p.n_axles * p.wheel_inertia / p.wheel_radius**2 * wheel_acceleration
        return Estimate(x.estimated_position, x.odometer_speed + x.slip_speed, adhesion, x.last_innovation)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Correction by a balise or by an odometer sample."""
        if event == "balise":
            innovation = x.estimated_position - u.balise_position
            return self._corrected(x, p.balise_gain, innovation) | {"last_innovation": innovation}
        return self._corrected(x, p.odometer_gain, x.odometer_speed - u.odometer)

    def _corrected(self, x: Any, gain: Array, innovation: Array) -> dict[str, Array]:
        estimate = stacked_of(x, self.estimator_states)
        return named_as(self.estimator_states, (estimate[i] - gain[i] * innovation for i in range(ORDER)))

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over the products of per-sample updates with and without a balise."""
        A, _ = uio_matrices(float(p.mass), float(_drag_slope(p)))
        error = TwoRateError(
            tuple(map(tuple, A.tolist())),
            tuple(map(float, p.odometer_gain)),
            tuple(map(float, p.balise_gain)),
            1,
            0,
            float(p.odometer_period),
        )
        model = (
            f"six-state error of the observer's own linear model (drag slope at {float(p.linearisation_speed):.4g} "
            f"m/s) with "
            "odometer samples at their period and the balise at any phase between them; the difference of the true "
            "drag, an input to it, and the constant resistance near standstill are left out"
        )
        return certify_two_rate_error(error, gap, model)


def _drag_slope(p: Any) -> Array:
    return (p.davis_b + p.davis_c * p.linearisation_speed) / p.mass

"""Observers with a held odometer whose gain follows the estimated speed, or the reading."""

from __future__ import annotations

from typing import Any

from fmu_observer.observers.train.held_odometer_error import gain_level, gain_norm
from fmu_observer.observers.train.held_odometer_observer import HeldOdometerObserver
from plant_models.hybrid import Array


class DiscreteMeasurementObserver(HeldOdometerObserver):
    """DMO: ``K = K(y_k)``, constant between samples: Aguiar Cota 2019, (4.1)-(4.19).

    What it observes, and the bounds it states, stand at `HeldOdometerObserver`. Its bounds use the gain in use, where
    those of `ContinuousDiscreteObserver` need the largest one.

    Presets: `as_published`, set C with the gain printed in 4.3.4, and `as_published_set_d` with that of 5.4; `m_0_5_
    alpha_100` and six more, the feasible designs of Table 4.1; `repaired` (default), the fastest of these gains for the
    train of this package, its schedule with the sign that cancels the drag, and unknown inputs in the bound.
    """

    name = "discrete_measurement_observer"
    description = "Discrete-measurement observer (DMO): held odometer reading, error bound between samples"

    def scheduling_speed(self, x: Any) -> Array:
        """The reading [m/s]."""
        return x.held_speed

    def largest_gain_level(self, x: Any, p: Any) -> Array:
        """Level of the gain in use [1/s]."""
        return gain_level(p, x.held_speed)

    def largest_gain_norm(self, x: Any, p: Any) -> Array:
        """Norm of the gain in use [1/s]."""
        return gain_norm(p, x.held_speed)


class ContinuousDiscreteObserver(HeldOdometerObserver):
    """CDO: ``K = K(v_estimated(t))``, which runs between samples: Aguiar Cota 2019, (4.22)-(4.40).

    What it observes, and the bounds it states, stand at `HeldOdometerObserver`; they use the largest gain of all speeds
    from 0 to `speed_max`, in which the estimate must stay. With a gain that follows no speed (`davis_c` or
    `gain_schedule` zero, as in 4.3.4) it is the same observer as `DiscreteMeasurementObserver`.

    Presets: those of `DiscreteMeasurementObserver`.
    """

    name = "continuous_discrete_observer"
    description = "Continuous-discrete observer (CDO): held odometer reading, gain by the estimate, error bound"

    def scheduling_speed(self, x: Any) -> Array:
        """The estimated speed [m/s]."""
        return x.estimated_speed

    def largest_gain_level(self, x: Any, p: Any) -> Array:
        """Largest level at speeds from 0 to `speed_max` [1/s]."""
        return gain_level(p, 0.0, p.speed_max)

    def largest_gain_norm(self, x: Any, p: Any) -> Array:
        """Largest norm at speeds from 0 to `speed_max` [1/s]."""
        return gain_norm(p, 0.0, p.speed_max)

"""Base of the train observers: the signals, the slip part and the question of stability that they share.

It knows the single-mass train (mass, Davis resistance, wheelset) and nothing of how an observer corrects itself.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.certificates import Certificate
from fmu_observer.detection.slip_indicator import (
    FILTERED_SLIP,
    SLIP_OUTPUTS,
    SLIP_PARAMETERS,
    indicator_level,
    slip_filter_derivative,
)
from fmu_observer.detection.slip_ratio import odometer_slip
from plant_models.hybrid import (
    HybridSystem,
    PeriodicEvent,
    Signal,
    TriggeredEvent,
    input_signal,
    output_signal,
    parameter,
    state,
    vector,
)
from plant_models.hybrid.system import Array

POSITION = state("estimated_position", "m", 0.0, "Estimate of the train position")
SPEED = state("estimated_speed", "m/s", 1.0, "Estimate of the train speed")
BALISE_INNOVATION = state("balise_innovation", "m", 0.0, "Position error seen at the last balise, decaying since")
BALISE = TriggeredEvent(
    "balise",
    (input_signal("balise_position", "m", 0.0, "Position of the balise just passed", variability="discrete"),),
    "A balise is passed, at its own time stamp",
)

Value = float | Sequence[float]


class Estimate(NamedTuple):
    """What a train observer believes: position [m], speed [m/s], adhesion force [N], balise innovation [m]."""

    position: Array
    speed: Array
    adhesion_force: Array
    innovation: Array


class TrainObserver(HybridSystem):
    """Base of the observers of a train ``dp = v``, ``M dv = F_ad - a sgn(v) - b v - c v|v|`` (Bouchama 2024, (3.1)-(3.3)).

    The contract:

    1. A subclass sets `estimator_states` (continuous), `estimator_memory`, `estimator_parameters` and `estimator_events`;
       the state is laid out as estimator states, filtered slip, memory.
    2. It writes `estimator_flow` (derivatives of the estimator states), `estimate`, `jump` and `error_certificate`.
    3. `certify` answers whether the very gains in use are stable for balise gaps up to a given length.
    4. Where the speed is a state, the Davis constant and a negative adhesion force (a brake) are dry friction: they stop the
       observed train and hold it, and never push it backwards. For a speed above zero that is the thesis's equation.
    5. Estimates start at position 0 and speed 1 m/s, the deliberately wrong start of the thesis.
    """

    estimator_states: tuple[Signal, ...] = ()
    estimator_memory: tuple[Signal, ...] = ()
    estimator_parameters: tuple[Signal, ...] = ()
    estimator_events: tuple[PeriodicEvent, ...] = ()
    stability_parameters: ClassVar[tuple[str, ...]] = ()

    inputs = (
        input_signal("effort", "N", 0.0, "Applied effort at the wheel rim: traction positive, brake negative"),
        input_signal("odometer", "m/s", 0.0, "Odometer speed r w"),
    )
    outputs = (
        output_signal("position", "m", "Estimated position"),
        output_signal("speed", "m/s", "Estimated speed", display_unit="km/h"),
        *SLIP_OUTPUTS,
        output_signal("adhesion_force", "N", "Estimated adhesion force between wheels and rails"),
        output_signal("innovation", "m", "Estimated minus true position at the last balise, as it acts now"),
    )
    train_parameters = (
        parameter("mass", "kg", 90000.0, "Train mass", min=1.0),
        parameter("davis_a", "N", 900.0, "Running resistance, constant term", min=0.0),
        parameter("davis_b", "N.s/m", 32.4, "Running resistance, linear term", min=0.0),
        parameter("davis_c", "N.s2/m2", 1.65287, "Running resistance, quadratic term", min=0.0),
        parameter("wheel_radius", "m", 0.575, "Wheel radius", min=1e-3),
        parameter("wheel_inertia", "kg.m2", 225.0, "Rotating inertia of one axle", min=1e-3),
        parameter("n_axles", "1", 1.0, "Number of motored axles: 1 as printed in the thesis, 4 on the BB 27000", min=1.0),
    )

    def __init__(self, **options: Any) -> None:
        self.states = (*self.estimator_states, FILTERED_SLIP, *self.estimator_memory)
        self.parameters = (*self.train_parameters, *SLIP_PARAMETERS, *self.estimator_parameters)
        self.events = (BALISE, *self.estimator_events)
        super().__init__(**options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def estimator_flow(self, t: Array, x: Array, u: Any, p: Any) -> tuple[Array, ...]:
        """Derivatives of the estimator states, one scalar each, in their order."""

    @abstractmethod
    def estimate(self, x: Array, u: Any, p: Any) -> Estimate:
        """Position, speed, adhesion force and innovation."""

    @abstractmethod
    def error_certificate(self, max_gap: float, p: Any) -> Certificate:
        """Certificate of the estimation error for balise gaps up to `max_gap` [s], gains from the named tuple `p`."""

    # -- what follows -----------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Derivatives of the estimator states and of the filtered slip, shape (nc,)."""
        filtered = x[self.continuous_count - 1]
        slip = odometer_slip(u.odometer, self.estimate(x, u, p).speed, p.slip_floor)
        return vector(*self.estimator_flow(t, x, u, p), slip_filter_derivative(filtered, slip, p.slip_filter_time))

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """The estimate with its slip and indicator."""
        estimate = self.estimate(x, u, p)
        filtered = x[self.continuous_count - 1]
        return estimate._asdict() | {
            "slip": odometer_slip(u.odometer, estimate.speed, p.slip_floor),
            "slip_indicator": indicator_level(filtered, u.odometer, estimate.speed, p.slip_threshold, p.slip_min_speed),
        }

    def friction(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Davis constant and brake as dry friction on the speed, ``(a + max(-F_ad, 0)) / M`` [m/s2], shape (len(frictions),)."""
        if not self.frictions:
            return np.zeros(0)
        return vector((p.davis_a + np.maximum(-self.estimate(x, u, p).adhesion_force, 0.0)) / p.mass)

    def certify(self, max_gap: float, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> Certificate:
        """Exact stability check of the gains in use for balise gaps up to `max_gap`.

        Args:
            max_gap: longest expected time between two balises [s].
            parameters: values by name that replace those of the preset, scalars or whole vectors (``theta``,
                ``balise_gain_speed[1]``, ``balise_gain_speed``).
            preset: preset to start from; by default the observer's own default.

        Returns:
            The certificate; ask its `holds` and `explain()`.

        Raises:
            ValueError: the gap is not positive and finite, a parameter is unknown, not finite or of another size, or the preset
                is unknown.
        """
        if not (isfinite(max_gap) and max_gap > 0.0):
            raise ValueError(f"{self.name}: max_gap must be positive and finite [s], got {max_gap!r}.")
        values = self._parameter_values(parameters or {}, preset)
        certificate = self.error_certificate(float(max_gap), self.unpack_parameters(values))
        chosen = preset or self.default_preset or "declared starts"
        return replace(certificate, observer=self.name, preset=chosen, parameters=self._stability_values(values))

    # -- internals --------------------------------------------------------------------------------------------------

    def _parameter_values(self, overrides: Mapping[str, Value], preset: str | None) -> np.ndarray:
        values = self.start_parameters(preset)
        names = [name for signal in self.parameter_signals for name in signal.scalar_names]
        vectors = {signal.name: signal.scalar_names for signal in self.parameter_signals}
        for name, value in overrides.items():
            targets = (name,) if name in names else vectors.get(name)
            if targets is None:
                raise ValueError(f"{self.name}: unknown parameter {name!r} to certify; it has: {', '.join(vectors)}.")
            elements = np.asarray(value, dtype=float)
            if elements.size not in (1, len(targets)) or not np.all(np.isfinite(elements)):
                raise ValueError(
                    f"{self.name}: parameter {name!r} to certify needs {len(targets)} finite number(s), got {value!r}."
                )
            values[[names.index(target) for target in targets]] = elements
        return values

    def _stability_values(self, values: np.ndarray) -> tuple[tuple[str, float], ...]:
        named = self.unpack_parameters(values)
        chosen = [s for s in self.parameter_signals if s.name in self.stability_parameters]
        return tuple(
            (name, float(value))
            for signal in chosen
            for name, value in zip(signal.scalar_names, np.atleast_1d(getattr(named, signal.name)), strict=True)
        )

"""Runners of observers: named access to a runtime, and a train whose motion is known in closed form."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fmu_observer.observers.train import DifferentiatorCdo, DiscreteUio, MultirateCdo, TakagiSugenoCdo, TrainObserver
from plant_models.hybrid import HybridSystem, NumpyKernel, Runtime, scalar_names

MASS, DAVIS_A, DAVIS_B, DAVIS_C, RADIUS, INERTIA = 90000.0, 900.0, 32.4, 1.65287, 0.575, 225.0

TRAIN_OBSERVERS = {
    "differentiator_cdo": DifferentiatorCdo,
    "takagi_sugeno_cdo": TakagiSugenoCdo,
    "takagi_sugeno_cdo live": lambda: TakagiSugenoCdo(premise="live"),
    "takagi_sugeno_cdo estimated": lambda: TakagiSugenoCdo(premise="estimated"),
    "multirate_cdo": MultirateCdo,
    "discrete_uio": DiscreteUio,
}


@dataclass(frozen=True)
class SteadyMotion:
    """A train at constant acceleration, rolling wheels, and the effort that makes it so."""

    speed: float = 20.0
    acceleration: float = 0.0
    n_axles: float = 1.0
    slip_speed: float = 0.0  # odometer minus train speed

    def v(self, t: float) -> float:
        return self.speed + self.acceleration * t

    def position(self, t: float) -> float:
        return self.speed * t + 0.5 * self.acceleration * t * t

    def odometer(self, t: float) -> float:
        return self.v(t) + self.slip_speed

    def adhesion_force(self, t: float) -> float:
        v = self.v(t)
        return MASS * self.acceleration + DAVIS_A + DAVIS_B * v + DAVIS_C * v * v

    def effort(self, t: float) -> float:
        return self.adhesion_force(t) + self.n_axles * INERTIA / RADIUS**2 * self.acceleration


class SystemRunner:
    """A runtime whose signals, states and parameters are reached by name."""

    def __init__(
        self, system: HybridSystem, *, python: bool = False, preset: str | None = None, **parameters: float
    ) -> None:
        self.system = system
        self.runtime = Runtime(system, NumpyKernel(system) if python else None)
        self._names = {
            "u": scalar_names(system.input_signals),
            "x": scalar_names(system.states),
            "y": scalar_names(system.outputs),
            "p": scalar_names(system.parameter_signals),
        }
        self.runtime.p[:] = system.start_parameters(preset)
        self.set("p", parameters)

    def set(self, group: str, values: dict[str, float]) -> None:
        for name, value in values.items():
            getattr(self.runtime, group)[self._names[group].index(name)] = value

    def state(self, name: str) -> float:
        return float(self.runtime.x[self._names["x"].index(name)])

    def outputs(self) -> dict[str, float]:
        return dict(zip(self._names["y"], map(float, self.runtime.update_outputs()), strict=True))

    def balise(self, position: float) -> None:
        self.set("u", {"balise_position": position})
        self.runtime.trigger("balise")

    def follow(self, motion: SteadyMotion, gaps: Iterable[float], feed: float | None = None) -> None:
        """Run with a balise after each gap; inputs are renewed every `feed` seconds, by their value in mid-interval."""
        for gap in gaps:
            end = self.runtime.t + gap
            while self.runtime.t < end - 1e-12:
                stop = end if feed is None else min(end, self.runtime.t + feed)
                middle = 0.5 * (self.runtime.t + stop)
                self.set("u", {"effort": motion.effort(middle), "odometer": motion.odometer(middle)})
                self.runtime.advance(stop)
            self.set("u", {"odometer": motion.odometer(end)})
            self.balise(motion.position(end))


def started(system: HybridSystem, motion: SteadyMotion, **arguments: object) -> SystemRunner:
    """A runner at time zero with the motion's inputs."""
    runner = SystemRunner(system, **arguments)  # type: ignore[arg-type]
    runner.set("u", {"effort": motion.effort(0.0), "odometer": motion.odometer(0.0)})
    runner.runtime.start(0.0)
    return runner


def in_step(observer: TrainObserver, motion: SteadyMotion) -> SystemRunner:
    """A runner whose observer already agrees with a motion at constant speed, so that every error is put in on purpose.

    Its gate is off: what is certified is the error while every telegram is used.
    """
    runner = SystemRunner(observer, gate=0.0)
    v = motion.speed
    exact = {
        "estimated_position": 0.0,
        "estimated_speed": v,
        "wheel_rate": v / RADIUS,
        "wheel_speed_estimate": v,
        "adhesion_deceleration": -(RADIUS**2) / INERTIA * motion.effort(0.0),
        "odometer_speed": v,
    }
    runner.set("x", {name: value for name, value in exact.items() if name in scalar_names(observer.states)})
    runner.set("u", {"effort": motion.effort(0.0), "odometer": motion.odometer(0.0)})
    return runner


def random_gaps(seed: int, longest: float, count: int) -> np.ndarray:
    """Aperiodic gaps, uniform in [0.2, 1] of the longest."""
    return np.random.default_rng(seed).uniform(0.2, 1.0, count) * longest

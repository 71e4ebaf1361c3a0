"""Situations: for any registered observer a plant that it believes in, and what it measures there. No noise, no model
error.

A situation knows the true outputs at any time, the inputs at any time and the payload of any event, all by name. It is
made from the observer's own declarations, so that a new observer needs no entry here unless it is of a new kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from observer_runner import SteadyMotion
from scipy.integrate import solve_ivp
from shipped import shipped

from fmu_observer import OBSERVERS
from fmu_observer.observers.generic.adaptive.adaptive_observer import AdaptiveObserver
from fmu_observer.observers.generic.differentiators.signal_differentiator import SignalDifferentiator
from fmu_observer.observers.generic.sampled import GeneralTakagiSugenoCdo
from fmu_observer.observers.model_observer import ModelObserver
from fmu_observer.observers.train import TrainObserver
from plant_models.hybrid import HybridSystem, Runtime, Signal, scalar_names

Values = dict[str, float]
HORIZON = 40.0


@dataclass(frozen=True)
class Situation:
    """A motion as an observer sees it.

    Args:
        system: the observer. truth: true outputs by name at a time, those that are known. inputs: continuous inputs at
        a time.
        payload: payload of an event at a time, by name. gap: time between two events that suits it [s].
        left: part of the first error that may stay: what its discretisation costs.
    """

    system: HybridSystem
    truth: Callable[[float], Values]
    inputs: Callable[[float], Values]
    payload: Callable[[str, float], Values]
    gap: float
    left: float = 1e-2


class Follower:
    """An observer run through a situation."""

    def __init__(self, situation: Situation, feed: float = 0.002) -> None:
        self.situation, self.feed = situation, feed
        self.runtime = Runtime(situation.system)
        self._u = {name: i for i, name in enumerate(scalar_names(situation.system.input_signals))}
        self._y = {name: i for i, name in enumerate(scalar_names(situation.system.outputs))}

    def start(self) -> Follower:
        self._set(self.situation.inputs(0.0))
        self.runtime.start(0.0)
        return self

    def advance(self, until: float) -> None:
        """Inputs are those in the middle of each little step, so that holding them costs the second order only."""
        count = max(1, round((until - self.runtime.t) / self.feed))
        for t in np.linspace(self.runtime.t, until, count + 1)[1:]:
            self._set(self.situation.inputs(0.5 * (self.runtime.t + float(t))))
            self.runtime.advance(float(t))

    def happen(self, event: str) -> None:
        self._set(self.situation.payload(event, self.runtime.t))
        self.runtime.trigger(event)

    def follow(self, gaps: Iterable[float], skip: Callable[[int], bool] = lambda _: False) -> None:
        """Run through gaps; at the end of each all triggered events happen, but for those skipped."""
        for k, gap in enumerate(gaps):
            self.advance(self.runtime.t + gap)
            if not skip(k):
                for event in self.situation.system.triggered_events:
                    self.happen(event.name)

    def errors(self) -> Values:
        y = self.runtime.update_outputs()
        return {name: float(y[self._y[name]]) - value for name, value in self.situation.truth(self.runtime.t).items()}

    def error(self) -> float:
        return float(np.linalg.norm(list(self.errors().values())))

    def _set(self, values: Values) -> None:
        for name, value in values.items():
            self.runtime.u[self._u[name]] = value


def situation(name: str) -> Situation | None:
    """The situation of a registered observer, or None where it is no observer (a detector)."""
    system = shipped(name)
    for kind, make in KINDS.items():
        if isinstance(system, kind):
            return make(system)
    return None


@cache
def observers() -> dict[str, Situation]:
    """All registered observers by name."""
    found = {name: situation(name) for name in OBSERVERS}
    return {name: s for name, s in found.items() if s is not None}


def _known(model: Any) -> np.ndarray:
    """Inputs of a model: constant, as discrete observers hold them over a sample."""
    return np.array([0.3 / (1 + i) for i in range(len(model.inputs))])


def _motion(model: Any, start: np.ndarray) -> Callable[[float], np.ndarray]:
    u = _known(model)

    @cache  # solved when it is first asked for: situations are made while tests are collected
    def solution() -> Any:
        flow = lambda _t, x: np.asarray(model.flow(x, u), dtype=float)  # noqa: E731
        return solve_ivp(flow, (0.0, HORIZON), start, rtol=1e-10, atol=1e-12, dense_output=True).sol

    return lambda t: np.asarray(solution()(t))


def _named(signals: Sequence[Signal], values: Any, prefix: str = "") -> Values:
    return {f"{prefix}{s.name}": float(v) for s, v in zip(signals, np.asarray(values), strict=True)}


def _of_model(system: Any) -> Situation:
    model = system.model
    x = _motion(model, np.array([float(s.start_values[0]) for s in model.states]) + 0.5)
    continuous = {s.name for s in system.inputs}
    delay = next((float(s.start) for s in system.parameters if s.name == "delay"), 0.0)

    def inputs(t: float) -> Values:
        measured = _named(model.measurements, model.measured(x(t)), "measured_")
        return _named(model.inputs, _known(model)) | {n: v for n, v in measured.items() if n in continuous}

    def payload(event: str, t: float) -> Values:
        named = _named(model.measurements, model.measured(x(max(t - delay, 0.0))), f"{event}_")
        declared = next(e for e in system.triggered_events if e.name == event).payload
        return {s.name: named[s.name] for s in declared if s.name in named}  # a number of a node is left at its start

    return Situation(system, lambda t: _named(model.states, x(t)), inputs, payload, model.sample_period)


def _of_takagi_sugeno(system: Any) -> Situation:
    model = system.model
    x = _motion(model, model.start + 0.5)

    def inputs(t: float) -> Values:
        measured = _named(model.continuous, model.C_continuous @ x(t), "measured_")
        return _named(model.inputs, _known(model)) | measured

    def payload(event: str, t: float) -> Values:
        return _named(model.sampled, model.C_sampled @ x(t), f"{event}_")

    return Situation(system, lambda t: _named(model.states, x(t)), inputs, payload, model.max_gap)


def _of_train(system: Any) -> Situation:
    motion = SteadyMotion(speed=12.0, acceleration=0.05)
    return Situation(
        system,
        lambda t: {"position": motion.position(t), "speed": motion.v(t)},
        lambda t: {"effort": motion.effort(t), "odometer": motion.odometer(t)},
        lambda event, t: {f"{event}_position": motion.position(t)},
        0.3,
    )


def _of_differentiator(system: Any) -> Situation:
    """A sine. A sliding mode stays within a power of L times its step; the coarsest of them, sampled at 10 ms, within
    0.1.
    """

    def truth(t: float) -> Values:
        return _named(system.outputs, [np.sin(t + 0.5 * np.pi * i) for i in range(len(system.outputs))])

    return Situation(system, truth, lambda t: {"signal": float(np.sin(t))}, lambda _event, _t: {}, 0.1, left=0.1)


def _of_state_affine(system: Any) -> Situation:
    """The example of its model, excited as far as that goes; a held innovation lives with gaps below 0.096 s."""
    model = system.model
    example = np.array(model.example)
    n, u = model.order, np.array([float(s.start_values[0]) for s in model.inputs])

    @cache
    def solution() -> Any:
        flow = lambda t, x: np.asarray(model.flow(t, x, example[n:], u), dtype=float)  # noqa: E731
        return solve_ivp(flow, (0.0, HORIZON), example[:n], rtol=1e-10, atol=1e-10, dense_output=True, max_step=0.1).sol

    return Situation(
        system,
        lambda t: _named(model.states, solution()(t)),
        lambda _t: _named(model.inputs, u),
        lambda event, t: _named(model.measurements, model.C @ solution()(t), f"{event}_"),
        0.9 * model.sample_period,
    )


KINDS: dict[type[HybridSystem], Callable[[Any], Situation]] = {
    ModelObserver: _of_model,
    TrainObserver: _of_train,
    GeneralTakagiSugenoCdo: _of_takagi_sugeno,
    SignalDifferentiator: _of_differentiator,
    AdaptiveObserver: _of_state_affine,
}

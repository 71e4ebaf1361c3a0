"""What scripts without a scenario share: systems whose signals have names, a plant beside an observer, sampling
instants.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, named_as, stacked_of
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.hybrid import HybridSystem, PeriodicEvent, Runtime, TriggeredEvent, vector
from plant_models.hybrid.signal import input_signal, output_signal, parameter, scalar_names

Seen = Callable[[Mapping[str, Any], Any], Mapping[str, Any]]


class SystemRunner:
    """A runtime whose inputs, states, outputs and parameters are reached by name."""

    def __init__(self, system: HybridSystem, preset: str | None = None, **parameters: float) -> None:
        self.system, self.runtime = system, Runtime(system)
        self._names = {
            "u": scalar_names(system.input_signals),
            "x": scalar_names(system.states),
            "y": scalar_names(system.outputs),
            "p": scalar_names(system.parameter_signals),
        }
        self.runtime.p[:] = system.start_parameters(preset)
        self.set("p", **parameters)

    def set(self, group: str, **values: float) -> None:
        """Values of inputs ``u``, states ``x`` or parameters ``p``."""
        for name, value in values.items():
            getattr(self.runtime, group)[self._names[group].index(name)] = value

    def outputs(self) -> dict[str, float]:
        """The outputs now."""
        return dict(zip(self._names["y"], map(float, self.runtime.update_outputs()), strict=True))


class ModelPlant(HybridSystem):
    """The plant that an observer model describes, under a state feedback of its true state; outputs are states and
    inputs.
    """

    name, description, source = "model_plant", "A plant that is what its observer believes", "docs/gallery"
    inputs = (input_signal("unused", "1"),)

    def __init__(self, model: ObserverModel, start: Sequence[float], feedback: np.ndarray) -> None:
        self.model, self.feedback = model, feedback
        self.states = tuple(replace(s, start=float(v)) for s, v in zip(model.states, start, strict=True))
        self.outputs = tuple(output_signal(f"true_{s.name}", s.unit) for s in (*model.states, *model.inputs))
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        true = stacked_of(x, self.states)
        return named_as(self.states, self.model.flow(true, -(self.feedback @ true)))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return named_as(self.outputs, (*x, *-(self.feedback @ stacked_of(x, self.states))))


class Together(HybridSystem):
    """Plant and observer as one system, so that continuous outputs reach the observer without delay; outputs are the
    errors.

    Args:
        plant, observer: the observer's first states estimate all states of the plant. seen: inputs of the observer from
            the plant's outputs and the noise, an input of the whole. step: internal step [s]. preset, overrides: of the
            observer.
    """

    name, description, source = "together", "A plant and its observer", "docs/gallery"
    inputs = (input_signal("noise", "1"),)

    def __init__(
        self,
        plant: HybridSystem,
        observer: HybridSystem,
        seen: Seen,
        step: float = 1e-3,
        preset: str | None = None,
        **overrides: Any,
    ) -> None:
        self.plant, self.observer, self.seen, self.order = plant, observer, seen, plant.state_count
        self.internal_step = step
        self._p = observer.unpack_parameters(parameter_values(observer, overrides, preset))
        self._plant_values = (
            plant.unpack_inputs(plant.start_inputs()),
            plant.unpack_parameters(plant.start_parameters()),
        )
        self.states = (*plant.states, *observer.states)
        self._plant_type: Any = namedtuple("PlantStates", [s.name for s in plant.states])
        self.outputs = tuple(output_signal(f"error_{i + 1}", "1") for i in range(self.order))
        periods = [e.period for e in observer.events if isinstance(e, PeriodicEvent)]
        self.parameters = tuple(parameter(name, "s", float(getattr(self._p, name))) for name in periods)
        self.events = tuple(
            replace(e, samples=()) if isinstance(e, PeriodicEvent) else TriggeredEvent(e.name) for e in observer.events
        )
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        moved = self.plant.flow(t, self._of_plant(x), *self._plant_values)
        return moved | self.observer.flow(t, x, self._inputs(t, x, u), self._p)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return self.observer.jump(event, t, x, self._inputs(t, x, u), self._p)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        estimates = self.observer.output(t, x, self._inputs(t, x, u), self._p)
        pairs = zip(self.observer.outputs, self.plant.states, strict=False)
        errors = [estimates[estimate.name] - getattr(x, true.name) for estimate, true in pairs]
        return named_as(self.outputs, errors)

    def _of_plant(self, x: Any) -> Any:
        return self._plant_type._make(getattr(x, name) for name in self._plant_type._fields)

    def _inputs(self, t: Any, x: Any, u: Any) -> Any:
        named = self.seen(self.plant.output(t, self._of_plant(x), *self._plant_values), u.noise)
        return self.observer.unpack_inputs(vector(*(named[s.name] for s in self.observer.input_signals)))


def errors(
    pair: Together,
    stop: float,
    samples: Mapping[str, Sequence[float]] | None = None,
    noise: float = 0.0,
    hold: float = 0.01,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Run plant and observer together.

    Args:
        pair: both. stop: end [s]. samples: instants by event [s]. noise: bound of the uniform noise, renewed every
        `hold` [s].

    Returns:
        Times every `hold`, shape (K,), and errors, shape (K, n).
    """
    runtime, numbers = Runtime(pair), np.random.default_rng(1000 + seed)
    waiting = sorted((t, event) for event, instants in (samples or {}).items() for t in instants if t < stop)
    times, rows = [], []
    runtime.u[0] = numbers.uniform(-noise, noise)
    runtime.start(0.0)
    for k in range(1, round(stop / hold) + 1):
        end = round(k * hold, 9)
        while waiting and waiting[0][0] < end - 1e-9:
            instant, event = waiting.pop(0)
            runtime.advance(instant)
            runtime.trigger(event)
        runtime.advance(end)
        times.append(end)
        rows.append(runtime.update_outputs().copy())
        runtime.u[0] = numbers.uniform(-noise, noise)
    return np.array(times), np.array(rows)


def unless_rounding(value: float, floor: float) -> float | str:
    """The value, or a text where it is so small that it says nothing."""
    return float(value) if value >= floor else f"< {floor:g}"


def sampling(longest: float, stop: float, seed: int = 0, loss: float = np.inf) -> list[float]:
    """Instants [s] with gaps uniform in [0.2, 1] of the longest; after `loss` 15 % of them 1.2 to 2 times longer
    [ours].
    """
    return list(_instants(longest, stop, np.random.default_rng(seed), loss))


def _instants(longest: float, stop: float, numbers: np.random.Generator, loss: float) -> Iterator[float]:
    t = 0.0
    while t < stop:
        yield round(t, 3)
        gap, stretch = longest * numbers.uniform(0.2, 1.0), numbers.uniform(1.2, 2.0)
        t += gap * stretch if t > loss and numbers.random() < 0.15 else gap

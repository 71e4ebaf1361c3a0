"""Academic plant and observer as one hybrid system, so that the continuous output reaches the observer without any
delay.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from fmu_observer.models.observer_model import named_as
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.exhibits import NonTriangularisablePlant, TriangularisablePlant
from plant_models.hybrid import HybridSystem, Runtime, TriggeredEvent, input_signal, output_signal, parameter, vector

PLANTS = {"triangularisable_example": TriangularisablePlant, "non_triangularisable_example": NonTriangularisablePlant}
STEP = 1e-3


class Together(HybridSystem):
    """Plant and observer side by side; the noise v of the continuous output is an input, held between two settings."""

    name = "together"
    inputs = (input_signal("noise", "1"),)
    internal_step = STEP

    def __init__(self, plant: HybridSystem, observer: HybridSystem, overrides: dict[str, Any] | None = None) -> None:
        self.plant, self.observer = plant, observer
        self._parameters = observer.unpack_parameters(parameter_values(observer, overrides))
        self._plant_values = (
            plant.unpack_inputs(plant.start_inputs()),
            plant.unpack_parameters(plant.start_parameters()),
        )
        self.order = plant.state_count
        self.states = (*plant.states, *observer.states)
        self._plant_type: Any = namedtuple("PlantStates", [s.name for s in plant.states])
        self.outputs = tuple(output_signal(f"error_{i + 1}", "1") for i in range(self.order))
        self.parameters = (parameter("unused", "1", 0.0),)
        self.events = (TriggeredEvent("sample"),)
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        moved = self.plant.flow(t, self._of_plant(x), *self._plant_values)
        return moved | self.observer.flow(t, x, self._seen(t, x, u.noise), self._parameters)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return self.observer.jump(event, t, x, self._seen(t, x, u.noise), self._parameters)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        pairs = zip(self.observer.states, self.plant.states, strict=False)
        errors = [getattr(x, estimate.name) - getattr(x, true.name) for estimate, true in pairs]
        return named_as(self.outputs, errors)

    def _of_plant(self, x: Any) -> Any:
        return self._plant_type._make(getattr(x, name) for name in self._plant_type._fields)

    def _seen(self, t: Any, x: Any, noise: Any) -> Any:
        values = self.plant.output(t, self._of_plant(x), *self._plant_values)
        model = self.observer.model  # type: ignore[attr-defined]
        named = {"drive": values["total_drive"]}
        if isinstance(model, TakagiSugenoModel):
            named |= {f"measured_{s.name}": values[s.name] + noise for s in model.continuous}
            named |= {f"sample_{s.name}": values[s.name] for s in model.sampled}
        else:  # every output sampled, the noise on the second one
            named |= {"sample_x1": values["x1"], "sample_x2": values["x2"] + noise}
        return self.observer.unpack_inputs(vector(*(named[s.name] for s in self.observer.input_signals)))


def sampling(tau: float, stop: float, seed: int, loss: float = np.inf) -> np.ndarray:
    """Instants on the grid: gaps uniform in [0.2, 1] tau; after `loss` 15 % of them stretched 1.2 to 2 times [ours]."""
    generator = np.random.default_rng(seed)
    instants, t = [0.0], 0.0
    while t < stop:
        gap = tau * generator.uniform(0.2, 1.0)
        stretched = gap * generator.uniform(1.2, 2.0)
        t += stretched if t > loss and generator.random() < 0.15 else gap
        instants.append(round(t / STEP) * STEP)
    return np.array(instants)


def errors(
    plant: HybridSystem,
    observer: HybridSystem,
    instants: np.ndarray,
    stop: float,
    noise: float = 0.0,
    hold: float = STEP,
    seed: int = 0,
    overrides: dict[str, Any] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Times of shape (K,) and errors of shape (K, n), every 10 ms or every `hold`, noise uniform within +-noise and
    held.
    """
    runtime = Runtime(Together(plant, observer, overrides))
    generator = np.random.default_rng(1000 + seed)
    step = hold if noise else 0.01
    runtime.start(0.0)
    times, rows, waiting = [], [], list(instants)
    for k in range(round(stop / step)):
        runtime.u[0] = generator.uniform(-noise, noise)
        end = round((k + 1) * step, 9)
        while waiting and waiting[0] < end - 1e-9:
            runtime.advance(waiting.pop(0))
            runtime.trigger("sample")
        runtime.advance(end)
        times.append(end)
        rows.append(runtime.update_outputs().copy())
    return np.array(times), np.array(rows)


def final_quarter(times: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Largest and root-mean-square norm of the error in the last quarter."""
    norms = np.linalg.norm(values[times > 0.75 * times[-1]], axis=1)
    return float(norms.max()), float(np.sqrt(np.mean(norms**2)))

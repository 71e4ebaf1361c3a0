"""Many observers at once in plain NumPy, beside wheels whose motion is given: independent of the runtime and of C."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.observers.train.quasi_lpv_uio import QuasiLpvUio
from plant_models.hybrid import scalar_names

PERIOD, PARTS = 0.2, 2


class Members:
    """Members of `QuasiLpvUio` with repaired rules, stepped from sample to sample by Runge-Kutta of order four.

    Args:
        count: members. effort: known to them [m/s2]. values: of parameters, one number for all.
    """

    def __init__(self, count: int, effort: float, preset: str = "as_published", **values: float) -> None:
        self.system = QuasiLpvUio()
        self.count, self.effort = count, effort
        self.x = np.repeat(self.system.start_state(preset)[:, None], count, axis=1)
        self.states = scalar_names(self.system.states)
        self.parameters = self.system.start_parameters(preset)
        for name, value in values.items():
            self.parameters[scalar_names(self.system.parameter_signals).index(name)] = value
        self.p = self.system.unpack_parameters(self.parameters)
        self.t = 0.0

    def set_rules(self, **memory: Any) -> None:
        for name, value in memory.items():
            self.x[self.states.index(name)] = value

    def rule(self, name: str) -> np.ndarray:
        return self.x[self.states.index(name)]

    def sample(self, odometer: np.ndarray) -> None:
        """Read the odometer, shape (count,), and go on to the next sample."""
        u = self._inputs(odometer)
        self.x = self.system.jump_vector("odometer_sample", self.t, self.x, u, self.parameters)
        h = PERIOD / PARTS
        for _ in range(PARTS):
            k1 = self._rate(self.x, u)
            k2 = self._rate(self._moved(0.5 * h * k1), u)
            k3 = self._rate(self._moved(0.5 * h * k2), u)
            k4 = self._rate(self._moved(h * k3), u)
            self.x = self._moved(h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
        self.x[1] = np.maximum(self.x[1], 0.0)
        self.t += PERIOD

    def balise(self, place: np.ndarray | float, odometer: np.ndarray | float = 0.0) -> None:
        self.x = self.system.jump_vector("balise", self.t, self.x, self._inputs(odometer, place), self.parameters)

    def _inputs(self, odometer: np.ndarray | float, place: np.ndarray | float = 0.0) -> np.ndarray:
        flat = np.repeat(self.system.start_inputs()[:, None], self.count, axis=1)
        names = scalar_names(self.system.input_signals)
        for name, value in (("effort", self.effort), ("odometer", odometer), ("balise_position", place)):
            flat[names.index(name)] = value
        return flat

    def _rate(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        rates = np.array(self.system.state_derivative(self.t, x, u, self.parameters))
        friction = self.system.friction_vector(self.t, x, u, self.parameters)[0]
        held = np.clip(rates[1], -friction, friction)  # at rest
        rates[1] -= np.where(x[1] > 0.0, friction, held * (x[1] == 0.0))
        return rates

    def _moved(self, by: np.ndarray) -> np.ndarray:
        moved = self.x.copy()
        moved[: len(by)] += by
        return moved

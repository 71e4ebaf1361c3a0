"""Many observers at once in plain NumPy, beside wheels whose motion is given: independent of the runtime and of C."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.detection.jam_rules import RuleMemory
from fmu_observer.observers.train.quasi_lpv_uio import QuasiLpvUio

PERIOD, PARTS = 0.2, 2
FIRST_RULE = 15  # states of the observer before the memory of its rules


class Members:
    """Members of `QuasiLpvUio` with repaired rules, stepped from sample to sample by Runge-Kutta of order four.

    Args:
        count: members. effort: known to them [m/s2]. values: of parameters, one number for all.
    """

    def __init__(self, count: int, effort: float, preset: str = "as_published", **values: float) -> None:
        self.system = QuasiLpvUio()
        self.count, self.effort = count, effort
        self.x = np.repeat(self.system.start_state(preset)[:, None], count, axis=1)
        self.p = self.system.unpack_parameters(self.system.start_parameters(preset))._replace(**values)
        self.t = 0.0

    def set_rules(self, **memory: Any) -> None:
        for name, value in memory.items():
            self.x[FIRST_RULE + RuleMemory._fields.index(name)] = value

    def rule(self, name: str) -> np.ndarray:
        return self.x[FIRST_RULE + RuleMemory._fields.index(name)]

    def sample(self, odometer: np.ndarray) -> None:
        """Read the odometer, shape (count,), and go on to the next sample."""
        u = self._inputs(odometer)
        self.x = np.array(self.system.jump("odometer_sample", self.t, self.x, u, self.p))
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
        u = self._inputs(odometer)._replace(balise_position=place + np.zeros(self.count))
        self.x = np.array(self.system.jump("balise", self.t, self.x, u, self.p))

    def _inputs(self, odometer: np.ndarray | float) -> Any:
        flat = np.repeat(self.system.start_inputs()[:, None], self.count, axis=1)
        return self.system.unpack_inputs(flat)._replace(
            effort=np.full(self.count, self.effort), odometer=odometer + np.zeros(self.count)
        )

    def _rate(self, x: np.ndarray, u: Any) -> np.ndarray:
        rates = np.array(self.system.flow(self.t, x, u, self.p))
        friction = self.system.friction(self.t, x, u, self.p)[0]
        held = np.clip(rates[1], -friction, friction)  # at rest
        rates[1] -= np.where(x[1] > 0.0, friction, held * (x[1] == 0.0))
        return rates

    def _moved(self, by: np.ndarray) -> np.ndarray:
        moved = self.x.copy()
        moved[: len(by)] += by
        return moved

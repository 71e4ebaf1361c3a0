"""Adaptive observers beside the time-varying oscillator: its motion by SciPy, samples, what is told at them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from plant_models.hybrid import HybridSystem, Runtime, scalar_names

RHO = (10.0, 20.0)


def oscillator(t: float, x: Sequence[float], lasting: bool) -> list[float]:
    """(4.64) of Hann 2014, written down once more."""
    g = np.sin(20.0 * t) if lasting else np.cos(20.0 * t) / (1.0 + t * t)
    return [x[1] + np.sin(20.0 * t) * RHO[0], -x[0] + g * RHO[1] + (2.0 + np.tanh(t)) * 10.0 * np.sin(t)]


@cache
def motion(lasting: bool = False) -> Any:
    return solve_ivp(
        lambda t, x: oscillator(t, x, lasting),
        (0.0, 45.0),
        [20.0, -40.0],
        "DOP853",
        rtol=1e-11,
        atol=1e-9,
        max_step=0.1,
        dense_output=True,
    ).sol


class Samples:
    """What an observer told at its samples, by the name of an output; `time` and `error`, the norm of the state's."""

    def __init__(
        self,
        observer: HybridSystem,
        period: float,
        end: float,
        preset: str | None = None,
        noise: Sequence[float] = (),
        **settings: float | Sequence[float],
    ) -> None:
        self.runtime = runtime = Runtime(observer)
        sol = motion(observer.model.name == "excited_oscillator")  # type: ignore[attr-defined]
        runtime.p[:], runtime.x[:] = observer.start_parameters(preset), observer.start_state(preset)
        self.states = scalar_names(observer.states)
        for name, value in settings.items():
            at = [i for i, s in enumerate(scalar_names(observer.parameter_signals)) if s == name]
            if at:
                runtime.p[at] = value
            else:
                runtime.x[[i for i, s in enumerate(self.states) if s.split("[")[0] == name]] = value
        measured = scalar_names(observer.input_signals).index("sample_x1")
        runtime.start(0.0)
        rows = []
        for k in range(round(end / period) + 1):
            if k:
                runtime.advance(k * period)
            x = sol(k * period)
            runtime.u[measured] = x[0] + (noise[k] if k < len(noise) else 0.0)
            runtime.trigger("sample")
            y = runtime.update_outputs()
            rows.append([k * period, *y, np.hypot(y[0] - x[0], y[1] - x[1])])
        names = ("time", *scalar_names(observer.outputs), "error")
        self.columns: Mapping[str, np.ndarray] = dict(zip(names, np.array(rows).T, strict=True))

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def state(self, name: str) -> np.ndarray:
        return self.runtime.x[[i for i, s in enumerate(self.states) if s.split("[")[0] == name]]

    def settled(self, bad: np.ndarray) -> float:
        """First sample after the last one that is bad [s]; inf where the last one is."""
        return float("inf") if bad[-1] else float(self["time"][np.flatnonzero(bad)[-1] + 1])

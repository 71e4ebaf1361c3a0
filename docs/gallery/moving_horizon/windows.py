"""Runs of a plant and of an observer on what was measured, for the scripts on inversion of signatures."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import HybridSystem, Runtime, scalar_names

Record = dict[str, np.ndarray]


def recorded(plant: HybridSystem, seconds: float, period: float, **values: Any) -> Record:
    """Outputs of a plant at its samples, the time among them."""
    return _run(plant, np.zeros((round(seconds / period) + 1, 0)), period, values)


def driven(observer: HybridSystem, measured: np.ndarray, **values: Any) -> Record:
    """Outputs of an observer at the samples that it is given, shape (samples, inputs)."""
    names = scalar_names(observer.parameter_signals)
    start = observer.start_parameters()
    period = values.get("sample_period", start[names.index("sample_period")])
    return _run(observer, measured, float(period), values)


def rms(reported: Record, true: Record, name: str, rows: np.ndarray, other: str = "") -> float:
    """Root of the mean squared error of an estimate, or of another output against the same truth."""
    return float(np.sqrt(np.mean((reported[other or name][rows] - true[name][rows]) ** 2)))


def _run(system: HybridSystem, inputs: np.ndarray, period: float, values: dict[str, Any]) -> Record:
    runtime = Runtime(system)
    runtime.x[:], runtime.p[:] = system.start_state(), system.start_parameters()
    for name, value in values.items():
        for numbers, signals in ((runtime.x, system.states), (runtime.p, system.parameter_signals)):
            names = scalar_names(signals)
            found = [i for i, n in enumerate(names) if n == name or n.startswith(f"{name}[")]
            if found:
                numbers[found] = value
                break
        else:
            raise KeyError(name)
    if inputs.shape[1]:
        runtime.u[: inputs.shape[1]] = inputs[0]
    runtime.start(0.0)
    rows = [np.array(runtime.update_outputs())]
    for k in range(1, len(inputs)):
        if inputs.shape[1]:
            runtime.u[: inputs.shape[1]] = inputs[k]
        runtime.advance(k * period)
        rows.append(np.array(runtime.update_outputs()))
    table = np.array(rows)
    reported = {name: table[:, i] for i, name in enumerate(scalar_names(system.outputs))}
    return reported | {"time": period * np.arange(len(inputs))}

"""Runs that several tests share: a runtime with parameters by name, and the closed loop of driver, train and
odometer.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models import Driver, Locomotive, Odometer
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

NO_ZONES = {f"zone_{end}[{i}]": 0.0 for end in ("from", "to") for i in (1, 2, 3)}
ALL_DEGRADED = {**NO_ZONES, "zone_from[1]": -1.0, "zone_to[1]": 1e9}


def parameters(system: HybridSystem, preset: str | None = None, **changes: float) -> np.ndarray:
    """Parameter array of a preset with some values changed by FMI name."""
    values = system.start_parameters(preset)
    names = scalar_names(system.parameter_signals)
    for name, value in changes.items():
        values[names.index(name)] = value
    return values


def started(
    system: HybridSystem, preset: str | None = None, x0: Any = None, u0: Any = None, **changes: float
) -> Runtime:
    """A runtime at time zero with these parameters, this initial state and these inputs."""
    runtime = Runtime(system)
    runtime.p[:] = parameters(system, preset, **changes)
    if x0 is not None:
        runtime.x[:] = x0
    if u0 is not None:
        runtime.u[:] = u0
    runtime.start(0.0)
    return runtime


def outputs(runtime: Runtime) -> dict[str, float]:
    """Outputs by name, now."""
    values = runtime.update_outputs().copy()
    return dict(zip(scalar_names(runtime.system.outputs), map(float, values), strict=True))


def rolling(speed: float, radius: float = 0.575) -> list[float]:
    """State of a locomotive at position zero whose wheel rolls without slip."""
    return [0.0, speed, speed / radius]


def sampled(runtime: Runtime, times: np.ndarray) -> np.ndarray:
    """States at the given times, shape (len(times), n)."""
    rows = np.empty((len(times), len(runtime.x)))
    for i, t in enumerate(times):
        runtime.advance(float(t))
        rows[i] = runtime.x
    return rows


def closed_loop(
    duration: float,
    step: float,
    driver: Runtime | None = None,
    locomotive: Runtime | None = None,
    odometer: Runtime | None = None,
) -> dict[str, np.ndarray]:
    """Driver, locomotive and odometer in one loop, exchanged every `step` [s], from rest: every output by name."""
    driver = driver or started(Driver())
    locomotive = locomotive or started(Locomotive())
    odometer = odometer or started(Odometer(), sample_period=step)
    rows = []
    for k in range(round(duration / step) + 1):
        t = k * step
        locomotive.advance(t)
        train = outputs(locomotive)
        odometer.u[0] = train["wheel_speed"]
        odometer.advance(t)
        sensor = outputs(odometer)
        driver.u[0] = sensor["reading"]
        driver.advance(t)
        demand = outputs(driver)
        locomotive.u[0] = demand["effort"]
        rows.append({"time": t, **train, **sensor, **demand})
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}

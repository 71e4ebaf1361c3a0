"""A made-up but plausible train run for the tests of results and reports: nothing here is a measurement."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import BaliseRecord, Result, SignalInfo

ZONES = ((10.0, 20.0), (40.0, 50.0), (70.0, 80.0))
OBSERVERS = ("differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio")
SIZES = dict(zip(OBSERVERS, (0.001, 0.02, 0.06, 0.14), strict=True))  # of the speed errors [m/s]
UNITS = {
    "position": "m",
    "speed": "m/s",
    "acceleration": "m/s2",
    "wheel_speed": "m/s",
    "adhesion_force": "N",
    "effort": "N",
}
UNITS |= {"reading": "m/s", "speed_reference": "m/s", "innovation": "m"}


def _rows(step: float, stamps: np.ndarray) -> np.ndarray:
    return np.sort(np.concatenate([np.round(np.arange(0, 90 + step / 2, step), 9), stamps, stamps]))


def _plant(t: np.ndarray) -> dict[str, np.ndarray]:
    top, rate = 13.9, 0.694
    speed = np.clip(np.minimum(rate * t, rate * (85 - t)), 0, top)
    position = np.concatenate([[0], np.cumsum(np.diff(t) * (speed[1:] + speed[:-1]) / 2)])
    acceleration = np.where(t < 20, rate, np.where(t < 65, 0, np.where(t < 85, -rate, 0)))
    degraded = np.any([(t >= a) & (t <= b) for a, b in ZONES], axis=0).astype(float)
    slip = acceleration / rate * (0.005 + 0.0165 * degraded) + 0.0006 * degraded
    force = 90000 * acceleration + 900 + 32 * speed + 1.7 * speed**2
    return {
        "locomotive.position": position,
        "locomotive.speed": speed,
        "locomotive.slip": slip,
        "locomotive.adhesion_force": force,
        "locomotive.wheel_speed": speed / (1 - slip),
        "driver.speed_reference": speed,
        "driver.effort": force,
    }


def _observer(
    t: np.ndarray, plant: dict[str, np.ndarray], size: float, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    start_up = np.exp(-t / 0.8) * np.cos(3 * t)
    wave = np.sin(2.1 * t + 40 * size) * (0.4 + 0.6 * (plant["locomotive.slip"] ** 2 > 0.0003))
    speed = plant["locomotive.speed"] + size * wave + start_up
    odometer = plant["locomotive.wheel_speed"]
    slip = np.where(odometer > 0.5, (odometer - speed) / np.maximum(odometer, 0.5), 0.0)
    edges = sum(np.exp(-(((t - edge) / 0.05) ** 2)) for zone in ZONES for edge in zone)
    return {
        "position": plant["locomotive.position"] + 0.3 * size * np.cos(2.1 * t) + 0.4 * start_up,
        "speed": speed,
        "slip": slip,
        "adhesion_force": plant["locomotive.adhesion_force"] + 2e5 * size * rng.standard_normal(len(t)) + 1.5e5 * edges,
        "slip_indicator": np.where(np.abs(slip) > 0.02, 2.0, 1.0),
        "innovation": np.zeros(len(t)),
    }


def _events(stamps: np.ndarray, t: np.ndarray, position: np.ndarray) -> list[BaliseRecord]:
    events = []
    for i, stamp in enumerate(stamps):
        p = float(np.interp(stamp, t, position))
        outcomes = {o: "replayed" if i % 7 == 0 and o == "multirate_cdo" else "accepted" for o in OBSERVERS}
        if i % 23 == 5:
            events.append(BaliseRecord(stamp, math.nan, f"B{i}", p, p, kind="missed", method="rollback"))
        elif i % 41 == 11:
            reported = dict.fromkeys(OBSERVERS, "rejected")
            events.append(BaliseRecord(stamp, stamp, f"B{i}", p + 80, p, kind="false", outcomes=reported))
        else:
            events.append(
                BaliseRecord(stamp, stamp + 0.02, f"B{i}", p, p, 1.0, 13.0, "true", "rollback", 1e-9, outcomes)
            )
    return events


def _summary() -> dict[str, Any]:
    limits = (0.5, 0.286, 0.5, math.inf)
    certificates = {
        o: {
            "aperiodic_limit": limit,
            "constant_limit": 1.25 * limit,
            "holds": limit > 1,
            "max_gap": 1.1,
            "explanation": "Gaps up to 1.1 s occur; the certificate covers less." if limit < 1 else "No limit.",
        }
        for o, limit in zip(OBSERVERS, limits, strict=True)
    }
    components = [
        {"name": "locomotive", "kind": "FMU", "fmi_version": "3.0", "model": "locomotive", "source": "locomotive.fmu"},
        {"name": "odometer", "kind": "Python", "fmi_version": None, "model": "odometer", "source": "plant_models"},
        *({"name": o, "kind": "FMU", "fmi_version": "2.0", "model": o, "source": f"{o}.fmu"} for o in OBSERVERS),
    ]
    return {
        "scenario": "adhesion_zones",
        "step": 0.01,
        "start": 0.0,
        "reached": 90.0,
        "wall_seconds": 1.234,
        "localisation": {"method": "rollback", "reason": "redone steps are bit-identical."},
        "warnings": ["takagi_sugeno_cdo: gaps up to 1.1 s exceed the certified 0.286 s."],
        "certificates": certificates,
        "components": components,
        "versions": {"fmu-observer": "0.1.0", "fmpy": "0.3.32", "numpy": np.__version__},
    }


def synthetic_result(step: float = 0.05, diverged: str | None = None, seed: int = 0) -> Result:
    """A run of 90 s over three low-adhesion zones with four observers.

    Args:
        step: distance of the rows [s].
        diverged: observer that grows to 1e4 m/s, then to infinity and NaN.
        seed: of balises and noise.
    """
    rng = np.random.default_rng(seed)
    stamps = np.cumsum(rng.uniform(0.1, 0.5, 400) * np.where(rng.random(400) < 0.06, 2.2, 1.0))
    stamps = stamps[stamps < 85]
    t = _rows(step, stamps)
    columns = _plant(t)
    columns["odometer.reading"] = columns["locomotive.wheel_speed"] + 0.02 * rng.standard_normal(len(t))
    for observer in OBSERVERS:
        columns |= {f"{observer}.{name}": v for name, v in _observer(t, columns, SIZES[observer], rng).items()}
    if diverged is not None:
        growth = np.exp(np.minimum(0.3 * (t - 25), 9.2)) * np.sin(4 * t)
        for name in ("speed", "position"):
            columns[f"{diverged}.{name}"] = columns[f"{diverged}.{name}"] + np.where(t > 25, growth, 0)
            columns[f"{diverged}.{name}"][-30:-10] = math.inf
            columns[f"{diverged}.{name}"][-10:] = math.nan
    table = np.empty(len(t), [("time", "f8"), *((name, "f8") for name in columns)])
    table["time"] = t
    for name, values in columns.items():
        table[name] = values
    signals = [SignalInfo(name, UNITS.get(name.partition(".")[2], "1")) for name in columns]
    return Result(table, signals, _events(stamps, t, columns["locomotive.position"]), _summary())


def synthetic_spec() -> ReportSpec:
    """The roles in `synthetic_result`; the numbers to compare with are made up."""
    return ReportSpec(
        title="Locomotive over three low-adhesion zones",
        true_position="locomotive.position",
        true_speed="locomotive.speed",
        true_slip="locomotive.slip",
        true_adhesion_force="locomotive.adhesion_force",
        odometer="odometer.reading",
        speed_reference="driver.speed_reference",
        observers=OBSERVERS,
        labels={
            "differentiator_cdo": "differentiator + CDO",
            "takagi_sugeno_cdo": "Takagi-Sugeno CDO",
            "multirate_cdo": "two CDOs",
        },
        phases=(Phase("traction", 0, 20), Phase("hold", 20, 65), Phase("braking", 65, 85)),
        zones=ZONES,
        evaluate_after=5.0,
        published={"takagi_sugeno_cdo": {"traction": 0.015, "braking": 0.025}},
        independent={"takagi_sugeno_cdo": {"traction": 0.0262, "braking": 0.0225}},
        notes=("The profile is not printed; the numbers agree in order of magnitude only.",),
    )

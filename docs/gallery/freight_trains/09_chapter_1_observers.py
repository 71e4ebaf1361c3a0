"""The observers of chapter 1 beside the pendulum: how fast each finds angle and rate. The thesis prints no numbers for
them.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.runner import Together, errors, sampling, unless_rounding
from shared.sheet import Sheet

from fmu_observer.observers.generic.continuous import HighGain, TakagiSugenoLuenberger, Thau
from fmu_observer.observers.generic.sampled import (
    ExponentialGain,
    HeldInnovation,
    HybridImpulsive,
    OutputPredictor,
    RiccatiHighGain,
    TakagiSugenoAperiodic,
    TakagiSugenoPeriodic,
)
from plant_models.exhibits import Pendulum

TIMES = (2.0, 10.0)  # [s]
# system, parameters, independent numbers where there are some
OBSERVERS: dict[str, tuple[Any, dict[str, float], str]] = {
    "O2 Thau, continuous": (Thau, {}, ""),  # the gain of O3 with theta = 2
    "O3 high gain, continuous": (HighGain, {"theta": 2.0}, "6.0e-2 and 4.7e-9"),
    "O7 Takagi-Sugeno, continuous": (TakagiSugenoLuenberger, {}, ""),
    "O12 Riccati high gain, every 0.1 s": (RiccatiHighGain, {"theta": 2.0}, "7.0e-3 and 3.6e-10"),
    "O13 Takagi-Sugeno, every 0.1 s": (TakagiSugenoPeriodic, {}, ""),
    "O15 output predictor": (OutputPredictor, {"theta": 2.0}, "4.2e-2 and 6.2e-9"),
    "O16 held innovation": (HeldInnovation, {"theta": 2.0}, "4.5e-2 and 3.4e-11"),
    "O17 exponential gain": (ExponentialGain, {"theta": 2.0}, "4.2e-2 and 6.2e-9"),
    "O18 hybrid": (HybridImpulsive, {}, "1.8e-1 and 7.0e-7"),
    "O19 Takagi-Sugeno": (TakagiSugenoAperiodic, {}, ""),
}
APERIODIC = ("O15 output predictor", "O16 held innovation", "O17 exponential gain", "O18 hybrid", "O19 Takagi-Sugeno")
OURS = "nothing is printed, gains and pendulum are ours"
FROZEN = "nothing is printed; weights held from sample to sample leave an error while the pendulum swings"
SMALL = 1e-9  # below it the errors of the integration show


def seen(values: Any, _noise: Any) -> dict[str, Any]:
    """Every name under which an observer may ask for the angle."""
    return {"torque": 0.0 * values["angle"], **dict.fromkeys(("measured_angle", "sample_angle"), values["angle"])}


def norms(make: Any, parameters: dict[str, float], instants: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Times and size of the error; a periodic observer samples by itself every 0.1 s."""
    pair = Together(Pendulum(), make(), seen, step=5e-3, **parameters)
    events = [e.name for e in pair.triggered_events]
    t, found = errors(pair, TIMES[-1], dict.fromkeys(events, instants))
    return t, np.linalg.norm(found, axis=1)


def main() -> None:
    """The error at three times, at periodic and at aperiodic samples."""
    sheet = Sheet(__file__, "Observers of chapter 1 beside a pendulum", "Bouchama 2024, (1.6)-(1.55)")
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), sharey=True, layout="constrained")
    every = [round(0.1 * k, 3) for k in range(100)]
    for axis, words, names, instants in (
        (axes[0], "every 0.1 s", tuple(OBSERVERS), every),
        (axes[1], "at gaps up to 0.5 s", APERIODIC, sampling(0.5, TIMES[-1])),
    ):
        for name in names:
            make, parameters, independent = OBSERVERS[name]
            t, size = norms(make, parameters, instants)
            why = FROZEN if make is TakagiSugenoAperiodic else OURS
            if independent and axis is axes[0]:
                why = f"{OURS}; an independent implementation on a pendulum of its own gave for {name}: {independent}"
            where = "" if name.endswith(("continuous", "0.1 s")) else f", {words}"
            for end in TIMES:
                value = unless_rounding(size[np.searchsorted(t, end - 1e-6)], SMALL)
                sheet.add(f"error after {end:g} s, {name}{where}", "1", None, value, why, repeats=0.05)
            axis.semilogy(t, np.maximum(size, SMALL), lw=0.9, label=name)
        axis.set(title=f"samples {words}", xlabel="time [s]")
    axes[0].set_ylabel("norm of the error in rad and rad/s")
    sheet.finish(figure, *axes, fontsize=7)


if __name__ == "__main__":
    main()

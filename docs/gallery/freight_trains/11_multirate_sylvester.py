"""The multirate observer by a Sylvester equation: residual of (1.46), and its error on an unstable plant."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import solve_continuous_are
from shared.runner import ModelPlant, Together, errors, unless_rounding
from shared.sheet import Sheet

from fmu_observer.observers.generic.sampled import MultirateSylvester

START = (0.3, 0.05, 0.2, 0.4, 0.1)
GAPS = {"position_sample": 0.1, "angle_sample": 0.15}  # [s]
INDEPENDENT = (
    "no plant is printed; an independent implementation gave 4e-16 and, on a plant of its own, 1.4e-4, 4.5e-9, 2.8e-13"
)


def seen(values: Any, _noise: Any) -> dict[str, Any]:
    """Voltage and current at all times, cart position and angle at their own samples."""
    names = {
        "voltage": "voltage",
        "measured_current": "current",
        "position_sample_value": "position",
        "angle_sample_value": "angle",
    }
    return {name: values[f"true_{source}"] for name, source in names.items()}


def main() -> None:
    """Residual, error at three times, and the plant's own growth."""
    sheet = Sheet(__file__, "Multirate observer by a Sylvester equation", "Bouchama 2024, (1.42)-(1.46)")
    observer = MultirateSylvester()
    model = observer.model
    (existence,) = (found for found in observer.findings() if found.what == "existence and stability")
    residual = unless_rounding(existence.numbers["residual"], 1e-13)
    sheet.add("relative residual of (1.46)", "1", None, residual, INDEPENDENT)
    sheet.add("fastest growth of the plant", "1/s", None, np.linalg.eigvals(model.A).real.max(), "the plant is ours")
    # held upright, by its true state
    balance = model.B.T @ solve_continuous_are(model.A, model.B, np.eye(5), np.eye(1))
    pair = Together(ModelPlant(model, START, balance), observer, seen)
    instants = {event: list(np.round(np.arange(gap, 12.0, gap), 3)) for event, gap in GAPS.items()}
    t, found = errors(pair, 12.0, instants)
    size = np.abs(found).max(axis=1)
    for end in (2.0, 5.0, 12.0):
        value = unless_rounding(size[np.searchsorted(t, end - 1e-6)], 1e-9)
        sheet.add(f"largest error after {end:g} s", "SI", None, value, INDEPENDENT, repeats=0.05)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for i, state in enumerate(model.states):
        axis.semilogy(t, np.abs(found[:, i]) + 1e-14, lw=0.8, label=f"{state.name} [{state.unit}]")
    axis.set(xlabel="time [s]", ylabel="error of the estimate")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()

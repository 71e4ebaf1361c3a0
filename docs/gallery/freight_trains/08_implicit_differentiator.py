"""The filtering differentiator by implicit and by explicit steps: (1.36) with Theorem 5 against (1.16)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.observers.generic.differentiators import FilteringDifferentiator, ImplicitDifferentiator
from fmu_observer.observers.generic.differentiators.signal_differentiator import SignalDifferentiator
from plant_models.hybrid import Runtime

INDEPENDENT = {
    0.1: "implicit 0.062 and 0.475, explicit 0.261 and 0.822",
    1e-3: "implicit 1e-5 and 5.6e-3, explicit 2e-5 and 8.6e-3",
}


def followed(system: SignalDifferentiator, tau: float, seconds: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and estimates of sin(t) and its derivative at the samples, L = 2; n = 1, nf = 3."""
    runtime = Runtime(system)
    runtime.p[:2] = 2.0, tau  # bound, and sampling period or internal step
    runtime.start(0.0)
    times, rows = tau * np.arange(1, round(seconds / tau) + 1), []
    for t in times:
        # The implicit step reads the signal at its end, the explicit one holds that of its start.
        runtime.u[0] = np.sin(t if system.discrete else t - tau)
        runtime.advance(t)
        rows.append(runtime.x[3:5].copy())
    return times, np.array(rows)


def main() -> None:
    """Errors at a coarse and a fine period."""
    sheet = Sheet(
        __file__, "Implicit and explicit filtering differentiator", "Bouchama 2024, (1.16), (1.36), Theorem 5"
    )
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for axis, tau in zip(axes, INDEPENDENT, strict=True):
        why = f"no errors are published; an independent implementation gave, at {tau:g} s: {INDEPENDENT[tau]}"
        for label, make in (("implicit", ImplicitDifferentiator), ("explicit", FilteringDifferentiator)):
            t, rows = followed(make(), tau)
            found = np.abs(rows - np.stack([np.sin(t), np.cos(t)], 1))
            largest = found[len(found) // 2 :].max(axis=0)
            for what, error in zip(("signal", "derivative"), largest, strict=True):
                # chatter
                sheet.add(f"error of the {what}, {label}, period {tau:g} s", "1", None, error, why, repeats=0.3)
            axis.semilogy(t, np.maximum(found[:, 1], 1e-9), lw=0.7, label=label)
        axis.set(title=f"period {tau:g} s", xlabel="time [s]", ylabel="error of the derivative [1]")
        axis.grid(alpha=0.3)
        axis.legend()
    sheet.finish(figure)


if __name__ == "__main__":
    main()

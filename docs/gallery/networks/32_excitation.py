"""Excitation that fades: the adaptation gain as printed and capped, constants held, and the uncertainty told."""

from __future__ import annotations

import matplotlib.pyplot as plt
from learning import learn
from shared.sheet import Sheet

from fmu_observer.observers.generic.adaptive import AdaptivePredictor

OUTPUTS = ("rho1", "rho2", "rho2_learnt", "smallest_excitation", "rho2_deviation")
OURS = "ours"
GROWTH = "e^t, for nothing is known of rho2: (4.8) fails; independent value from the thesis' equations"


def main() -> None:
    """Published and repaired, fading and lasting excitation."""
    sheet = Sheet(__file__, "Excitation that fades", "Hann 2014, (4.8), (4.64)")
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    gains = {"as_published": (4.9e8, 20.0), "repaired": (None, 20.0)}
    for preset, (independent, at) in gains.items():
        run = learn(AdaptivePredictor(), [0.1], 40.0, ("adaptation_gain[3]", *OUTPUTS), preset)
        k = round(at / 0.01)
        why = GROWTH if independent else "ours: never above 1e7"
        sheet.add(
            f"R22 at {at:g} s, {preset}",
            "1",
            None,
            float(run.reported[0, k, 0]),
            why,
            repeats=0.1,
            independent=independent,
        )
        sheet.add(f"rho2 at 40 s, {preset} (true 20)", "1", None, f"{run.reported[0, -1, 2]:.3g}", OURS)
        sheet.add(f"rho2 learnt at 40 s, {preset}", "1", None, float(run.reported[0, -1, 3]), OURS)
        axes[0].plot(run.t, run.reported[0, :, 0], label=preset)
        axes[1].plot(run.t, run.reported[0, :, 2], label=preset)
    run = learn(AdaptivePredictor("excited_oscillator"), [0.1], 40.0, OUTPUTS, "repaired")
    sheet.add("rho2 at 40 s, repaired, lasting excitation", "1", None, float(run.reported[0, -1, 1]), OURS)
    sheet.add("smallest excitation then", "1", None, float(run.reported[0, -1, 3]), OURS)
    axes[0].set(yscale="log", xlabel="time [s]", ylabel="R22")
    axes[1].set(ylim=(-60.0, 60.0), xlabel="time [s]", ylabel="estimate of rho2")
    for axis in axes:
        axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()

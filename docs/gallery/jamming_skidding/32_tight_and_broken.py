"""Which bounds are tight and which is none: the case that meets the i-DMO bound, and the one that breaks (4.29)."""

from __future__ import annotations

from math import exp

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.certificates.bounds import cdo_bound, improved_dmo_bound, printed_cdo_bound, worst_case
from fmu_observer.observers.train import DiscreteMeasurementObserver

XI, TAU = 1.7, 0.2
GROWING = {"beta": 1.0, "m": 0.1, "gain": 13.0, "deviation": 0.0}
BROKEN = (
    "e' = -(m - a) e with a = 13 1/s is within what Lemma 4-1 allows; (4.29) prints e^(-m s) in its first term where "
    "the lemma has e^(-(m - a) s)"
)
TIGHT = "not in the thesis: one state, e' = -m e + K (v - y_k), and the largest deceleration all the time"
RESERVE = (
    "not in the thesis: the worst acceleration (bang-bang) of three states from an error of zero; the difference is "
    "the reserve of a bound by norms"
)


def main() -> None:
    """A scalar case, the train, and the printed exponent."""
    sheet = Sheet(__file__, "Tight and broken bounds", "Aguiar Cota 2019, (4.19), (4.29), Lemma 4-1")
    true = 0.1 * exp((GROWING["gain"] - GROWING["m"]) * TAU)
    printed, corrected = (float(bound(TAU, 0.1, **GROWING)) for bound in (printed_cdo_bound, cdo_bound))
    sheet.add("error of the growing case after 0.2 s", "m/s", None, true, BROKEN, independent=1.3197)
    sheet.add("(4.29) as printed", "m/s", None, printed, BROKEN, independent=0.098)
    sheet.add("(4.29) with the exponent of Lemma 4-1", "m/s", None, corrected, BROKEN, independent=1.3197)
    sheet.add("the printed bound holds", "", "yes", "yes" if true <= printed else "no", BROKEN, independent="no")
    sheet.add("the corrected bound holds", "", "yes", "yes" if true <= corrected * (1.0 + 1e-12) else "no")
    m, gain = 0.5, 0.5
    met = worst_case(np.array([[-m]]), np.array([gain]), XI, TAU, periods=0).error
    bound = float(improved_dmo_bound(TAU, 0.0, 1.0, m, gain, XI))
    sheet.add("error over i-DMO bound, one state", "1", None, met / bound, TIGHT)
    for preset, words in (("as_published_set_d", "gain of 5.4"), ("m_0_5_alpha_100", "m 0.5 1/s, alpha 100")):
        numbers = DiscreteMeasurementObserver().error_bounds(preset=preset)
        worst = max(
            worst_case(F, K, XI, TAU, periods=0).error for F, K in zip(numbers.drifts, numbers.gains, strict=True)
        )
        bound = float(improved_dmo_bound(TAU, 0.0, numbers.beta, numbers.m, numbers.gain, XI))
        sheet.add(f"worst speed error over i-DMO bound, one gap, {words}", "1", None, worst / bound, RESERVE)
        share = numbers.exact(TAU) / numbers.carried(TAU)
        sheet.add(f"worst speed error over carried bound, all gaps, {words}", "1", None, share, RESERVE)
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
    s = np.linspace(0.0, TAU, 100)
    axes[0].plot(s, 0.1 * np.exp(12.9 * s), "k", label="error")
    axes[0].plot(s, printed_cdo_bound(s, 0.1, **GROWING), label="(4.29) as printed")
    axes[0].plot(s, cdo_bound(s, 0.1, **GROWING), "--", label="exponent of Lemma 4-1")
    numbers = DiscreteMeasurementObserver().error_bounds(preset="m_1_alpha_100")
    case = worst_case(numbers.drifts[0], numbers.gains[0], XI, TAU)
    ages = np.linspace(0.0, 2.0, 2000)
    axes[1].plot(-ages, case.acceleration(ages), lw=0.8, label="worst acceleration")
    axes[0].set(xlabel="time since the sample [s]", ylabel="speed error [m/s]")
    axes[1].set(xlabel="time before the worst error [s]", ylabel="acceleration [m/s2]")
    sheet.finish(figure, *axes)


if __name__ == "__main__":
    main()

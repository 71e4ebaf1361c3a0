"""Davis coefficients identified from synthetic acceleration runs of the three rails of Table 5.1."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.identification import identify_davis, identify_davis_from_acceleration
from fmu_observer.identification.acceleration_run import speeds_and_sensitivities
from fmu_observer.identification.output_error import fit_runs

SETS = {"LoA": (0.46, 5.7e-3, -2.4e-4), "BaA": (0.35, 3e-3, -1e-4), "EBA": (0.25, 5e-3, -2e-4)}
INDEPENDENT = {"LoA": (0.459, 5.80e-3, -2.415e-4)}
NAMES, UNITS = ("w0", "w1", "w2"), ("m/s2", "1/s", "1/m")
EFFORT, NOISE, POINTS, RUNS = 1.2, 0.02, 800, 1000
DRAWN = (
    "the measured runs are confidential; this one is synthetic, made with the published set, so that what comes out "
    "differs by its noise: the published value is inside the 95 % interval"
)


def main() -> None:
    """By acceleration as in (5.2), by speed as `cosim identify` does, coverage of the intervals."""
    sheet = Sheet(__file__, "Friction identified from acceleration runs", "Aguiar Cota 2019, (5.1)-(5.2), Table 5.1")
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    rng = np.random.default_rng(51)
    speeds = np.linspace(5.0, 45.0, POINTS + 1)[1:]
    for name, w in SETS.items():
        exact = EFFORT - (w[0] + w[1] * speeds + w[2] * speeds**2)
        found = identify_davis_from_acceleration(
            speeds, exact + NOISE * rng.standard_normal(POINTS), effort=EFFORT, mass=1.0
        )
        for i, (quantity, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
            value = found.coefficients[1 + i]
            other = INDEPENDENT.get(name, (None,) * 3)[i]
            inside = value.low < w[i] < value.high
            reason = DRAWN if inside else "outside of its 95 % interval, as one of twenty is"
            sheet.add(f"{quantity} of {name}, from accelerations", unit, w[i], value.value, reason, independent=other)
            sheet.add(
                f"half of its interval, {quantity} of {name}", unit, None, value.half_width, "the thesis gives none"
            )
        axis.plot(speeds, w[0] + w[1] * speeds + w[2] * speeds**2, "k", linewidth=0.8)
        axis.plot(speeds, found.resistance(speeds), label=f"{name}, identified")
    _by_speed(sheet, rng)
    axis.set(xlabel="speed [m/s]", ylabel="resistance by mass [m/s2]")
    axis.grid(alpha=0.3)
    axis.legend()
    sheet.finish(figure)


def _by_speed(sheet: Sheet, rng: np.random.Generator) -> None:
    """The same set from a noisy speed, how often intervals cover, and a run that is too narrow."""
    time = np.linspace(0.0, 51.0, POINTS)
    w = SETS["LoA"]
    true = np.array([EFFORT - w[0], w[1], w[2], 5.5])
    exact = speeds_and_sensitivities(time, true[:, None])[0, 0]
    found = identify_davis(time, exact + NOISE * rng.standard_normal(POINTS), effort=EFFORT, mass=1.0)
    for i, (quantity, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
        sheet.add(f"{quantity} of LoA, from speeds", unit, w[i], found.coefficients[1 + i].value, DRAWN)
    fits = fit_runs(time, exact + NOISE * rng.standard_normal((RUNS, POINTS)))
    share = np.mean(np.abs(fits.parameters - true[:, None]) < fits.half_widths(0.95), axis=1)
    for quantity, part in zip(("effort - w0", "w1", "w2"), share[:3], strict=True):
        why = f"{RUNS} synthetic runs; 1.4 % is two standard deviations of such a share"
        sheet.add(f"95 % intervals that hold {quantity}", "%", None, 100.0 * part, why, independent=95.0)
    narrow = (exact > 25.0) & (exact < 30.0)
    part = identify_davis(time[narrow], (exact + NOISE * rng.standard_normal(POINTS))[narrow])
    why = "one coefficient stands for the other in so narrow a run; the command says so and names a run that would do"
    sheet.add("half of the interval of w1, from 25 to 30 m/s only", "1/s", None, part.davis_b.half_width, why)
    sheet.add("identified from 25 to 30 m/s", "", None, "all" if part.identified else "not all", why)


if __name__ == "__main__":
    main()

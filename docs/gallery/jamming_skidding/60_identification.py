"""Davis coefficients identified from synthetic acceleration runs of the three rails of Table 5.1."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.recorded_signals import RecordedSignals
from cosim.calibration.running_resistance import ResistanceOfAcceleration, RunningResistance

SETS = {"LoA": (0.46, 5.7e-3, -2.4e-4), "BaA": (0.35, 3e-3, -1e-4), "EBA": (0.25, 5e-3, -2e-4)}
INDEPENDENT = {"LoA": (0.459, 5.80e-3, -2.415e-4)}
NAMES, UNITS = ("w0", "w1", "w2"), ("m/s2", "1/s", "1/m")
DAVIS = ("davis_a", "davis_b", "davis_c")
EFFORT, NOISE, POINTS, RUNS = 1.2, 0.02, 800, 1000
DRAWN = (
    "the measured runs are confidential; this one is synthetic, made with the published set, so that what comes out "
    "differs by its noise: the published value is inside the 95 % interval"
)


def main() -> None:
    """By acceleration as in (5.2), by speed as `cosim calibrate` does, coverage of the intervals."""
    sheet = Sheet(__file__, "Friction identified from acceleration runs", "Aguiar Cota 2019, (5.1)-(5.2), Table 5.1")
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    rng = np.random.default_rng(51)
    speeds = np.linspace(5.0, 45.0, POINTS + 1)[1:]
    for name, w in SETS.items():
        exact = EFFORT - (w[0] + w[1] * speeds + w[2] * speeds**2)
        drawn = {"acceleration": exact + NOISE * rng.standard_normal(POINTS)}
        known = {"speed": speeds, "effort": np.full(POINTS, EFFORT)}
        found = calibrate(ResistanceOfAcceleration(mass=1.0), RecordedSignals(np.arange(float(POINTS)), drawn, known))
        for i, (quantity, unit) in enumerate(zip(NAMES, UNITS, strict=True)):
            value, (low, high) = found.values[DAVIS[i]], found.intervals[DAVIS[i]]
            other = INDEPENDENT.get(name, (None,) * 3)[i]
            reason = DRAWN if low < w[i] < high else "outside of its 95 % interval, as one of twenty is"
            sheet.add(f"{quantity} of {name}, from accelerations", unit, w[i], value, reason, independent=other)
            half = 0.5 * (high - low)
            sheet.add(f"half of its interval, {quantity} of {name}", unit, None, half, "the thesis gives none")
        axis.plot(speeds, w[0] + w[1] * speeds + w[2] * speeds**2, "k", linewidth=0.8)
        w0, w1, w2 = (found.values[part] for part in DAVIS)
        axis.plot(speeds, w0 + w1 * speeds + w2 * speeds**2, label=f"{name}, identified")
    _by_speed(sheet, rng)
    axis.set(xlabel="speed [m/s]", ylabel="resistance by mass [m/s2]")
    sheet.finish(figure, axis, fontsize=8.5)


def _by_speed(sheet: Sheet, rng: np.random.Generator) -> None:
    """The same set from a noisy speed, how often intervals cover, and a run that is too narrow."""
    time = np.linspace(0.0, 51.0, POINTS)
    w = SETS["LoA"]
    true = dict(zip((*DAVIS, "initial_speed"), (*w, 5.5), strict=True))
    exact = RunningResistance(mass=1.0).run(true, _recorded(time, time))[0]
    found = _calibrated(time, exact + NOISE * rng.standard_normal(POINTS))
    for name, quantity, unit in zip(DAVIS, NAMES, UNITS, strict=True):
        sheet.add(f"{quantity} of LoA, from speeds", unit, true[name], found.values[name], DRAWN)
    runs = [_calibrated(time, speed) for speed in exact + NOISE * rng.standard_normal((RUNS, POINTS))]
    for name, quantity in zip(DAVIS, ("effort - w0", "w1", "w2"), strict=True):
        ends = np.array([run.intervals[name] for run in runs])
        share = np.mean((ends[:, 0] < true[name]) & (true[name] < ends[:, 1]))
        why = f"{RUNS} synthetic runs; 1.4 % is two standard deviations of such a share"
        sheet.add(f"95 % intervals that hold {quantity}", "%", None, 100.0 * share, why, independent=95.0)
    narrow = (exact > 25.0) & (exact < 30.0)
    noisy = exact + NOISE * rng.standard_normal(POINTS)
    part = calibrate(RunningResistance(), RecordedSignals(time[narrow], {"speed": noisy[narrow]}))
    why = "one coefficient stands for the other in so narrow a run; the command says so and names a run that would do"
    low, high = part.intervals["davis_b"]
    sheet.add("half of the interval of w1, from 25 to 30 m/s only", "1/s", None, 0.5 * (high - low), why)
    sheet.add("identified from 25 to 30 m/s", "", None, "all" if part.identified else "not all", why)


def _recorded(time: np.ndarray, speed: np.ndarray) -> RecordedSignals:
    return RecordedSignals(time, {"speed": speed}, {"effort": np.full(len(time), EFFORT)})


def _calibrated(time: np.ndarray, speed: np.ndarray) -> Calibration:
    return calibrate(RunningResistance(mass=1.0), _recorded(time, speed))


if __name__ == "__main__":
    main()

"""Onset and clearing of the alarms of the ten faults of the wind turbine; Tables 7.1 and 7.2, Figures 7.4 to 7.37."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))
from wind_turbine_loop import run_members

SEEDS = range(3)
TS = 0.01  # [s]
PUBLISHED = {1: (0, 3), 2: (0, 2), 3: (3, 6), 4: (3, 7), 5: (4, 6), 6: (3, 8), 7: (3, 3)}  # samples
INDEPENDENT = {1: (0, 3), 2: (6, 4), 3: (0, 6), 4: (0, 8), 5: (0, 10), 6: (0, 12), 7: (7, 4)}
LIMITS = {**dict.fromkeys(range(1, 7), 10), 7: 5, 8: 8, 9: 600}
# Table 7.2, last column: detected, time limit met.
TABLE = {1: "y y", 2: "y y", 3: "y y", 4: "y y", 5: "y y", 6: "y y", 7: "y y", 8: "y x", 9: "y x", 10: "y y"}
REFERENCES = {  # the same of the six references, in the order of the table
    1: "-- yy yy yy yy yy",
    2: "-- yy yx yy yx yx",
    3: "yy yy yy yy yx yy",
    4: "yy yx yy yy yy yy",
    5: "-- yy -- -- -- --",
    6: "yy yy yy yy yy yy",
    7: "yy yy yy yy yx yy",
    8: "-- x- yx yy yy x-",
    9: "-- x- yx -- yx yx",
    10: "-- yy -- -- -- --",
}
TIMES = (
    "the two sensors disagree at the first faulty sample, and the model of each tells which; the alarm clears after "
    "five samples without it, our persistence. Thresholds and wind are not printed"
)
NOISE_ONLY = (
    "median of three seeds, fault from 30 to 40 s. At zero pitch a gain of 5 shows in the noise alone: the alarm waits "
    "for a large sample. Over ten seeds at the instant of the benchmark the median is 12 samples, the largest 33, and "
    "the limit of 10 is not kept (docs/theses/wind_turbine.md)"
)
TORQUE = (
    "readings are compared half a sample late, as Tustin's rule has a held reference: what a step of the reference "
    "leaves, and with it the threshold, falls to a twentieth"
)
ACTUATOR = (
    "excitation decides: here 14 m/s with turbulence and a controller that the fault disturbs; the wind of the thesis "
    "is not available. Three seeds of 100 s, fault from 60 s on; with ten seeds and the fault from 500 to 600 s the "
    "medians are 18.5 s and 18 s, the largest 97.1 s and 28.9 s (docs/theses/wind_turbine.md): the alarm waits until "
    "the pitch moves"
)
EFFICIENCY = (
    "measured by sheet 51; the table sets no limit, and counts it as kept where the fault is detected. Ten seeds find "
    "it within 230 s each (docs/theses/wind_turbine.md)"
)
OTHERS = (
    "limits from ten other runs of 4400 s; counted are instants at which the pair of fault 2 is undecided, too: both "
    "of its sensors then fit the model alike (docs/theses/wind_turbine.md)"
)
STRONG = {"mean_from": 14.0, "mean_to": 14.0, "sine_amplitude": 0.0}


def main() -> None:
    """Medians over seeds, in samples where they are short."""
    sheet = Sheet(__file__, "Wind turbine: when its faults are found", "Omar 2012, Tables 7.1, 7.2, Figs. 7.4-7.37")
    numbers = [n for n in PUBLISHED for _ in SEEDS]
    short = run_members(numbers, [*SEEDS] * len(PUBLISHED), 41.0, (30.0, 40.0))
    slow = run_members([8] * 3 + [9] * 3, [*SEEDS] * 2, 100.0, (60.0, 160.0), **STRONG)
    onsets, verdicts = {}, {}
    for i, (number, (onset, gone)) in enumerate(PUBLISHED.items()):
        part = slice(i * len(SEEDS), (i + 1) * len(SEEDS))
        found = np.round(short.onset[part] / TS)
        left = np.maximum(np.round(short.gone[part] / TS) + 1.0, 0.0)
        why = NOISE_ONLY if number == 2 else TORQUE if number == 7 else TIMES
        other = INDEPENDENT[number]
        sheet.add(f"fault {number}: onset", "Ts", onset, float(np.median(found)), why, independent=other[0])
        sheet.add(
            f"fault {number}: last alarm after its end", "Ts", gone, float(np.median(left)), why, independent=other[1]
        )
        onsets[number] = short.onset[part]
    for number, part, published, independent in ((8, slice(0, 3), 50.0, 9.7), (9, slice(3, 6), 8.5, 13.6)):
        onsets[number] = slow.onset[part]
        median = float(np.nanmedian(onsets[number]))
        sheet.add(f"fault {number}: onset", "s", published, median, ACTUATOR, repeats=0.05, independent=independent)
    for number, times in onsets.items():
        seen = not np.isnan(times).any()
        kept = seen and np.nanmedian(times) <= LIMITS[number] * TS + 1e-9
        verdicts[number] = f"{'y' if seen else 'x'} {'y' if kept else 'x'}"
        why = {2: NOISE_ONLY}.get(number, ACTUATOR if number > 7 else TIMES)
        published = f"{TABLE[number]} (references 1 to 6: {REFERENCES[number]})"
        verdict = f"{verdicts[number]} (ten seeds at the benchmark's instant: y x)" if number == 2 else verdicts[number]
        sheet.add(f"fault {number}: detected, limit kept", "", published, verdict, why)
    lost = json.loads((Path(__file__).parent / "numbers" / "51_efficiency.json").read_text(encoding="utf-8"))["lines"][
        0
    ]
    reported = "y" if lost["quantity"] == "0.97 to 0.25" and lost["measured"] < np.inf else "x"
    published = f"{TABLE[10]} (references 1 to 6: {REFERENCES[10]})"
    sheet.add("fault 10: detected, limit kept", "", published, f"{reported} {reported}", EFFICIENCY)
    false = float(short.false.sum() + slow.false.sum())
    sheet.add("other alarms than the fault's own, all runs", "1", None, false, OTHERS)

    figure, axis = plt.subplots(figsize=(7.5, 3.8), layout="constrained")
    for number, times in onsets.items():
        axis.plot([number] * len(times), np.maximum(times / TS, 0.5), "C0o", mfc="none", label="ours" * (number == 1))
        axis.plot([number - 0.4, number + 0.4], [LIMITS[number]] * 2, "C3-", label="limit" * (number == 1))
        published = PUBLISHED[number][0] if number in PUBLISHED else {8: 5000.0, 9: 850.0}[number]
        axis.plot(number, max(published, 0.5), "kx", label="published" * (number == 1))
    axis.set(yscale="log", xlabel="fault", ylabel="onset [samples of 0.01 s], 0 drawn at 0.5", xticks=list(onsets))
    axis.legend()
    sheet.finish(figure)


if __name__ == "__main__":
    main()

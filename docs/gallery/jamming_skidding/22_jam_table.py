"""Table 3.1 through the shipped scenario: four jams of 40 to 200 ms, classical and fault-tolerant control."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from shared.shipped import run

LENGTHS = (0.04, 0.08, 0.12, 0.16, 0.2)
ONSETS = (1.0, 1.6, 3.0, 4.0)
CLASSICAL = ((0.17, -0.1812), (0.1, -0.1173), (0.035, -0.046), (0.042, 0.033), (0.12, 0.1220))
TOLERANT = ((0.0057, 0.0019), (0.018, 0.0011), (0.029, 0.0008), (0.033, 0.0007), (0.056, 0.0007))
WITHOUT = (0.068, 0.16, 0.27, 0.37, 0.37)
DELAYS = (0.002, 0.002, 0.001, 0.002, 0.001)
UNSIGNED = (
    "published without sign and as a fraction of 100 m, though headed in per cent; drag that is not compensated stops "
    "the train 0.24 m short and jams make the way longer, so the error changes its sign near 145 ms"
)
BETTER = (
    "smaller than published: filter of the residual, release time and how long the observer takes the effort as zero "
    "are not printed; unsigned in both other columns, and of the size of what a sample of 1 ms decides"
)
SAMPLED = (
    "judged every millisecond: the residual crosses the threshold 2.1 ms after a jam from rest, so in the third "
    "sample. The table says 1 or 2 ms, the text 4 ms"
)
HELD = (
    "both keep the old reference; ours goes on integrating the error during a fault, which wins back a part; how the "
    "independent run treats the integral is not known"
)


def main() -> None:
    """Signed errors of the position at the stop, delays, and what each part of the control is worth."""
    sheet = Sheet(__file__, "Stops with four jams", "Aguiar Cota 2019, Table 3.1, 3.2.3")
    both, plain = [], []
    for k, length in enumerate(LENGTHS):
        jams = {"wheels.fault_length": length, "classical_wheels.fault_length": length}
        outcome = run("jam_stopping", jams)
        classical, tolerant = outcome["classical_train.position"][-1], outcome["train.position"][-1]
        both.append((classical, tolerant))
        ms = f"jams of {length * 1e3:g} ms"
        sheet.add(f"classical, {ms}", "m", CLASSICAL[k][0], classical, UNSIGNED, independent=CLASSICAL[k][1])
        sheet.add(f"fault-tolerant, {ms}", "m", TOLERANT[k][0], tolerant, BETTER, independent=TOLERANT[k][1])
        time, fault = outcome["time"], outcome["observer.odometer_fault"]
        begun = time[1:][np.diff(fault) > 0.5]
        assert len(begun) == len(ONSETS)
        first, last = (round(float(delay) * 1e3) for delay in ((begun - ONSETS).min(), (begun - ONSETS).max()))
        latest = f"{first} to {last} ms" if first < last else f"{first} ms"
        said = f"{DELAYS[k] * 1e3:g} ms"
        sheet.add(f"detection, {ms}", "", said, latest, SAMPLED, independent="2 to 3 ms")
        held = run("jam_stopping", {**jams, "controller.replans_after_faults": 0.0})["train.position"][-1]
        plain.append(held)
        sheet.add(f"no new plan after a jam, {ms}", "m", None, held, HELD, independent=WITHOUT[k])
    none = run("jam_stopping", {"wheels.fault_length": 0.0, "classical_wheels.fault_length": 0.0})
    free = "smaller than published; which initial rate of the disturbance and which step were used is not printed"
    sheet.add("fault-tolerant without jams", "m", 0.004, none["train.position"][-1], free, independent=-0.0020)
    alarms = int(np.sum(np.diff(none["observer.odometer_fault"]) > 0.5))
    sheet.add("detections without jams", "1", 0.0, alarms)
    sheet.add("classical without jams", "m", None, none["classical_train.position"][-1], independent=-0.239)
    figure, axis = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
    lengths = np.array(LENGTHS) * 1e3
    axis.plot(lengths, [c for c, _ in both], "o-", label="classical")
    axis.plot(lengths, plain, "s-", label="fault-tolerant, no new plan")
    axis.plot(lengths, [t for _, t in both], "d-", label="fault-tolerant")
    axis.plot(lengths, [p for p, _ in TOLERANT], "k.", label="fault-tolerant, published")
    axis.axhline(0.0, color="grey", lw=0.6)
    axis.set(xlabel="length of each of four jams [ms]", ylabel="position at the stop beyond the mark [m]")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()

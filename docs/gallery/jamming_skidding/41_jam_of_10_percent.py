"""Scenario 3.3.4 with a jam of 10 %: position of odometer and observer at the balise after it, and detection."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.jam_runs import CASES, PERIOD, Jams, at_samples, before_balises, observe, odometer_error, readings, trains
from shared.sheet import Sheet

CASE, NOISE = CASES["3.3.4"], 0.02
JAMS = {(11.0, 2.0): (7.01, -0.22), (16.0, 3.0): (8.70, -0.40), (23.0, 3.0): (7.48, -0.57)}
STORY = "4 m better"
SPEED = "onset and length are not printed; the independent train was re-planned and is slower at that time"
SMALLER = "with the innovation held there is no lag of half a period; the independent observer held the reading"
LATE = (
    "the print lets a verdict take effect one sample late: the first reading of the jam, 3 m/s too low, is used. Gains "
    "of 1.2 1/s2 and 0.4 1/s3 make 0.8 m/s2 of disturbance of it, and the error after the jam sets the fault again, "
    "which then latches. The same rules without that delay give the numbers of the independent run: it had none"
)
AT_ONCE = "the printed rules without their delay, other noise than in the independent run"
TURNED = (
    "ours: the thesis has jams only. A brake does not make a wheel too fast: after 1.2 s the odometer is followed, and "
    "its way is believed, so that a long skid costs what it costs the odometer"
)
DELAY = "the onsets lie on a sample here, which shows the jam at once; the printed rules act one sample later"
RULES: dict[str, tuple[str, dict[str, float]]] = {
    "repaired rules": ("repaired", {}),
    "printed rules": ("printed", {}),
    "printed rules at once": ("printed", {"rule_delay": 0.0}),
}


def main() -> None:
    """Three jams; repaired rules, printed ones, and those without their delay of a sample."""
    sheet = Sheet(__file__, "A jam of 10 %", "Aguiar Cota 2019, section 3.3.4, Figs 3-26 to 3-29")
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    run = trains(CASE, len(JAMS))
    onsets, lengths = (np.array(column) for column in zip(*JAMS, strict=True))
    jams = Jams(onsets, lengths, np.full(len(JAMS), 0.1))
    read = readings(run, jams, NOISE, np.random.default_rng(0), False)
    position, t = at_samples(run.p), PERIOD * np.arange(read.shape[1])
    alone = odometer_error(position, read, 200.0)
    reported = {
        label: observe(CASE, run, read, rules, aggregated=False, estimated_speed=44.1, **values)
        for label, (rules, values) in RULES.items()
    }
    for member, ((onset, length), (sensor, observer)) in enumerate(JAMS.items()):
        rows = before_balises(position[member])
        row = rows[t[rows] > onset + length][0]
        what = f"at the balise after a jam at {onset:g} s of {length:g} s"
        sheet.add(f"true minus odometer position {what}", "m", None, -alone[member, row], SPEED, independent=sensor)
        for label, why in zip(RULES, (SMALLER, LATE, AT_ONCE), strict=True):
            error = position[member, row] - reported[label]["position"][member, row]
            published = STORY if (onset, label) == (16.0, "printed rules") else None
            sheet.add(
                f"true minus estimated position {what}, {label}",
                "m",
                published,
                float(error),
                why,
                repeats=0.2,
                independent=None if label == "repaired rules" else observer,
            )
        for label, found in reported.items():
            fault = found["odometer_fault"][member] > 0.5
            begins = abs(t[fault & (t >= onset - 1e-9)][0] - onset)
            published_delay = 0.4 if label == "printed rules" else None
            sheet.add(
                f"from onset to detection, jam at {onset:g} s, {label}",
                "s",
                published_delay,
                f"{begins:.1f}",
                DELAY,
                independent="0.2 to 0.4",
            )
    fast = readings(run, jams.turned, NOISE, np.random.default_rng(0), False)
    out, sensed = (
        observe(CASE, run, fast, aggregated=False, estimated_speed=44.1),
        odometer_error(position, fast, 200.0),
    )
    for member, (onset, length) in enumerate(JAMS):
        rows = before_balises(position[member])
        row, what = rows[t[rows] > onset + length][0], f"a skid of 10 % at {onset:g} s of {length:g} s"
        sheet.add(f"true minus odometer position, {what}", "m", None, -sensed[member, row], TURNED, repeats=0.05)
        off = position[member, row] - out["position"][member, row]
        sheet.add(f"true minus estimated position, {what}, repaired rules", "m", None, float(off), TURNED, repeats=0.2)
    axis.plot(t, alone[1], label="odometer")
    for label, out in reported.items():
        shown = np.clip(out["position"][1] - position[1], -12.0, 12.0)
        axis.plot(t, shown, label=f"observer, {label}")
    axis.axvspan(16.0, 19.0, color="0.9", zorder=0)
    axis.set(xlabel="time [s]", ylabel="position error [m]", ylim=(-12.0, 12.0), xlim=(0.0, 50.0))
    axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()

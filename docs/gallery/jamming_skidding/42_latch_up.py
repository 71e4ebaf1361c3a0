"""The latch-up of the printed rules, case by case, and what the repaired rules make of it."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.jam_runs import CASES, PERIOD, STANDING, Jams, at_samples, observe, readings, trains
from shared.sheet import Sheet

NOISE, MEMBERS = 0.02, 50
LATE = (
    "share of 50 runs on random phases of the grade that still report a fault just before rest; the independent runs "
    "say that it latches"
)
TURNED = (
    "ours: the thesis has jams only. What the effort does not cause is followed after 1.2 s, and told until a balise "
    "or 20 s of rolling confirm it: longer than the rest of a short braking"
)
OURS = "ours: the longest time from the end of the jam to the end of the fault reported"
CASES_OF_4_12: dict[str, tuple[str, float | None, dict[str, Any]]] = {
    # name: case, length of the jam at 8 s, options
    "3.3.4, start 0.9 m/s off, no arming delay": ("3.3.4", None, {"estimated_speed": 44.1, "arming_delay": 0.0}),
    "3.3.4, jam of 10 % for 3 s": ("3.3.4", 3.0, {}),
    "HS, jam of 10 % for 1.4 s": ("HS", 1.4, {}),
    "AS, jam of 10 % for 1.4 s": ("AS", 1.4, {}),
    "LS, jam of 50 % for 1.4 s": ("LS", 1.4, {}),
}


def main() -> None:
    """Told at rest, with either set of rules."""
    sheet = Sheet(__file__, "The latch-up and its cure", "Aguiar Cota 2019, Algorithm 3-3")
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for number, (name, (key, length, options)) in enumerate(CASES_OF_4_12.items()):
        case, rng = CASES[key], np.random.default_rng(0)
        run = trains(case, MEMBERS, rng)
        depth = 0.5 if key == "LS" else 0.1
        jams = None if length is None else Jams(*(np.full(MEMBERS, x) for x in (8.0, length, depth)))
        read = readings(run, jams, NOISE, rng, True)
        moving = at_samples(run.v) > 2.0 * STANDING
        last = moving.shape[1] - 1 - np.argmax(moving[:, ::-1], axis=1)
        t = PERIOD * np.arange(read.shape[1])
        for rules in ("printed", "repaired"):
            found = observe(case, run, read, rules, with_balises=False, noise=NOISE, **options)
            fault = (found["odometer_fault"] > 0.5) & moving
            share = 100.0 * float(fault[np.arange(MEMBERS), last].mean())
            story = "latches" if rules == "printed" else "not tried"
            sheet.add(
                f"{name}: fault reported before rest, {rules} rules",
                "%",
                None,
                share,
                LATE,
                repeats=0.3,
                independent=story,
            )
            if rules == "repaired" and length is not None:
                over = np.where(fault & (t >= 8.0 + length), t, 0.0).max(axis=1)
                late = float(np.maximum(over + PERIOD - 8.0 - length, 0.0).max())
                sheet.add(
                    f"{name}: fault reported after the jam, repaired rules", "s", None, f"at most {late:.1f}", OURS
                )
            if rules == "repaired" and jams is not None:
                fast = readings(run, jams.turned, NOISE, rng, True)
                on = (observe(case, run, fast, with_balises=False, noise=NOISE)["odometer_fault"] > 0.5) & moving
                share = 100.0 * float(on[np.arange(MEMBERS), last].mean())
                reported = f"{name.replace('jam', 'skid')}: fault reported before rest, repaired rules"
                sheet.add(reported, "%", None, share, TURNED, repeats=0.3)
            if number == 1:
                axis.plot(t, np.clip(found["speed"][0], 0.0, 60.0), label=f"{rules} rules")
        if number == 1:
            axis.plot(t, at_samples(run.v)[0], "k:", label="true")
    axis.set(xlabel="time [s]", ylabel="estimated speed [m/s]", ylim=(0.0, 60.0))
    axis.legend(fontsize=8)
    sheet.finish(figure)


if __name__ == "__main__":
    main()

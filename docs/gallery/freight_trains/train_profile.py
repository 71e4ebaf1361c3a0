"""What the scripts of the chapter 3 train share: run a shipped scenario and compare its speed errors."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np
from shared.line import EQUAL_WITHIN
from shared.sheet import Sheet
from shared.shipped import run

from cosim import Outcome

ZONES = {"traction zone": (10.0, 20.0), "braking zone": (70.0, 80.0)}  # printed
OBSERVERS = {
    "differentiator_cdo": ("S1 differentiator + CDO", {}),
    "takagi_sugeno_cdo": ("S2 Takagi-Sugeno, repaired", {"traction zone": 0.015, "braking zone": 0.025}),
    "multirate_cdo": ("S4 two CDOs", {"traction zone": 0.017, "braking zone": 0.022}),
    "discrete_uio": ("S5 unknown inputs", {}),
}
NO_DATA = (
    "profile, balise pattern, noise and several gains of the thesis are not printed, and its protocol contradicts "
    "itself: only "
    "the order of magnitude can agree; S1 and S5 come without numbers"
)


def compare(script: str, scenario: str, title: str) -> None:
    """Run the scenario, print the largest speed error of each observer in both zones, draw speed and errors.

    Args:
        script: the script's ``__file__``. scenario: name of a shipped scenario. title: of the sheet.
    """
    sheet = Sheet(script, title, "Bouchama 2024, sections 3.4 and 3.5, Figures 3.9-3.16, 3.18-3.23")
    outcome = run(scenario)
    add_largest_errors(sheet, outcome)
    sheet.finish(_figure(outcome))


def add_largest_errors(
    sheet: Sheet, outcome: Outcome, prefix: str = "", repeats: Mapping[str, float] | None = None
) -> None:
    """Lines with the largest speed error of each observer in both zones.

    Args:
        sheet: where they go. outcome: of a run. prefix: of the quantities.
        repeats: by observer, the relative difference that another machine may show.
    """
    t, true = outcome["time"], outcome["locomotive.speed"]
    for name, (label, published) in OBSERVERS.items():
        error = np.abs(outcome[f"{name}.speed"] - true)
        for zone, (start, end) in ZONES.items():
            largest = float(error[(t >= start) & (t <= end)].max())
            words = f"{prefix}{label}: largest speed error, {zone}"
            sheet.add(
                words, "m/s", published.get(zone), largest, NO_DATA, repeats=(repeats or {}).get(name, EQUAL_WITHIN)
            )


def _figure(outcome: Outcome) -> plt.Figure:
    figure, (speeds, errors) = plt.subplots(2, 1, figsize=(8, 6), sharex=True, layout="constrained")
    t, true = outcome["time"], outcome["locomotive.speed"]
    speeds.plot(t, true, "k", label="train")
    speeds.plot(t, outcome["odometer.reading"], "0.6", lw=0.8, label="odometer")
    for name, (label, _) in OBSERVERS.items():
        errors.semilogy(t, np.abs(outcome[f"{name}.speed"] - true) + 1e-6, lw=0.8, label=label)
    for axis, words in ((speeds, "speed [m/s]"), (errors, "speed error [m/s]")):
        axis.set_ylabel(words)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    errors.set_xlabel("time [s]")
    return figure


if __name__ == "__main__":
    raise SystemExit("Run 05_train_profile_d.py or 06_train_profile_b.py.")

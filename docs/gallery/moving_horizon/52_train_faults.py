"""Faults of a train: which are detected, which isolated, how late, and how often an alarm is false; by the stored
results of the study `docs/studies/train_diagnosis.py`, which runs two minutes.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from shared.sheet import Sheet

PAGE = Path(__file__).resolve().parents[2] / "theses" / "train_diagnosis.md"
STUDY = (
    "the thesis diagnoses a wind turbine; the train is ours. Journeys, rails and seeds other than those of thresholds"
)
SMALL = "2 % lies at the thresholds, a share 10 % off below them: masses and gradients are not known better"
LATE = "a reading that is frozen is right until the speed changes: the delay is that of the journey"
WHOLE, SHARE = 100.0, 50.0  # [%]


def stored(study: str) -> list[list[str]]:
    """Rows of a table that the study wrote into its page, without the heading.

    Args:
        study: name of the table.
    """
    text = PAGE.read_text(encoding="utf-8").split(f"<!-- study: {study} -->")[1].split("<!-- end -->")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def number(cell: str) -> float:
    """The first number of a cell, NaN for none.

    Args:
        cell: of the table.
    """
    return np.nan if cell == "-" else float(cell.split(maxsplit=1)[0])


def draw_shares(axis: Axes, rows: list[list[str]]) -> None:
    """Detected, with its interval, and isolated rightly.

    Args:
        axis: to draw on. rows: of the faults.
    """
    for place, row in enumerate(rows):
        low, high = (float(end) for end in row[2].split("(")[1].rstrip(")").split(" to "))
        first = place == 0
        axis.plot([low, high], [place] * 2, "C0-", lw=3.0, alpha=0.4, label="detected, 95 %" if first else None)
        axis.plot(number(row[2]), place, "C0o", label="detected" if first else None)
        axis.plot(number(row[5]), place, "C3x", label="isolated rightly" if first else None)
    axis.set(xlabel="Share of the runs [%]", xlim=(-3.0, 103.0))
    axis.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=7)
    axis.set_ylim(len(rows) - 0.5, -0.5)


def draw_delays(axis: Axes, rows: list[list[str]]) -> None:
    """Median of the delay, and within which 95 % of the detections come.

    Args:
        axis: to draw on. rows: of the faults.
    """
    for place, row in enumerate(rows):
        first = place == 0
        axis.plot([number(row[3]), number(row[4])], [place] * 2, "C0-", label="to 95 % of them" if first else None)
        axis.plot(number(row[3]), place, "C0o", label="median" if first else None)
    axis.set(xscale="log", xlabel="Delay of the detection [s]", xlim=(0.08, 100.0))
    axis.set_xticks([0.1, 1.0, 10.0, 100.0], ["0.1", "1", "10", "100"])


def draw_alarms(axis: Axes, rows: list[list[str]]) -> None:
    """False alarms an hour, with their intervals.

    Args:
        axis: to draw on. rows: of the fault-free journeys.
    """
    for column, mark, text in ((2, "C0o", "suspected or isolated"), (3, "C3x", "isolated")):
        for place, row in enumerate(rows):
            rate, low, high = rates(row[column])
            shifted = place + (0.12 if column == 3 else -0.12)
            axis.plot([low, high], [shifted] * 2, f"{mark[:2]}-", lw=1.5)
            axis.plot(rate, shifted, mark, label=text if place == 0 else None)
    axis.set_xscale("symlog", linthresh=0.1)
    axis.set_xticks([0.0, 0.1, 1.0, 10.0], ["0", "0.1", "1", "10"])
    axis.set(xlabel="False alarms [1/h], 95 %", xlim=(-0.01, 20.0), ylim=(len(rows) - 0.5, -0.5))
    axis.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=7)


def rates(cell: str) -> tuple[float, float, float]:
    """Rate and its interval from ``count: rate (low to high)`` [1/h].

    Args:
        cell: of the table.
    """
    rate, span = cell.split(": ")[1].split(" (")
    low, high = span.rstrip(")").split(" to ")
    return float(rate), float(low), float(high)


def main() -> None:
    """All faults of the study; in the table the sums, and those that are late or missed."""
    sheet = Sheet(__file__, "Train: faults, isolation, false alarms", "Omar 2012, chapter 7, for a train (ours)")
    faults, alarms = stored("faults"), stored("alarms")
    always = sum(number(row[2]) == WHOLE for row in faults)
    alone = sum(number(row[5]) >= WHOLE - 2.0 for row in faults)
    sheet.add(f"detected in every run, of {len(faults)} faults", "1", None, float(always), SMALL)
    sheet.add("isolated rightly in 98 % of the runs and more", "1", None, float(alone), SMALL)
    sheet.add("isolated wrongly, largest share", "%", None, max(number(row[6]) for row in faults), STUDY)
    turned = stored("turned")
    whole = sum(number(row[3]) == WHOLE for row in turned)
    sheet.add(f"of the other sign: detected in every run, of {len(turned)} faults", "1", None, float(whole), SMALL)
    least = sum(number(row[7]) >= WHOLE - 2.0 for row in turned)
    sheet.add("of the other sign: isolated rightly in 98 % of the runs and more", "1", None, float(least), SMALL)
    wrong = max(number(row[9]) for row in turned)
    sheet.add("of the other sign: isolated wrongly, largest share", "%", None, wrong, STUDY)
    quick = [row for row in faults if number(row[2]) > SHARE]
    sheet.add("delay, median over faults", "s", None, float(np.median([number(row[3]) for row in quick])), STUDY)
    for row in quick:
        if number(row[3]) > 10.0:
            sheet.add(f"{row[0]}: delay", "s", None, number(row[3]), LATE if "frozen" in row[0] else STUDY)
    for row in faults:
        if number(row[2]) < WHOLE:
            sheet.add(f"{row[0]}: detected", "%", None, row[2], SMALL)
    for row in alarms:
        sheet.add(f"false alarms, {row[0]}, {row[1]} h", "1/h", None, row[2].split(": ")[1], STUDY)
        sheet.add(f"of these isolated, {row[0]}", "1/h", None, row[3].split(": ")[1], STUDY)

    figure = plt.figure(figsize=(9.0, 9.0), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=[len(faults), 5])
    shares = figure.add_subplot(grid[0, 0])
    delays = figure.add_subplot(grid[0, 1], sharey=shares)
    rare = figure.add_subplot(grid[1, :])
    draw_shares(shares, faults)
    draw_delays(delays, faults)
    draw_alarms(rare, alarms)
    delays.tick_params(labelleft=False)
    for axis, place in ((shares, "center"), (delays, "lower right"), (rare, "upper right")):
        axis.grid(visible=True, alpha=0.3)
        axis.legend(fontsize=7, loc=place)
    sheet.finish(figure)


if __name__ == "__main__":
    main()

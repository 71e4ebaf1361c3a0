"""The ten faults of the wind turbine, over ten seeds, and its false alarms: the tables of docs/theses/wind_turbine.md.

``python docs/studies/wind_turbine_faults.py`` (four minutes) prints them, with ``--write`` it puts them into the page.
The limits of the diagnosis come from other runs than those that it is judged by.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from page_tables import write_table
from wind_turbine_loop import ALARM_NAMES, DIAGNOSIS, INTERVALS, PEAKS, SPEED_SENSORS, Outcome, run_members

from fmu_observer.formulas.diagnosis.thresholds import alarm_rate, proportion_interval

PAGE = Path(__file__).resolve().parents[1] / "theses" / "wind_turbine.md"
STOP = 4400.0  # [s]
MADE_OF = range(100, 110)
EVALUATES = range(10)
PUBLISHED = {
    1: ("0 / 3 Ts", "10 Ts"),
    2: ("0 / 2 Ts", "10 Ts"),
    3: ("3 / 6 Ts", "10 Ts"),
    4: ("3 / 7 Ts", "10 Ts"),
    5: ("4 / 6 Ts", "10 Ts"),
    6: ("3 / 8 Ts", "10 Ts"),
    7: ("3 / 3 Ts", "5 Ts"),
    8: ("50 s", "8 Ts"),
    9: ("8.5 s", "600 Ts"),
    10: ("200 / 230 s", "none"),
}
WHAT = {
    1: "pitch sensor stuck at 10 deg",
    2: "pitch sensor, gain 5",
    3: "rotor speed sensor stuck at 3.5 rad/s",
    4: "rotor speed sensor, gain 5",
    5: "generator speed sensor stuck at 50 rad/s",
    6: "generator speed sensor, gain 5",
    7: "converter, 1000 N.m off",
    8: "pitch actuator, abrupt",
    9: "pitch actuator, slow",
    10: "efficiency 0.25",
}
STRONG = {"mean_from": 14.0, "mean_to": 14.0, "sine_amplitude": 0.0}


SHARES = (0.005, 0.01, 0.02, 0.03, 0.05, 0.1)
OFF: tuple[tuple[str, tuple[int, ...], int | None], ...] = (  # text, sensors, place of the alarm that isolates it
    ("first rotor sensor", (0,), ALARM_NAMES.index("rotor_sensor_fault[1]")),
    ("second rotor sensor", (1,), ALARM_NAMES.index("rotor_sensor_fault[2]")),
    ("first generator sensor", (2,), ALARM_NAMES.index("generator_sensor_fault[1]")),
    ("second generator sensor", (3,), ALARM_NAMES.index("generator_sensor_fault[2]")),
    ("both rotor sensors", (0, 1), None),
    ("both generator sensors", (2, 3), None),
    ("all four", (0, 1, 2, 3), None),
    ("`gear_ratio`", (), None),
)


def time_text(values: np.ndarray) -> str:
    """Median and largest of times, in samples where they are short."""
    there = values[~np.isnan(values)]
    if there.size == 0:
        return "-"
    median, most = np.median(there), np.max(there)
    if most < 1.0:
        return f"{median / 0.01:.0f} ({most / 0.01:.0f}) Ts"
    return f"{median:.3g} ({most:.3g}) s"


def fault_row(number: int, outcome: Outcome, members: slice, where: str = "") -> list[str]:
    """A row of the table of faults.

    Args:
        number: of the fault. outcome: of the batch. members: which of it. where: said after the fault.
    """
    onset, clear = outcome.onset[members], np.maximum(outcome.gone[members] + 0.01, 0.0)
    seen = int(np.count_nonzero(~np.isnan(onset)))
    if number == 10:
        # Of the estimate: within 0.05 of 0.25, and back above 0.9.
        t, found = outcome.instants, outcome.efficiency[members]
        onset = np.array([t[(t > 2000.0) & (np.abs(row - 0.25) < 0.05)][0] - 2000.0 for row in found])
        clear = np.array([t[(t > 3400.0) & (row > 0.9)][0] - 3400.0 for row in found])
    low, high = proportion_interval(seen, len(onset))
    false = int(outcome.false[members].sum())
    published, limit = PUBLISHED[number]
    return [
        f"{number}",
        WHAT[number] + where,
        published,
        limit,
        f"{seen} of {len(onset)} ({low:.2f} to {high:.2f})",
        time_text(onset),
        time_text(clear),
        f"{np.mean(outcome.coverage[members]):.3f}",
        f"{false}",
    ]


def faults_table() -> str:
    """Detection and clearing of each fault: the ten of the benchmark, two of them in strong wind as well."""
    count = len(EVALUATES)
    head = ["", "fault", "published", "limit", "seen", "onset, median (largest)", "gone, median (largest)", "coverage"]
    rows = [[*head, "other alarms"]]
    for number in PUBLISHED:
        print(f"fault {number} of {len(PUBLISHED)}", file=sys.stderr, flush=True)
        after = 400.0 if number == 10 else 100.0  # [s] for the alarm to clear
        outcome = run_members([number] * count, [*EVALUATES], INTERVALS[number][1] + after)
        rows.append(fault_row(number, outcome, slice(None)))
    strong = run_members([8] * count + [9] * count, [*EVALUATES] * 2, 1000.0, (500.0, 600.0), **STRONG)
    rows += [fault_row(8, strong, slice(0, count), ", 14 m/s"), fault_row(9, strong, slice(count, None), ", 14 m/s")]
    return markdown(rows)


def limits_table() -> str:
    """Limits, what they were made of, and false alarms where they were not made."""
    made = run_members([0] * len(MADE_OF), [*MADE_OF], STOP)
    evaluated = run_members([0] * len(EVALUATES), [*EVALUATES], STOP)
    sine = run_members([0] * 2, [20, 21], STOP, mean_to=9.0, sine_amplitude=4.0, turbulence_std=0.0)
    strong = run_members([0] * 8, [*range(30, 38)], 1100.0, **STRONG)
    limits = {
        s.name.removesuffix("_limit"): (s.start, s.unit) for s in DIAGNOSIS.parameters if s.name.endswith("_limit")
    }
    rows = [["residual", "limit", "largest in the 10 runs it was made of", "in 10 others", "sine", "14 m/s"]]
    for i, (name, _) in enumerate(PEAKS):
        limit, unit = limits[name]
        peaks = [f"{outcome.peaks[:, i].max():.3g}" for outcome in (made, evaluated, sine, strong)]
        rows.append([name.replace("_", " "), f"{limit:g} {unit}".removesuffix(" 1"), *peaks])
    false = []
    for text, outcome, hours in (
        ("ten other seeds, 4400 s each", evaluated, len(EVALUATES) * STOP / 3600.0),
        ("wind 9 + 4 sin(0.01 t) m/s, two seeds of 4400 s", sine, 2 * STOP / 3600.0),
        ("14 m/s with turbulence, eight seeds of 1100 s", strong, 8 * 1100.0 / 3600.0),
    ):
        counts = outcome.false.sum(axis=0)
        names = (*ALARM_NAMES, "not isolated")
        kinds = ", ".join(f"{names[i]}: {int(n)}" for i, n in enumerate(counts) if n) or "none"
        false.append([text, kinds, str(alarm_rate(int(counts.sum()), hours))])
    return markdown(rows) + "\n\n" + markdown([["without a fault", "alarms", "false alarms"], *false])


def sizes_table() -> str:
    """How large an offset of the torque has to be."""
    sizes = [1.0, 0.5, 0.2, 0.1, 0.01]
    seeds = [*range(5)]
    members = [(size, seed) for size in sizes for seed in seeds]
    size, seed = np.array(members).T
    outcome = run_members([7] * len(members), seed.tolist(), 200.0, (100.0, 150.0), size=size)
    rows = [["offset [N.m]", "seen", "onset, median (largest)", "coverage"]]
    for i, value in enumerate(sizes):
        part = slice(i * len(seeds), (i + 1) * len(seeds))
        seen = int(np.count_nonzero(~np.isnan(outcome.onset[part])))
        cover = f"{np.mean(outcome.coverage[part]):.3f}"
        rows.append([f"{1000.0 * value:g}", f"{seen} of {len(seeds)}", time_text(outcome.onset[part]), cover])
    return markdown(rows)


def speeds_table() -> str:
    """Sensors of the speeds that are off by a share: one of a pair, both, all; and a ratio of the gear that is.

    Closed loops in turbulent wind, fault from 100 to 150 s, five seeds and both signs of each size.
    """
    signs, seeds = (1.0, -1.0), range(40, 45)
    members = [(sign * size, seed) for size in SHARES for sign in signs for seed in seeds]
    share, seed = np.array(members).T
    rows = [["off", "share [%]", "detected", "after, median (largest)", "of the time", "isolated, right / another"]]
    for text, which, own in OFF:
        values = {f"off[{i + 1}]": share for i in which} or {"gear_ratio": 95.0 * (1.0 + share)}
        outcome = run_members([SPEED_SENSORS] * len(members), seed.tolist(), 200.0, (100.0, 150.0), **values)
        right = outcome.false[:, own] > 0.0 if own is not None else np.zeros(len(members), bool)
        named = outcome.false[:, : len(ALARM_NAMES)].sum(axis=1) > 0.0
        for i, size in enumerate(SHARES):
            part = slice(i * len(signs) * len(seeds), (i + 1) * len(signs) * len(seeds))
            seen = f"{np.count_nonzero(~np.isnan(outcome.onset[part]))} of {len(seeds) * len(signs)}"
            reported = f"{np.count_nonzero(right[part])} / {np.count_nonzero(named[part] & ~right[part])}"
            time, cover = time_text(outcome.onset[part]), f"{np.mean(outcome.coverage[part]):.3f}"
            rows.append([text, f"{100.0 * size:g}", seen, time, cover, reported])
    return markdown(rows)


def markdown(rows: list[list[str]]) -> str:
    """A table, its first row the heading."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


TABLES = {"speeds": speeds_table, "sizes": sizes_table, "limits": limits_table, "faults": faults_table}


def main() -> None:
    """Print the tables, or write them into the page."""
    for number, (name, make) in enumerate(TABLES.items(), start=1):
        print(f"{number} of {len(TABLES)}: {name}", file=sys.stderr, flush=True)
        table = make()
        if "--write" in sys.argv:
            write_table(PAGE, name, table)
        else:
            print(table, end="\n\n", flush=True)


if __name__ == "__main__":
    main()

"""Jam detection in numbers: missed and false alarms, delays, latch-ups; printed and repaired rules; a wheel that never
rolls again.

``python docs/studies/jam_detection.py`` (half a minute) writes the tables of docs/theses/jam_detection.md and draws
docs/images/jam_detection.png. The trains and their jams are synthetic; they are those of ``docs/gallery/jam_runs.py``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from page_tables import write_table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "gallery"))

from jam_runs import (
    CASES,
    PERIOD,
    STEP,
    Jams,
    Verdicts,
    at_samples,
    counted,
    observe,
    odometer_error,
    random_jams,
    readings,
    station_stop,
    trains,
    verdicts,
)

from cosim.drawing.style import RC
from fmu_observer.detection.repaired_jam_rules import certain_fault, doubt_limit
from fmu_observer.formulas.diagnosis.thresholds import clopper_pearson, garwood
from fmu_observer.observers.train import QuasiLpvUio
from fmus.tables.numbers import number
from plant_models.railway.sensors.pulses import reading_bound

LENGTHS = (0.05, 0.1, 0.2, 0.4, 0.6, 1.0, 2.0, 3.0, 5.0)  # [s]
DEPTHS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
NOISES = (0.0, 0.02, 0.05, 0.1)  # [m/s]
SEED, NOISE = 1, 0.02
PAGE = Path(__file__).resolve().parents[1] / "theses" / "jam_detection.md"
PICTURE = PAGE.parent / "images" / "jam_detection.png"
RULES = ("repaired", "printed")
SIGNS = ("jam", "skid")


def one(
    case: str, rules: str, members: int, noise: float = NOISE, fault: str = "jam", **jam: Sequence[float]
) -> tuple[Jams, Verdicts]:
    """Random jams or skids in one case, with one set of rules; the same trains and readings for both."""
    rng = np.random.default_rng(SEED)
    run = trains(CASES[case], members, rng)
    jams = random_jams(rng, members, CASES[case], jam.get("lengths", LENGTHS), jam.get("depths", DEPTHS))
    jams = jams if fault == "jam" else jams.turned
    read = readings(run, jams, noise, rng, True)
    found = observe(CASES[case], run, read, rules, with_balises=CASES[case].speed > 20.0, noise=noise)
    return jams, verdicts(run, jams, found["odometer_fault"])


def rates_table(members: int = 500) -> str:
    """Missed, false, late, latched for each case, rules and noise."""
    head = (
        "| case | noise [m/s] | rules | fault | missed of all [%] | false alarms per hour, 95 % | delay at start [s] | "
    )
    lines = [head + "latest end [s] | on at rest [%] |", "|---|---|---|---|---|---|---|---|---|"]
    for case, noise, rules, fault in product(CASES, NOISES, RULES, SIGNS):
        _, v = one(case, rules, members, noise, fault)
        missed, false = int((~v.found).sum()), int(v.false.sum())
        low, high = clopper_pearson(missed, members)
        few, many = garwood(false, float(v.moving.sum()) / 3600.0)
        latest = float(np.nanmax(v.late)) if np.isfinite(v.late).any() else np.nan
        delay = f"{np.nanmean(v.delay):.2f}" if missed < members else "-"
        share = f"{100 * missed / members:.1f} ({100 * low:.1f} to {100 * high:.1f})"
        lines.append(
            f"| {case} | {noise:g} | {rules} | {fault} | {share} | "
            f"{number(false / (float(v.moving.sum()) / 3600.0))} ({number(few)} to {number(many)}) | "
            f"{delay} | {'-' if np.isnan(latest) else 'never' if np.isinf(latest) else f'{latest:.2f}'} | "
            f"{100 * v.on.mean():.1f} |"
        )
    return "\n".join(lines)


def sizes_table(members: int = 1000) -> str:
    """Faults by the largest error of a reading that they make, beside the sizes that the rules can tell from noise."""
    head = "| case | noise [m/s] | one in two from [m/s] | all from [m/s] | found of smaller ones [%] | between [%] | "
    lines = [head + "of larger ones [%] |", "|---|---|---|---|---|---|---|"]
    observer = QuasiLpvUio()
    for name, noise in product(CASES, NOISES):
        case, rng = CASES[name], np.random.default_rng(SEED)
        p = observer.unpack_parameters(observer.start_parameters(case.preset))
        p = p._replace(threshold=case.threshold, odometer_noise=float(reading_bound(noise, 0.0, 1.0, PERIOD)))
        half, sure = float(doubt_limit(p) / p.residual_gain), float(certain_fault(p))
        run, sizes, found = trains(case, members, rng), [], []
        for fault in SIGNS:
            jams, v = one(name, "repaired", members, noise, fault)
            error = readings(run, jams, 0.0, rng, True) - readings(run, None, 0.0, rng, True)
            sizes.append(np.abs(error).max(axis=1))
            found.append(v.found)
        size, was = np.concatenate(sizes), np.concatenate(found)
        parts = (size <= half, (size > half) & (size <= sure), size > sure)
        shares = [f"{100.0 * was[part].mean():.1f}" if part.any() else "-" for part in parts]
        lines.append(f"| {name} | {noise:g} | {half:.3f} | {sure:.3f} | " + " | ".join(shares) + " |")
    return "\n".join(lines)


def stops_table(members: int = 200) -> str:
    """Station stops of 40 s and 5 min: one fault a member of either sign, before or after the stop or in the cruise."""
    head = "| stop [s] | teeth | noise [m/s] | fault | missed of all faults [%] | false alarms per hour, 95 % | "
    lines = [head + "position error, mean / largest [m] | odometer [m] |", "|---|---|---|---|---|---|---|---|"]
    for stand, teeth, noise, fault in product((40.0, 300.0), (100, 1000), (0.02, 0.05), SIGNS):
        lines.append(f"| {stand:g} | {teeth} | {noise:g} | {fault} | {_stop(stand, teeth, noise, fault, members)} |")
    return "\n".join(lines)


def _stop(stand: float, teeth: int, noise: float, fault: str, members: int) -> str:
    rng = np.random.default_rng(SEED)
    run, effort = station_stop(stand, members, rng)
    moving = [(31.0, 49.0), (62.0 + stand, 120.0 + stand)]  # braking; departure and cruise
    first = np.where(rng.random(members) < 0.5, rng.uniform(*moving[0], members), rng.uniform(*moving[1], members))
    faults = Jams(first, rng.choice(LENGTHS[:-1], members), rng.choice(DEPTHS, members))
    faults = faults if fault == "jam" else faults.turned
    read = readings(run, faults, noise, rng, True)
    read = counted(read, teeth)
    case, sensor = CASES["3.3.4"]._replace(speed=20.0), {"noise": noise, "teeth": teeth}
    reported = observe(case, run, read, effort=effort, with_balises=False, **sensor)
    v = verdicts(run, faults, reported["odometer_fault"], standing=True)
    missed, false, hours = int((~v.found).sum()), int(v.false.sum()), float(v.moving.sum()) / 3600.0
    share, few = clopper_pearson(missed, members), garwood(false, hours)
    error = np.abs(reported["position"] - at_samples(run.p))[:, -1]
    alone = np.abs(odometer_error(at_samples(run.p), read, np.inf))[:, -1]
    return (
        f"{100 * missed / members:.1f} ({100 * share[0]:.1f} to {100 * share[1]:.1f}) | {number(false / hours)} "
        f"({number(few[0])} to {number(few[1])}) | {error.mean():.2f} / {error.max():.1f} | "
        f"{alone.mean():.2f} / {alone.max():.1f}"
    )


def found_table(case: str = "3.3.4", members: int = 3000) -> tuple[str, dict[str, np.ndarray]]:
    """Share of jams found by length and depth, as a table of the repaired rules and as arrays of both."""
    shares = {}
    for rules in RULES:
        jams, v = one(case, rules, members)
        shares[rules] = np.array(
            [[v.found[(jams.depth == d) & (jams.length == n)].mean() for n in LENGTHS] for d in DEPTHS]
        )
    lines = ["| depth | " + " | ".join(f"{1000 * n:g} ms" for n in LENGTHS) + " |", "|---|" + "---|" * len(LENGTHS)]
    for depth, row in zip(DEPTHS, shares["repaired"], strict=True):
        lines.append(f"| {100 * depth:g} % | " + " | ".join(f"{100 * share:.0f}" for share in row) + " |")
    return "\n".join(lines), shares


def stuck_table(members: int = 100) -> str:
    """A wheel that never rolls again, from 16 s on in scenario 3.3.4, with and without balises."""
    case, lines = CASES["3.3.4"], []
    lines.append("| depth | balises | told, share of the time [%] | largest position error [m] | odometer alone [m] |")
    lines.append("|---|---|---|---|---|")
    for depth, fault, with_balises in product((0.05, 0.1, 0.3, 1.0), SIGNS, (True, False)):
        rng = np.random.default_rng(SEED)
        run = trains(case, members, rng)
        jams = Jams(*(np.full(members, value) for value in (16.0, 1e3, depth)))
        read = readings(run, jams if fault == "jam" else jams.turned, NOISE, rng, True)
        found = observe(case, run, read, with_balises=with_balises, noise=NOISE)
        t, every = PERIOD * np.arange(read.shape[1]), round(PERIOD / STEP)
        window = (t > 17.0) & (run.v[:, ::every].min(axis=0) > 1.0)
        error = np.abs(found["position"] - run.p[:, ::every])[:, window].max()
        alone = np.abs(odometer_error(run.p[:, ::every], read, 200.0 if with_balises else np.inf)[:, window]).max()
        reported = 100.0 * float((found["odometer_fault"][:, window] > 0.5).mean())
        side, laid = "low" if fault == "jam" else "high", "every 200 m" if with_balises else "none"
        lines.append(f"| {100 * depth:g} % {side} | {laid} | {reported:.0f} | {error:.1f} | {alone:.1f} |")
    return "\n".join(lines)


def micro_table(members: int = 200) -> str:
    """Micro-jams: full, 10 ms in every 200 ms and fewer, from 10 s on: the residual shows nothing, the balises do."""
    case = CASES["3.3.4"]
    lines = [
        "| jam, or skid, in each 0.2 s | reading low by [%] | told, share of the time [%] | "
        "largest position error [m] | odometer alone [m] |",
        "|---|---|---|---|---|",
    ]
    for share in (0.005, 0.01, 0.02, 0.03, -0.005, -0.01, -0.02, -0.03):
        rng = np.random.default_rng(SEED)
        run = trains(case, members, rng)
        read = readings(run, None, NOISE, rng, True)
        t, every = PERIOD * np.arange(read.shape[1]), round(PERIOD / STEP)
        growing = np.clip((t - 10.0) / 10.0, 0.0, 1.0)  # more and more of them: no edge to be seen
        read = read * (1.0 - share * growing)
        found = observe(case, run, read, noise=NOISE)
        window = (t > 20.0) & (run.v[:, ::every].min(axis=0) > 1.0)
        error = np.abs(found["position"] - run.p[:, ::every])[:, window].max()
        reported = 100.0 * float((found["odometer_fault"][:, window] > 0.5).mean())
        alone = np.abs(odometer_error(run.p[:, ::every], read, 200.0)[:, window]).max()
        lines.append(f"| {200 * abs(share):g} ms | {100 * share:g} | {reported:.0f} | {error:.1f} | {alone:.1f} |")
    return "\n".join(lines)


def draw(shares: dict[str, np.ndarray], path: Path = PICTURE) -> None:
    """Share of jams found over their length, a curve for each depth, and the same for the end of the fault."""
    mpl.rcParams.update(RC)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    colours = plt.cm.viridis(np.linspace(0.0, 0.9, len(DEPTHS)))
    for depth, row, colour in zip(DEPTHS, shares["repaired"], colours, strict=True):
        left.plot(LENGTHS, 100.0 * row, "o-", ms=3, color=colour, label=f"{100 * depth:g} %")
    for row, colour in zip(shares["printed"], colours, strict=True):
        left.plot(LENGTHS, 100.0 * row, ":", lw=1, color=colour)
    left.set(xscale="log", xlabel="length of the jam [s]", ylabel="found [%]")
    left.legend(title="depth; dotted: printed rules", fontsize=7, title_fontsize=7)
    for rules, style in (("repaired", "-"), ("printed", ":")):
        for case, colour in zip(("3.3.4", "HS", "AS"), ("C0", "C1", "C2"), strict=True):
            _, v = one(case, rules, 1000)
            late = np.sort(v.late[~np.isnan(v.late)])
            right.plot(
                late, 100.0 * np.arange(1, len(late) + 1) / len(late), style, color=colour, label=f"{case}, {rules}"
            )
    right.set(xlim=(0.0, 2.5), xlabel="end of the fault told after that of the jam [s]", ylabel="of the jams found [%]")
    right.legend(fontsize=7)
    for axis in (left, right):
        axis.grid(alpha=0.3)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Write all tables into the page, and the picture."""
    found, shares = found_table()
    for name, table in (
        ("rates", rates_table()),
        ("sizes", sizes_table()),
        ("stops", stops_table()),
        ("found", found),
        ("stuck", stuck_table()),
        ("micro", micro_table()),
    ):
        write_table(PAGE, name, f"\n{table}\n")
        print(table, end="\n\n")
    draw(shares)


if __name__ == "__main__":
    main()

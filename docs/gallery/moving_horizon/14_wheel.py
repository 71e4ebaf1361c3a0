"""Jams of an odometer's wheel told by the signature of its record, beside the rules that know effort and balises."""

from __future__ import annotations

from copy import deepcopy
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
import wheel_records
from shared.jam_runs import CASES, PERIOD, Case, Verdicts, observe, random_jams, readings, trains, verdicts
from shared.sheet import Sheet

import fmus
from cosim.evaluation.fault_detection import clopper_pearson, garwood
from fmu_observer.detection import WheelSignature
from fmu_observer.detection.wheel_signature import DROP, RISE, STEADY, WHEEL_CLASSES

HELD_OUT_SEED, MEMBERS, NOISES = 77, 100, (0.02, 0.05)
OURS = "the thesis has no train: plant, faults, classes and detector are ours; seed {seed}, the training had seed 1"
WINDOWS = OURS.format(seed=2)


def by_signature(read: np.ndarray) -> np.ndarray:
    """`odometer_fault` of the detector at the readings, shape (members, samples)."""
    batch = fmus.Batch(WheelSignature(), len(read))
    batch.set("odometer", read[:, 0])
    batch.start()
    ahead = np.concatenate([read[:, 1:], read[:, -1:]], axis=1)  # a sample sees the reading of its own instant
    found = batch.run(PERIOD * np.arange(1, read.shape[1]), results=["odometer_fault"], inputs={"odometer": ahead})
    return np.asarray(found[:, :, 0])


def evaluated(case: Case, *, skids: bool = False) -> dict[tuple[str, float], Verdicts]:
    """Verdicts of both at each noise, on the same trains and jams, or on skids of their size."""
    rng = np.random.default_rng(HELD_OUT_SEED)
    run = trains(case, MEMBERS, rng)
    jams = random_jams(rng, MEMBERS, case, wheel_records.LENGTHS, wheel_records.DEPTHS)
    jams = jams.turned if skids else jams
    parts = {noise: readings(run, jams, noise, deepcopy(rng), True) for noise in NOISES}
    by_rules = [
        observe(case, run, read, with_balises=case.speed > 20.0, noise=noise)["odometer_fault"]
        for noise, read in parts.items()
    ]
    reported = {"signature": by_signature(np.concatenate([*parts.values()])), "rules": np.concatenate(by_rules)}
    return {
        (which, noise): verdicts(run, jams, part)
        for which, both in reported.items()
        for noise, part in zip(NOISES, np.split(both, len(NOISES)), strict=True)
    }


def main() -> None:
    """Classes of single records, then missed and false alarms, delays and ends over whole brakings."""
    sheet = Sheet(__file__, "A jammed wheel by signature and by rules", "ours, after Omar 2012, section 3.4")
    recorded, labels = wheel_records.records(2)
    found = np.array(WHEEL_CLASSES.labels)[WHEEL_CLASSES.classify(recorded, strip=0.0).index]
    for label in (STEADY, DROP, RISE):
        share = 100.0 * np.mean(found[np.array(labels) == label] == label)
        sheet.add(f"records classified right, {label}", "%", None, share, WINDOWS)
    why = OURS.format(seed=HELD_OUT_SEED)
    shown: dict[str, list[tuple[float, float]]] = {"signature": [], "rules": []}
    for sign in ("", ", skids"):
        by_case = [evaluated(case, skids=bool(sign)) for case in CASES.values()]
        for noise, (which, bars) in product(NOISES, shown.items()):
            verdicts_of = [verdict[which, noise] for verdict in by_case]
            rates = add_rates(sheet, f"{which}{sign}, noise {noise:g} m/s", verdicts_of, why)
            if not sign:
                bars.append(rates)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
    for axis, i, name in ((axes[0], 0, "missed jams [%]"), (axes[1], 1, "false alarms per hour")):
        for k, (which, values) in enumerate(shown.items()):
            axis.bar(np.arange(len(NOISES)) + 0.35 * k, [v[i] for v in values], 0.35, label=which)
        axis.set_xticks(np.arange(len(NOISES)) + 0.175, [f"{noise:g} m/s" for noise in NOISES])
        axis.set(xlabel="noise of a reading", ylabel=name)
    axes[0].legend()
    sheet.finish(figure)


def add_rates(sheet: Sheet, name: str, verdicts_of: list[Verdicts], why: str) -> tuple[float, float]:
    """Lines of one detector at one noise; missed [%] and false alarms [1/h]."""
    missed, total = np.array([(~v.found).sum() for v in verdicts_of]), len(CASES) * MEMBERS
    false, hours = int(sum(v.false.sum() for v in verdicts_of)), sum(v.moving.sum() for v in verdicts_of) / 3600.0
    low, high = clopper_pearson(int(missed.sum()), total)
    text = f"{100.0 * missed.sum() / total:.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"
    sheet.add(f"missed jams, {name}", "%", None, text, why)
    sheet.add(f"of them from 17 m/s, {name}", "%", None, 100.0 * missed[-1] / MEMBERS, why)
    few, many = garwood(false, hours)
    sheet.add(f"false alarms, {name}", "1/h", None, f"{false / hours:.1f} ({few:.1f} to {many:.1f})", why)
    delays = np.concatenate([v.delay for v in verdicts_of])
    late = np.concatenate([v.late for v in verdicts_of])
    sheet.add(f"mean delay, {name}", "s", None, float(np.nanmean(delays)), why)
    sheet.add(f"median of the end after the jam's, {name}", "s", None, float(np.median(late[~np.isnan(late)])), why)
    still = float(100.0 * np.concatenate([v.on for v in verdicts_of]).mean())
    sheet.add(f"still reported when the train stands, {name}", "%", None, still, why)
    return 100.0 * float(missed.sum()) / total, false / hours


main()

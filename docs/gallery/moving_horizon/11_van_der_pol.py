"""Signatures of the Van der Pol oscillator and what they say of its three parameters; Figures 2.10 to 2.19."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

import fmus
from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.properties import branch_tips, printed_branches, printed_tip
from fmu_observer.observers.generic.signature import SignatureTrack
from plant_models.exhibits import VanDerPol

NOMINAL = (1.5, 2.25, 0.0)
SWEEPS = ((1.0, 1.2, 1.4, 1.6, 1.8, 2.0), (1.5, 1.8, 2.1, 2.4, 2.7, 3.0), (0.0, 0.02, 0.04, 0.06, 0.08, 0.1))
LENGTHS = (0.198, 0.249, 0.307, 0.362, 0.411, 0.452)
TIPS = (0.0351, 0.0417, 0.0490, 0.0559, 0.0635, 0.0695)
GAPS = (0.0021, 0.0090, 0.0198, 0.0306, 0.0416, 0.0523)
BESIDE = {
    (1.0, 2.25): 0.018,
    (1.5, 2.25): 0.025,
    (2.0, 2.25): 0.020,
    (1.5, 1.5): 0.017,
    (1.5, 3.0): 0.032,
}  # r3 at p3 = .05
DRAWN = "the thesis draws it and prints no number; start, burn-in and eps are ours: (1, 0), 20 s, 1e-3"
GROWS = "in words: the length grows with p1"
PRINTED = (
    "the printed formula asks for abscissas at the ordinate of the tip and finds points far left, or hops between tips"
)
BURN_IN, SAMPLES = 2000, 500


def records(parameters: np.ndarray) -> np.ndarray:
    """Measured output at 100 Hz, shape (samples, members), of parameters of shape (members, 3)."""
    batch = fmus.Batch(VanDerPol(), len(parameters))
    for name, values in zip(("p1", "p2", "p3"), parameters.T, strict=True):
        batch.set(name, values)
    batch.start()
    found = batch.run(0.01 * np.arange(1, BURN_IN + SAMPLES), results=["measured"])
    return np.asarray(found[:, :, 0].T)


def verdicts(recorded: np.ndarray) -> np.ndarray:
    """Verdicts of `signature_track` at the end, shape (members, 3)."""
    batch = fmus.Batch(SignatureTrack(), recorded.shape[1])
    batch.start()
    names = ["p1_changed", "p2_changed", "p3_changed"]
    found = batch.run(0.01 * np.arange(1, len(recorded)), results=names, inputs={"signal": recorded.T})
    return np.asarray(found[:, -1])


def main() -> None:
    """Sweeps over each parameter, both scalings, the printed formulas, and the verdicts."""
    sheet = Sheet(
        __file__, "Van der Pol: three parameters from two signatures", "Omar 2012, section 2.5, Figs. 2.10-2.19"
    )
    parameters = [tuple(value if i == k else NOMINAL[i] for i in range(3)) for k, s in enumerate(SWEEPS) for value in s]
    parameters += [(p1, p2, 0.05) for p1, p2 in BESIDE]
    recorded = records(np.array(parameters))
    run = recorded[BURN_IN:]
    long, short = dynamic_signature(run, 100), dynamic_signature(run, 50)
    far, near = branch_tips(long)
    extent, tip, gap = np.ptp(long[0], axis=0), short[0].max(axis=0), far - near
    middle = 0.5 * (far + near) - long[0].min(axis=0)
    for i, (p1, independent) in enumerate(zip(SWEEPS[0], LENGTHS, strict=True)):
        sheet.add(f"length of S1, p1 = {p1:g}", "1", None, extent[i], GROWS, independent=independent)
    for i, independent in ((6, 0.346), (11, 0.322)):
        sheet.add(f"length of S1, p2 = {parameters[i][1]:g}", "1", None, extent[i], DRAWN, independent=independent)
    for i, (p2, independent) in enumerate(zip(SWEEPS[1], TIPS, strict=True)):
        sheet.add(f"right tip of S2, p2 = {p2:g}", "1", None, tip[6 + i], DRAWN, independent=independent)
    sheet.add("right tip of S2, spread over p1", "%", None, spread(tip[:6]), DRAWN, independent=1.2)
    sheet.add("right tip of S2, spread over p3", "%", None, spread(tip[12:18]), DRAWN, independent=1.5)
    literal = dynamic_signature(run[:, :6], 50, next_scaling="literal")[0].max(axis=0)
    why = "with the size of the scaled past for a divisor the tip follows p1: section 2.5 needs the norm"
    sheet.add("the same with literal scaling, p1 = 1", "1", None, literal[0], why, independent=0.0628)
    sheet.add("the same with literal scaling, p1 = 2", "1", None, literal[5], why, independent=0.0732)
    for i, (p3, independent) in enumerate(zip(SWEEPS[2], GAPS, strict=True)):
        sheet.add(f"gap r3, p3 = {p3:g}", "1", None, gap[12 + i], DRAWN, independent=independent)
    slope = float(np.polyfit(SWEEPS[2], gap[12:18], 1)[0])
    sheet.add("slope of the gap over p3", "1", None, slope, DRAWN, independent=0.52)
    for i, ((p1, p2), independent) in enumerate(BESIDE.items()):
        why = "in words: the gap does not depend on p1 and p2; it does, by a third"
        sheet.add(f"gap at p3 = 0.05, p1 = {p1:g}, p2 = {p2:g}", "1", None, gap[18 + i], why, independent=independent)
    for i, independent in ((12, 0.3345), (17, 0.3268)):
        name = f"length to the middle of the branches r1, p3 = {parameters[i][2]:g}"
        sheet.add(name, "1", None, middle[i], DRAWN, independent=independent)
    top, at_tip = printed_branches(long)
    sheet.add("r3 by the printed formula, p3 = 0", "1", None, (top - at_tip)[12], PRINTED)
    sheet.add("r3 by the printed formula, p3 = 0.1", "1", None, (top - at_tip)[17], PRINTED)
    tips = printed_tip(short)
    sheet.add("r2 by the printed formula, spread over p1", "%", None, spread(tips[:6]), PRINTED)
    reported = verdicts(recorded)
    expected = np.array([[abs(a - b) > 1e-9 for a, b in zip(p, NOMINAL, strict=True)] for p in parameters])
    right = int((reported == expected).all(axis=1).sum())
    why = "verdict of signature_track after 25 s with thresholds of ours, set on the sweeps of one parameter"
    sheet.add("verdicts that name the changed parameters", "1", None, f"{right} of {len(parameters)}", why)
    sheet.finish(draw(run, long, short))


def spread(values: np.ndarray) -> float:
    """Range over the mean [%]."""
    return float(100.0 * np.ptp(values) / values.mean())


def draw(run: np.ndarray, long: np.ndarray, short: np.ndarray) -> Any:
    """Output, S1 and S2 for the sweeps, one row a parameter."""
    figure, axes = plt.subplots(3, 3, figsize=(10, 8), layout="constrained")
    for k, (row, sweep) in enumerate(zip(axes, SWEEPS, strict=True)):
        for j in (0, 3, 5):
            member = 6 * k + j
            row[0].plot(0.01 * np.arange(SAMPLES), run[:, member], lw=0.8, label=f"p{k + 1} = {sweep[j]:g}")
            row[1].plot(*long[:, :, member], lw=0.8)
            row[2].plot(*short[:, :, member], lw=0.8)
        row[0].legend(fontsize=7, loc="upper right")
        row[0].set_ylabel("y [1]")
        row[1].set_ylabel("ordinate [1]")
    for axis, title in zip(axes[0], ("output", "S1, N = 100", "S2, N = 50"), strict=True):
        axis.set_title(title, fontsize=9)
    for axis, label in zip(axes[2], ("time [s]", "abscissa [1]", "abscissa [1]"), strict=True):
        axis.set_xlabel(label)
    return figure


main()

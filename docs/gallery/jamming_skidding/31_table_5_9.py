"""Table 5.9: how the bounds grow while samples are missing, beside what the carried bound and the reading say."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from shared.sheet import Sheet

from fmu_observer.certificates.bounds import improved_dmo_bound
from fmu_observer.observers.train import DiscreteMeasurementObserver

XI, BETA, M = 1.7, 1.90937, 0.1
GAIN = float(np.linalg.norm((3.4 + 5.7e-3, -3.4, -1.5)))
PUBLISHED = {"small (0.2 s)": 1.28, "medium (1 s)": 13.4, "big (1.4 s)": 33.3}
SAMPLES = (
    "published are averages on measured data that are confidential; the increment over two samples, the faulty one and "
    "the next, is this"
)
INVERTED = (
    "read backwards from the published bound: the missing time that gives it, without an error at the sample; longer "
    "than the fault, by samples before and after it"
)
CARRIED = "not in the thesis: the bound carried over samples, all samples before at 0.2 s, the same gain"
READING = (
    "not in the thesis: the part of the bound by the reading that is known before the run, acceleration times age; "
    "its other part is how far the estimate lies from the reading"
)
OURS = "printed with one increment only; an independent implementation gave these"


def increment(gap: float) -> float:
    """The i-DMO bound without an error at the sample [m/s]."""
    return float(improved_dmo_bound(gap, 0.0, BETA, M, GAIN, XI))


def main() -> None:
    """Increments, inversions, and the bounds over the missing time."""
    sheet = Sheet(__file__, "Bounds over missing samples", "Aguiar Cota 2019, 5.4, Table 5.9")
    sheet.add("norm of the gain of 5.4", "1/s", None, GAIN, OURS, independent=5.0407)
    for gap, independent in ((0.2, 0.325), (0.4, 1.292), (1.2, 11.3), (1.6, 19.9)):
        published, why = (PUBLISHED["small (0.2 s)"], SAMPLES) if gap == 0.4 else (None, OURS)
        sheet.add(
            f"increment of the bound over {gap:g} s", "m/s", published, increment(gap), why, independent=independent
        )
    for kind, independent in (("medium (1 s)", 1.3), ("big (1.4 s)", 2.1)):
        gap = float(brentq(lambda s, limit=PUBLISHED[kind]: increment(s) - limit, 0.1, 5.0))
        fault = float(kind.split("(")[1].split()[0])
        sheet.add(
            f"missing time for {PUBLISHED[kind]:g} m/s, {kind}", "s", fault, gap, INVERTED, independent=independent
        )
    bounds = DiscreteMeasurementObserver().error_bounds(preset="as_published_set_d")
    for gap in (0.2, 0.4, 1.2, 1.6):
        sheet.add(f"carried bound after {gap:g} s", "m/s", None, bounds.carried(gap), CARRIED)
        sheet.add(f"acceleration times age after {gap:g} s", "m/s", None, XI * gap, READING)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    gaps = np.linspace(0.01, 2.2, 150)
    axis.plot(gaps, [increment(gap) for gap in gaps], label="i-DMO, no error at the sample")
    axis.plot(gaps, [bounds.carried(gap) for gap in gaps], label="carried over samples")
    axis.plot(gaps, XI * gaps, label="by the reading: acceleration times age")
    axis.plot(gaps, [bounds.exact(gap) for gap in gaps], "k--", label="exact worst case")
    axis.plot([0.4, 1.31, 2.12], list(PUBLISHED.values()), "ro", label="thesis, at the time read backwards")
    axis.set(xlabel="time since the last sample used [s]", ylabel="speed error [m/s]", ylim=(0.0, 36.0))
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()

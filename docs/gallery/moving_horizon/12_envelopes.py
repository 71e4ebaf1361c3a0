"""Envelopes of a bent signature, and the distance to a bar; Figures 4.2 to 4.9."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Polygon
from shared.sheet import Sheet

from fmu_observer.formulas.signatures.envelope import (
    ANGLES,
    Envelope,
    best_envelope,
    envelope,
    envelope_areas,
    envelope_distance,
    line_distance,
)

SLABS = 30  # printed
ANGLES_SHOWN = {"0": 0.0, "pi / 3": np.pi / 3.0, "pi / 2": np.pi / 2.0, "2 pi / 3": 2.0 * np.pi / 3.0}
PUBLISHED = {"0": 19.9, "pi / 2": 6.75}
OTHER = "the points of the thesis are not printed: another bent signature, of ours; comparable is the ratio"
LENGTH, THICKNESS, GAP = 4.0, 0.2, 0.5
RATIO = "by its definition the gap over the thickness, or over the length; no number is printed"
OBLIQUE = (
    "all lines that cross both sides of the bar give the same quotient, the others a larger one: the straight line's"
)


def bent() -> np.ndarray:
    """A curve as drawn, bent and upright, with a ripple across; shape (2, 900)."""
    t = np.linspace(-1.0, 1.0, 900)
    return np.stack([2.5 * (1.0 - t * t) + 0.35 * np.sin(60.0 * t), 4.0 * t])


def main() -> None:
    """Areas over the angle, and both distances to a bar."""
    sheet = Sheet(__file__, "Envelope of a signature, and the distance to one", "Omar 2012, section 4.5, Figs. 4.2-4.9")
    points = bent()
    for name, angle in ANGLES_SHOWN.items():
        area = envelope(points, SLABS, angle).area
        sheet.add(f"area at {name}", "1", PUBLISHED.get(name), area, OTHER)
    best = best_envelope(points, SLABS)
    ratio = envelope(points, SLABS).area / envelope(points, SLABS, np.pi / 2.0).area
    sheet.add("area at 0 over that at pi / 2", "1", 19.9 / 6.75, ratio, OTHER)
    sheet.add("angle of the smallest area", "rad", np.pi / 2.0, best.angle, OTHER)
    bar = Envelope(0.0, np.linspace(0.0, LENGTH, 9), np.zeros(8), np.full(8, THICKNESS))
    above, beside = np.array([0.5 * LENGTH, THICKNESS + GAP]), np.array([LENGTH + GAP, 0.5 * THICKNESS])
    across = float(line_distance(above, bar, np.pi / 2.0))
    along = float(line_distance(beside, bar, 0.0))
    sheet.add("gap 0.5 before the thin side, straight across", "1", None, across, RATIO, independent=GAP / THICKNESS)
    sheet.add("gap 0.5 behind the end, along the bar", "1", None, along, RATIO, independent=GAP / LENGTH)
    sheet.add(
        "the same, smallest over all lines: before the side", "1", None, float(envelope_distance(above, bar)), OBLIQUE
    )
    sheet.add(
        "the same, smallest over all lines: behind the end", "1", None, float(envelope_distance(beside, bar)), OBLIQUE
    )
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.8), layout="constrained")
    for axis, angle in zip(axes, (0.0, np.pi / 2.0), strict=False):
        for corners in np.moveaxis(envelope(points, SLABS, angle).corners, 1, 0):
            axis.add_patch(Polygon(corners.T, alpha=0.3))
        axis.plot(*points, "k.", ms=1)
        axis.set(title=f"at {angle:.2f} rad", xlabel="abscissa [1]", ylabel="ordinate [1]", aspect="equal")
    angles = np.linspace(0.0, np.pi, ANGLES)
    axes[2].plot(angles, envelope_areas(points, SLABS, angles))
    axes[2].set(xlabel="angle [rad]", ylabel="area [1]", title="area over the angle")
    sheet.finish(figure)


main()

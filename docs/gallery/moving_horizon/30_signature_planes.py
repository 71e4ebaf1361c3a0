"""Where signatures of one point lie for the states of a grid; Figures 4.10 to 4.13 and 4.19."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from windows import recorded

from fmu_observer.observers.exhibits import OscillatorSignature
from plant_models.exhibits import BrakedOscillator

SHAPE = "the figure is lost and eps, p1 and p2 are not printed; counted is whether no two cells of the network overlap"
RANGE = "the grid is coarse where signatures change fast: extremes of the plane lie between its nodes"
TITLES = {
    "mixed": "y = 0.2 sin(x1) + x2, (4.6.2)",
    "speed": "y = x2, (4.6.9)",
    "root": "y = x1, root of |x2|, (4.6.11)",
}


def plane(observer: OscillatorSignature) -> np.ndarray:
    """Points of the grid on axes scaled to [0, 1], shape (2, x1, x2)."""
    count = len(observer.nodes[0])
    points = observer.tabulated()["table"].reshape(2, count, count)
    low = points.min(axis=(1, 2), keepdims=True)
    return (points - low) / (points.max(axis=(1, 2), keepdims=True) - low)


def turned(points: np.ndarray) -> float:
    """Share of cells of the network that are turned round against most of them: 0 where it does not fold."""
    a, b = points[:, 1:, :-1] - points[:, :-1, :-1], points[:, :-1, 1:] - points[:, :-1, :-1]
    area = a[0] * b[1] - a[1] * b[0]
    return float(min((area > 0.0).mean(), (area < 0.0).mean()))


def main() -> None:
    """Planes of the variants and scalings, and the trajectory in one of them."""
    sheet = Sheet(
        __file__, "Signatures of one point over a grid of states", "Omar 2012, section 4.6.1, Figs. 4.10-4.13, 4.19"
    )
    figure, axes = plt.subplots(2, 3, figsize=(11, 6.5), layout="constrained")
    for axis, variant in zip(axes[0], TITLES, strict=True):
        observer = OscillatorSignature(7, "literal", variant)
        points = plane(observer)
        sheet.add(f"share of folded cells, {TITLES[variant]}, 7 x 7", "1", None, turned(points), SHAPE)
        draw(axis, points, TITLES[variant])
    for axis, (nodes, scaling) in zip(axes[1], ((13, "literal"), (7, "norm")), strict=False):
        points = plane(OscillatorSignature(nodes, scaling))
        sheet.add(f"share of folded cells, y mixed, {nodes} x {nodes}, {scaling}", "1", None, turned(points), SHAPE)
        draw(axis, points, f"y mixed, {nodes} x {nodes}, {scaling}")
    observer = OscillatorSignature()
    true = recorded(BrakedOscillator(), 5.0, 5e-3)
    windows = np.lib.stride_tricks.sliding_window_view(true["measured_y"], observer.window).T
    p = observer.unpack_parameters(observer.start_parameters())
    track = [values[0] for values in observer.points(windows, 2, p.regularisation)]
    grid = p.table.reshape(2, -1)
    axes[1, 2].plot(grid[0], grid[1], ".", ms=3)
    axes[1, 2].plot(*track, lw=0.8)
    axes[1, 2].set(title="trajectory from (-0.7, 1.5) (Fig. 4.13)", xlabel="abscissa", ylabel="weight of vertex 2")
    within = [(values >= g.min()) & (values <= g.max()) for values, g in zip(track, grid, strict=True)]
    inside = float(np.mean(within[0] & within[1]))
    sheet.add("share of the trajectory's windows within the range of the table", "1", None, inside, RANGE)
    sheet.finish(figure)


def draw(axis: plt.Axes, points: np.ndarray, title: str) -> None:
    """The network of a plane: lines of equal x1, and of equal x2."""
    axis.plot(points[0].T, points[1].T, "-", lw=0.8, color="C0")
    axis.plot(points[0], points[1], "-", lw=0.8, color="C1")
    axis.set(title=title, xlabel="abscissa, scaled", ylabel="weight, scaled")


main()

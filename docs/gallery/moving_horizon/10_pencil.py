"""The pencil map: points on the edges of the polygon, the point of a window in both scalings: Figures 2.6 and 2.7."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.formulas.signatures.pencil import pencil, polygon

TINY = 1e-12  # eps -> 0, as the independent values are
FIGURE_2_6 = np.array([0.0, 0.5, -0.5, 0.25, -0.25, 0.0])
EDGE_POINTS = ((0.75, 0.433), (-0.25, 0.866), (-0.625, 0.6495), (-0.6875, -0.5413), (-0.125, -0.866), (0.75, -0.433))
FIGURE_2_7 = np.array([5.0, 2.0, 0.0, -1.0, 3.0, -2.0])
FOLLOWING = (-5.0, 0.0, 5.0)
POINTS = {
    "norm": ((-0.2144, -0.0776), (-0.0811, 0.0321), (0.0522, 0.1418)),
    "literal": ((-0.7478, -0.5163), (-0.0811, 0.0321), (0.5856, 0.5806)),
}
DRAWN = "drawn in the thesis and not printed as a number; the independent one has four digits"


def main() -> None:
    """Both windows of the figures."""
    sheet = Sheet(
        __file__, "The pencil map, in both scalings of the next sample", "Omar 2012, (2.3.1)-(2.3.6), Figs. 2.6, 2.7"
    )
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.8), layout="constrained")
    edges = pencil(FIGURE_2_6, 0.0, 0.5).edge_points  # scaled by 0.5 + 0.5: the window as it stands
    for i, (x, y) in enumerate(EDGE_POINTS):
        sheet.add(f"Psi_{i + 1}, abscissa", "1", None, edges[0, i], DRAWN, independent=x)
        sheet.add(f"Psi_{i + 1}, ordinate", "1", None, edges[1, i], DRAWN, independent=y)
    axes[0].plot(*edges, "o", label="Psi")
    axes[0].set_title("Fig. 2.6", fontsize=9)
    for axis, (scaling, points) in zip(axes[1:], POINTS.items(), strict=True):
        for following, (x, y) in zip(FOLLOWING, points, strict=True):
            found = pencil(FIGURE_2_7, following, TINY, scaling)
            sheet.add(f"{scaling}, next {following:g}: abscissa", "1", None, found.point[0], DRAWN, independent=x)
            sheet.add(f"{scaling}, next {following:g}: ordinate", "1", None, found.point[1], DRAWN, independent=y)
            axis.plot(*found.point, "s", label=f"P, next {following:g}")
        axis.plot(*found.edge_points, "o", label="Psi")
        axis.plot(*found.centre, "kx", label="Phi0")
        axis.plot(*found.weighted, "k+", label="Phi1")
        axis.set_title(f"Fig. 2.7, {scaling}", fontsize=9)
    for axis in axes:
        corners = polygon(6)
        axis.plot(*np.concatenate([corners, corners[:, :1]], axis=1), "-", lw=0.8)
        axis.set_aspect("equal")
        axis.legend(fontsize=6)
        axis.set_xlabel("abscissa [1]")
    axes[0].set_ylabel("ordinate [1]")
    sheet.finish(figure)


main()

"""The curves along which the wires of a structure's picture run. Knows points only."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from matplotlib.path import Path as Curve

CORNER = 0.07  # radius of a rounded corner [inch]


def forward_curves(points: Sequence[tuple[float, float]]) -> list[Curve]:
    """Straight across columns, swinging between them; one piece each.

    Args:
        points: corners of the wire in the figure.
    """
    pieces = []
    for number, ((x, y), (u, v)) in enumerate(pairwise(points)):
        if (x, y) == (u, v):
            continue
        if number % 2 == 0:
            pieces.append(Curve([(x, y), (u, v)], [Curve.MOVETO, Curve.LINETO]))
        else:
            corners = [(x, y), ((x + u) / 2, y), ((x + u) / 2, v), (u, v)]
            pieces.append(Curve(corners, [Curve.MOVETO, *[Curve.CURVE4] * 3]))
    return pieces


def back_curve(points: Sequence[tuple[float, float]]) -> Curve:
    """Along right angles with rounded corners.

    Args:
        points: corners of the wire in the figure.
    """
    vertices, codes = [points[0]], [Curve.MOVETO]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        vertices += [_towards(corner, before), corner, _towards(corner, after)]
        codes += [Curve.LINETO, Curve.CURVE3, Curve.CURVE3]
    return Curve([*vertices, points[-1]], [*codes, Curve.LINETO])


def _towards(corner: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    length = abs(other[0] - corner[0]) + abs(other[1] - corner[1])
    share = min(CORNER, length / 2) / length if length else 0.0
    return corner[0] + share * (other[0] - corner[0]), corner[1] + share * (other[1] - corner[1])

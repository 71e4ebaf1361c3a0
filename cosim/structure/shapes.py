"""The shapes of a structure's picture: boxes, wires, frames, in inches, y pointing down. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from matplotlib.path import Path as Curve

ROW, TITLE, FOOT, PAD = 0.2, 0.46, 0.18, 0.1  # heights within a box

Point = tuple[float, float]


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


@dataclass(frozen=True)
class Size:
    """What a box must hold.

    Args:
        width: [inch]. inputs, outputs: names of the ports shown, from above. foot: whether there is a line below them.
    """

    width: float
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    foot: bool = False

    @property
    def height(self) -> float:
        """Height of the box [inch]."""
        return TITLE + ROW * max(len(self.inputs), len(self.outputs)) + (FOOT if self.foot else 0.0) + PAD


@dataclass(frozen=True)
class Edge:
    """A wire to be laid: from an output to an input, of a kind (``fresh``, ``held``, ``loop``, ``event``)."""

    source: tuple[str, str]
    target: tuple[str, str]
    kind: str


@dataclass
class Box:
    """A placed component; x and y are of its upper left corner [inch]."""

    name: str
    size: Size
    column: int
    x: float = 0.0
    y: float = 0.0

    @property
    def right(self) -> float:
        """Right edge [inch]."""
        return self.x + self.size.width

    @property
    def bottom(self) -> float:
        """Lower edge [inch]."""
        return self.y + self.size.height

    def row(self, ports: Sequence[str], name: str) -> float:
        """Height of a port [inch].

        Args:
            ports: on one side of the box. name: of the port.
        """
        return self.y + TITLE + ROW * (ports.index(name) + 0.5)


@dataclass(frozen=True)
class Wire:
    """A laid wire: corner points from output to input [inch]; `back` where it runs below its group."""

    edge: Edge
    points: tuple[Point, ...]
    back: bool


@dataclass(frozen=True)
class Frame:
    """A frame around a group: upper left corner and size [inch]."""

    names: tuple[str, ...]
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Layout:
    """Everything placed; the picture begins at (0, 0) and is `width` x `height` [inch]."""

    boxes: Mapping[str, Box]
    wires: tuple[Wire, ...]
    frames: tuple[Frame, ...]
    width: float
    height: float

"""The structure of a run as a picture: boxes with their ports, wires by what becomes of them in a step. Touches only
its file.

Every name stands inside a box, beside its port, so that no label can lie on another or on a wire.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Circle, FancyBboxPatch, PathPatch, Polygon
from matplotlib.path import Path as Curve
from matplotlib.textpath import TextPath

from cosim.drawing.style import (
    ALARM,
    EDGE,
    GREEN,
    HEADLINE,
    INK,
    MARK,
    PALE,
    PALE_BLUE,
    PALE_RED,
    PALE_YELLOW,
    QUIET,
    RC,
    SLATE,
    VERMILION,
    VIOLET,
    new_figure,
    styled,
)
from cosim.errors import OutputError
from cosim.structure.picture_layout import EVENT_PORT, lay_out
from cosim.structure.shapes import CORNER, FOOT, PAD, Box, Edge, Frame, Layout, Size, Wire, forward_curves

if TYPE_CHECKING:
    from cosim.structure.structure_data import Link, Part, StructureData

COLOURS = {"fresh": SLATE, "held": VERMILION, "iterated": VIOLET, "loop": ALARM, "event": GREEN}
_MEANINGS = {
    "fresh": "fresh, value of the end of the step",
    "held": "held, value of the start of the step",
    "iterated": "iterated until it settles",
    "loop": "algebraic loop",
    "event": "balise telegrams and clocks, at their own instants",
}
ALGORITHMS = {"gauss-seidel": "Gauss-Seidel", "jacobi": "Jacobi", "iterate": "Gauss-Seidel with iterated loops"}
_FILLS = {"FMU": PALE_BLUE, "block": PALE_YELLOW}
NAME, SMALL, _PORT = 9.5, 7.3, 8.0  # font sizes [pt]
MARGIN, HEAD, _KEY_ROW, _KEY_LINE = 0.22, 0.62, 0.22, 0.42  # [inch]
_SIDE, MIDDLE, _BADGE, _ARROW = 0.12, 0.34, 0.105, 0.075  # within a box [inch]
FORMATS = ("png", "svg", "pdf")
_PNG_DPI = 160
MAX_PIXELS = 12000
_LEAST_DPI = 15  # below it nothing can be read


def draw_structure(structure: StructureData, path: str | Path) -> Path:
    """Draw a structure to a file.

    Args:
        structure: what to draw. path: its ending decides the format.

    Returns:
        The path.

    Raises:
        OutputError: the ending is unknown, the picture is too large, or the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        raise OutputError(f"Cannot draw to {path}: choose a file that ends in {', '.join(f'.{f}' for f in FORMATS)}.")
    figure = _structure_figure(structure)
    dpi = min(_PNG_DPI, MAX_PIXELS / max(figure.get_size_inches()))
    if kind == "png" and dpi < _LEAST_DPI:
        count = len(structure.parts)
        raise OutputError(
            f"A picture of {count} components is too large for {path}: choose a file that ends in .svg or .pdf."
        )
    try:
        figure.savefig(path, format=kind, dpi=dpi)
    except OSError as error:
        raise OutputError(
            f"The picture cannot be written to {path}: {error.strerror or error}. Choose another file."
        ) from error
    return path


@styled
def _structure_figure(structure: StructureData) -> Figure:
    """The picture as a figure of matplotlib, as large as it needs."""
    edges = _wires_of(structure)
    layout = lay_out(structure, {part.name: _box_size(part, edges) for part in structure.parts}, edges)
    kinds = [kind for kind in _MEANINGS if any(edge.kind == kind for edge in edges)]
    subtitle = _subtitle(structure)
    headline = max(_text_width(structure.title, HEADLINE, bold=True), _text_width(subtitle, SMALL))
    width = max(layout.width, headline) + 2 * MARGIN
    rows = _key_rows(kinds, width - 2 * MARGIN)
    height = HEAD + layout.height + MARGIN + _KEY_ROW * len(rows) + MARGIN
    figure = new_figure((width, height))
    figure.set_layout_engine("none")
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_axis_off()
    shift = (width - layout.width) / 2
    ax.set_xlim(-shift, width - shift)
    ax.set_ylim(height - HEAD, -HEAD)
    left = MARGIN - shift
    ax.text(left, -HEAD + 0.24, structure.title, fontsize=HEADLINE, fontweight="bold", color=INK, va="baseline")
    ax.text(left, -HEAD + 0.43, subtitle, fontsize=SMALL, color=QUIET, va="baseline")
    _draw_layout(ax, structure, layout)
    for number, row in enumerate(rows):
        _draw_key(ax, row, left, layout.height + MARGIN + _KEY_ROW * (number + 0.5))
    return figure


def _wires_of(structure: StructureData) -> list[Edge]:
    """The wires to draw: connections by kind, and telegrams from the watched plant to those who are notified."""
    edges = [Edge(link.source, link.target, _kind(link)) for link in structure.links]
    edges += [Edge(clock.source, clock.target, "event") for clock in structure.clocks]
    balises = structure.balises
    if balises is not None:
        edges += [Edge((balises.plant, EVENT_PORT), (name, EVENT_PORT), "event") for name in balises.receivers]
    return list(dict.fromkeys(edges))


def _kind(link: Link) -> str:
    if link.in_loop:
        return "loop"
    return "iterated" if link.iterated else "held" if link.held else "fresh"


def _box_size(part: Part, edges: Sequence[Edge]) -> Size:
    """Ports that have wires, and the width that everything in the box needs."""
    inputs = tuple(dict.fromkeys(e.target[1] for e in edges if e.target[0] == part.name))
    outputs = tuple(dict.fromkeys(e.source[1] for e in edges if e.source[0] == part.name))
    left, right = (max((_text_width(name, _PORT) for name in names), default=0.0) for names in (inputs, outputs))
    gap = MIDDLE if inputs and outputs else 0.0
    foot = _foot_text(part)
    width = max(
        left + gap + right,
        _text_width(part.name, NAME, bold=True) + 3.2 * _BADGE,
        _text_width(_kind_text(part), SMALL),
        _text_width(foot, SMALL),
        0.8,
    )
    return Size(width + 2 * _SIDE, inputs, outputs, bool(foot))


def _kind_text(part: Part) -> str:
    """What stands below the name of a component."""
    what = f"{part.kind}, FMI {part.fmi_version}"
    return f"{what}, {part.rate}" if part.rate else what


def _foot_text(part: Part) -> str:
    """How many ports are not drawn, since nothing is connected there."""
    inputs, outputs = (sum(not port.connected for port in ports) for ports in (part.inputs, part.outputs))
    counts = [_counted(inputs, "input"), _counted(outputs, "output")]
    texts = [text for text in counts if text]
    return f"{' and '.join(texts)} not connected" if texts else ""


def _counted(number: int, what: str) -> str:
    return "" if not number else f"{number} {what}" + ("s" if number > 1 else "")


@lru_cache(maxsize=2048)
def _text_width(text: str, size: float, bold: bool = False) -> float:
    """Width of a text in the pictures' font [inch].

    Args:
        text: one line. size: of the font [pt]. bold: whether it is bold.
    """
    if not text.strip():
        return 0.0
    font = FontProperties(family=RC["font.family"], weight="bold" if bold else "normal")
    return float(TextPath((0, 0), text.replace("$", r"\$"), size=size, prop=font).get_extents().width) / 72.0 + 0.02


# -- strokes ----------------------------------------------------------------------------------------------------------


def _draw_layout(ax: Axes, structure: StructureData, layout: Layout) -> None:
    loops = {node[0] for loop in structure.loops for node in loop}
    for frame in layout.frames:
        _draw_frame(ax, frame, bool(loops & set(frame.names)))
    drawn: set[object] = set()
    for wire in sorted(layout.wires, key=lambda w: list(_MEANINGS).index(w.edge.kind)):
        _draw_wire(ax, wire, drawn)
    for number, part in enumerate(structure.parts, start=1):
        _draw_box(ax, structure, part, layout.boxes[part.name], number)


def _draw_frame(ax: Axes, frame: Frame, loop: bool) -> None:
    fill, edge = (PALE_RED, ALARM) if loop else (PALE, EDGE)
    shape = FancyBboxPatch(
        (frame.x + CORNER, frame.y + CORNER),
        frame.width - 2 * CORNER,
        frame.height - 2 * CORNER,
        boxstyle=f"round,pad={CORNER},rounding_size=0.1",
        facecolor=fill,
        edgecolor=edge,
        linewidth=0.8,
        linestyle=(0, (4, 2)),
        zorder=0.5,
    )
    ax.add_patch(shape)
    text = "algebraic loop" if loop else "group: influence one another"
    ax.text(frame.x + 0.1, frame.y + 0.17, text, fontsize=SMALL, color=edge if loop else QUIET, va="baseline", zorder=3)


def _draw_box(ax: Axes, structure: StructureData, part: Part, box: Box, number: int) -> None:
    fill = _FILLS.get(part.kind, _FILLS["FMU"])
    shape = FancyBboxPatch(
        (box.x + 0.05, box.y + 0.05),
        box.size.width - 0.1,
        box.size.height - 0.1,
        boxstyle="round,pad=0.05,rounding_size=0.05",
        facecolor=fill,
        edgecolor=INK,
        linewidth=0.9,
        zorder=2,
    )
    ax.add_patch(shape)
    middle = box.y + 0.17
    ax.add_patch(Circle((box.x + _SIDE + _BADGE, middle), _BADGE, facecolor=INK, edgecolor="none", zorder=3))
    ax.text(
        box.x + _SIDE + _BADGE,
        middle + 0.004,
        str(number),
        fontsize=6.8,
        color="white",
        ha="center",
        va="center_baseline",
        zorder=4,
    )
    name_at = box.x + _SIDE + 2.7 * _BADGE
    words: dict[str, Any] = {"va": "baseline", "zorder": 3}
    ax.text(name_at, middle + 0.05, _plain(part.name), fontsize=NAME, fontweight="bold", color=INK, **words)
    ax.text(box.x + _SIDE, box.y + 0.385, _kind_text(part), fontsize=SMALL, color=QUIET, **words)
    _draw_ports(ax, box)
    if box.size.foot:
        at = box.bottom - PAD - FOOT + 0.13
        ax.text(box.x + _SIDE, at, _foot_text(part), fontsize=SMALL, color=QUIET, **words)
    _draw_feedthrough(ax, structure, part, box)


def _draw_ports(ax: Axes, box: Box) -> None:
    for names, x, side in ((box.size.inputs, box.x + _SIDE, "left"), (box.size.outputs, box.right - _SIDE, "right")):
        for name in names:
            event = name == EVENT_PORT
            shown = name.strip("()") if event else _plain(name)
            ax.text(
                x,
                box.row(names, name) + 0.035,
                shown,
                fontsize=_PORT,
                ha=side,
                va="baseline",
                zorder=3,
                color=COLOURS["event"] if event else INK,
                fontstyle="italic" if event else "normal",
            )


def _draw_feedthrough(ax: Axes, structure: StructureData, part: Part, box: Box) -> None:
    """Thin lines inside a box from inputs to the outputs that they act on directly, between the names."""
    if not box.size.inputs or not box.size.outputs:
        return
    left = box.x + _SIDE + max(_text_width(n, _PORT) for n in box.size.inputs) + 0.04
    right = box.right - _SIDE - max(_text_width(n, _PORT) for n in box.size.outputs) - 0.04
    knots = {pair for loop in structure.loops for pair in pairwise(loop)}
    for port in part.outputs:
        for name in set(port.depends_on or ()) & set(box.size.inputs):
            if port.name in box.size.outputs:
                looped = ((part.name, name), (part.name, port.name)) in knots
                ends = [box.row(box.size.inputs, name), box.row(box.size.outputs, port.name)]
                colour, width = (COLOURS["loop"], 1.5) if looped else (MARK, 0.7)
                ax.plot([left, right], ends, color=colour, linewidth=width, linestyle=(0, (1, 1)), zorder=2.5)


def _draw_wire(ax: Axes, wire: Wire, drawn: set[object]) -> None:
    """Draw what another wire from the same output has not drawn already: dashes laid over one another look solid."""
    kind = wire.edge.kind
    pieces = [_back_curve(wire.points)] if wire.back else forward_curves(wire.points)
    style = (0, (4, 2)) if kind == "event" else "-"
    width = 1.9 if kind == "loop" else 1.2
    for piece in pieces:
        key = (kind, np.asarray(piece.vertices).tobytes())
        if key not in drawn:
            drawn.add(key)
            ax.add_patch(
                PathPatch(
                    piece, facecolor="none", edgecolor=COLOURS[kind], linewidth=width, linestyle=style, zorder=1.5
                )
            )
    x, y = wire.points[-1]
    tip = [(x, y), (x - _ARROW * 1.5, y - _ARROW / 1.6), (x - _ARROW * 1.5, y + _ARROW / 1.6)]
    ax.add_patch(Polygon(tip, closed=True, facecolor=COLOURS[kind], edgecolor="none", zorder=1.6))


# -- words ------------------------------------------------------------------------------------------------------------


def _subtitle(structure: StructureData) -> str:
    loops = len(structure.loops)
    knots = "" if not loops else f"; {loops} algebraic loop{'s' if loops > 1 else ''}"
    algorithm = ALGORITHMS.get(structure.algorithm, structure.algorithm)
    return f"Stepped by {algorithm} in the order of the numbers, every {structure.step:g} s{knots}"


def _key_rows(kinds: Sequence[str], width: float) -> list[list[str]]:
    rows: list[list[str]] = []
    used = width
    for kind in kinds:
        wide = _key_width(kind)
        if used + wide > width:
            rows.append([])
            used = 0.0
        rows[-1].append(kind)
        used += wide
    return rows


def _key_width(kind: str) -> float:
    return _KEY_LINE + 0.07 + _text_width(_MEANINGS[kind], SMALL) + 0.3


def _draw_key(ax: Axes, kinds: Sequence[str], x: float, y: float) -> None:
    for kind in kinds:
        _draw_wire(
            ax,
            Wire(Edge(("", ""), ("", ""), kind), ((x, y), (x, y), (x + _KEY_LINE, y), (x + _KEY_LINE, y)), False),
            set(),
        )
        ax.text(x + _KEY_LINE + 0.07, y + 0.035, _MEANINGS[kind], fontsize=SMALL, color=INK, va="baseline")
        x += _key_width(kind)


def _plain(text: str) -> str:
    """A text that matplotlib does not take for mathematics."""
    return text.replace("$", r"\$")


def _back_curve(points: Sequence[tuple[float, float]]) -> Curve:
    """Along right angles with rounded corners."""
    vertices, codes = [points[0]], [Curve.MOVETO]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        vertices += [_towards(corner, before), corner, _towards(corner, after)]
        codes += [Curve.LINETO, Curve.CURVE3, Curve.CURVE3]
    return Curve([*vertices, points[-1]], [*codes, Curve.LINETO])


def _towards(corner: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    length = abs(other[0] - corner[0]) + abs(other[1] - corner[1])
    share = min(CORNER, length / 2) / length if length else 0.0
    return corner[0] + share * (other[0] - corner[0]), corner[1] + share * (other[1] - corner[1])

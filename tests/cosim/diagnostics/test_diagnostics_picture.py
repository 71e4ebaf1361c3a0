"""The picture of a structure: nothing lies on anything else, wires end where they should, files can be read."""

from __future__ import annotations

from itertools import combinations, pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hand_made_structures import coupled, structure_of
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.transforms import Bbox

from cosim.errors import OutputError
from cosim.structure import structure_picture as picture
from cosim.structure.picture_layout import EVENT_PORT, lay_out
from cosim.structure.run_structure import Structure
from cosim.structure.shapes import Box, Layout, Wire, forward_curves
from cosim.structure.structure_data import Balises, Link
from cosim.structure.structure_picture import COLOURS, _box_size, _structure_figure, _text_width, _wires_of

EDGE = 1e-6
TOUCH = 0.6  # pixels; text boxes are rounded to whole ones


@st.composite
def structures(draw: st.DrawFn) -> Structure:
    count = draw(st.integers(2, 15))
    names = [f"{'c' if i % 3 else 'component_with_a_name_'}{i}" for i in range(count)]
    place = st.integers(0, count - 1)
    pairs = draw(st.lists(st.tuples(place, place, st.integers(1, 2)), max_size=2 * count))
    receivers = draw(st.lists(st.sampled_from(names[1:]), unique=True, max_size=4))
    balises = Balises(names[0], "p", "v", tuple(receivers), "auto", "exact") if receivers else None
    return coupled(names, pairs, balises=balises)


def laid_out(structure: Structure) -> Layout:
    edges = _wires_of(structure)
    return lay_out(structure, {part.name: _box_size(part, edges) for part in structure.parts}, edges)


def rectangle(box: Box) -> tuple[float, float, float, float]:
    return box.x, box.y, box.right, box.bottom


def apart(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[2] <= b[0] + EDGE or b[2] <= a[0] + EDGE or a[3] <= b[1] + EDGE or b[3] <= a[1] + EDGE


def points_of(wire: Wire) -> np.ndarray:
    """Points along a wire, close to one another."""
    if not wire.back:
        return np.concatenate(
            [piece.interpolated(1).to_polygons(closed_only=False)[0] for piece in forward_curves(wire.points)]
        )
    return np.concatenate([np.linspace(a, b, 40) for a, b in pairwise(wire.points)])


@settings(max_examples=60)
@given(structures())
def test_boxes_and_frames_lie_apart_and_wires_go_round_them(structure: Structure) -> None:
    layout = laid_out(structure)
    boxes = layout.boxes
    for a, b in combinations(boxes.values(), 2):
        assert apart(rectangle(a), rectangle(b)), (a.name, b.name)
    frames = {frame.names: (frame.x, frame.y, frame.x + frame.width, frame.y + frame.height) for frame in layout.frames}
    assert set(frames) == {group for group in structure.groups if len(group) > 1}
    for a, b in combinations(frames.values(), 2):
        assert apart(a, b)
    for names, frame in frames.items():
        for name, box in boxes.items():
            x0, y0, x1, y1 = rectangle(box)
            inside = frame[0] < x0 and frame[1] < y0 and x1 < frame[2] and y1 < frame[3]
            assert inside if name in names else apart(frame, rectangle(box))
    for wire in layout.wires:
        xy = points_of(wire)
        assert (xy >= -EDGE).all()
        assert (xy <= np.array([layout.width, layout.height]) + EDGE).all()
        for box in boxes.values():
            x0, y0, x1, y1 = rectangle(box)
            within = (xy[:, 0] > x0 + EDGE) & (xy[:, 0] < x1 - EDGE) & (xy[:, 1] > y0 + EDGE) & (xy[:, 1] < y1 - EDGE)
            assert not within.any(), (wire.edge, box.name)


@settings(max_examples=60)
@given(structures())
def test_wires_begin_and_end_at_their_ports_and_run_back_below_their_group(structure: Structure) -> None:
    layout = laid_out(structure)
    assert {w.edge for w in layout.wires} == set(_wires_of(structure))
    for wire in layout.wires:
        source, target = layout.boxes[wire.edge.source[0]], layout.boxes[wire.edge.target[0]]
        assert wire.points[0] == (source.right, source.row(source.size.outputs, wire.edge.source[1]))
        assert wire.points[-1] == (target.x, target.row(target.size.inputs, wire.edge.target[1]))
        assert wire.back == (target.column <= source.column)
        if wire.back:
            (group,) = (g for g in structure.groups if source.name in g)
            assert target.name in group
            assert wire.points[2][1] > max(layout.boxes[n].bottom for n in group)
        else:
            assert all(a[0] <= b[0] + EDGE for a, b in pairwise(wire.points))


@settings(max_examples=60)
@given(structures())
def test_wires_from_different_outputs_never_run_on_top_of_one_another(structure: Structure) -> None:
    level: dict[tuple[float, tuple[float, float]], set[tuple[str, str]]] = {}
    for wire in laid_out(structure).wires:
        for (x, y), (u, v) in pairwise(wire.points):
            if y == v and abs(u - x) > EDGE and (wire.back or x != wire.points[0][0]):
                level.setdefault((y, (x, u)), set()).add(wire.edge.source)
    assert all(len(nets) == 1 for nets in level.values())


def texts_of(figure: Figure) -> dict[str, list[Bbox]]:
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    found: dict[str, list[Bbox]] = {}
    for text in figure.axes[0].texts:
        found.setdefault(text.get_text(), []).append(text.get_window_extent(canvas.get_renderer()))
    return found


@settings(max_examples=8)
@given(structures())
def test_no_text_lies_on_another_or_beyond_the_picture(structure: Structure) -> None:
    figure = _structure_figure(structure)
    boxes = [box for several in texts_of(figure).values() for box in several]
    width, height = figure.get_size_inches() * figure.dpi
    for box in boxes:
        assert box.x0 > -TOUCH
        assert box.y0 > -TOUCH
        assert box.x1 < width + TOUCH
        assert box.y1 < height + TOUCH
    for a, b in combinations(boxes, 2):
        assert min(a.x1, b.x1) - max(a.x0, b.x0) < TOUCH or min(a.y1, b.y1) - max(a.y0, b.y0) < TOUCH


def loop() -> Structure:
    links = [
        Link(("a", "y"), ("b", "u"), in_loop=True),
        Link(("b", "y"), ("a", "u"), held=True, in_loop=True),
        Link(("b", "z"), ("c", "u")),
        Link(("c", "y"), ("c", "v"), held=True),
        Link(("c", "y"), ("d", "u"), iterated=True),
    ]
    path = (("a", "u"), ("a", "y"), ("b", "u"), ("b", "y"), ("a", "u"))
    through = [("a", "u", "y"), ("b", "u", "y"), ("b", "u", "z")]
    balises = Balises("a", "p", "v", ("d",), "auto", "exact")
    return structure_of(
        ["a", "b", "c", "d"], links, feedthrough=through, loops=[path], balises=balises, title="All $kinds$ of wires"
    )


def test_each_kind_of_wire_has_its_colour_and_its_line_in_the_key() -> None:
    figure = _structure_figure(loop())
    drawn = {patch.get_edgecolor() for patch in figure.axes[0].patches}
    from matplotlib.colors import to_rgba

    assert {to_rgba(colour) for colour in COLOURS.values()} <= drawn
    shown = texts_of(figure)
    ends = "fresh, value of the end of the step", "held, value of the start of the step"
    for key in (*ends, "algebraic loop", "iterated until it settles"):
        assert key in shown
    assert {"a", "b", "c", "d", "1", "2", "3", "4", "balises"} <= set(shown)
    red = [line for line in figure.axes[0].lines if line.get_color() == COLOURS["loop"]]
    assert len(red) == 2  # u to y within a and within b; u to z of b is no part of the loop
    plain = texts_of(_structure_figure(structure_of(["a", "b"], [Link(("a", "y"), ("b", "u"))])))
    assert "algebraic loop" not in plain


def test_telegrams_are_dashed_and_go_from_the_plant_to_those_notified() -> None:
    events = [edge for edge in _wires_of(loop()) if edge.kind == "event"]
    assert [(e.source, e.target) for e in events] == [(("a", EVENT_PORT), ("d", EVENT_PORT))]
    from matplotlib.colors import to_rgba

    green = to_rgba(COLOURS["event"])
    dashes = {p.get_linestyle() for p in _structure_figure(loop()).axes[0].patches if p.get_edgecolor() == green}
    assert dashes
    assert "-" not in dashes
    assert "solid" not in dashes


@pytest.mark.parametrize("ending", ["png", "svg", "pdf", "PNG"])
def test_files(ending: str, tmp_path: Path) -> None:
    path = loop().draw(tmp_path / f"structure.{ending}")
    data = path.read_bytes()
    if ending.lower() == "png":
        assert imread(path).std() > 0.05
    elif ending == "svg":
        assert ElementTree.fromstring(data).tag.endswith("svg")
    else:
        assert data.startswith(b"%PDF")


def test_a_file_that_cannot_be_drawn_is_refused_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"ends in \.png, \.svg, \.pdf"):
        loop().draw(tmp_path / "structure.docx")
    with pytest.raises(OutputError, match="No such file"):
        loop().draw(tmp_path / "nowhere" / "structure.png")


def test_widths_of_texts_are_those_drawn() -> None:
    figure = _structure_figure(loop())
    (box,) = texts_of(figure)["iterated until it settles"]
    assert _text_width("iterated until it settles", 7.3) == pytest.approx(box.width / figure.dpi, abs=0.06)


def test_a_long_chain_of_long_names_stays_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"a_component_with_quite_a_long_name_{i}" for i in range(40)]
    chain = coupled(names, [(i, i + 1, 1) for i in range(39)])
    monkeypatch.setattr(picture, "MAX_PIXELS", 3500)
    assert max(imread(chain.draw(tmp_path / "chain.png")).shape) <= 3500
    monkeypatch.setattr(picture, "MAX_PIXELS", 600)
    with pytest.raises(OutputError, match=r"40 components is too large .* \.svg"):
        chain.draw(tmp_path / "chain.png")

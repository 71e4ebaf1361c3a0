"""Curves as a picture in a page that runs nothing: SVG for a notebook, small whatever the number of rows. Imports NumPy
only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from math import ceil, floor, inf, isfinite, log10
from typing import Literal

import numpy as np

from fmus.plain import one_line

_WIDTH, _HEIGHT = 720.0, 220.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 26.0, 24.0, 34.0
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Told apart by the colour-blind, on white and on black."""
_MOST_CURVES, _PIECES, _FEWEST_PIECES = 12, 800, 40
_TICKS, _MARGIN = 5, 0.06
_FONT = "font: 12px system-ui, sans-serif"

_Style = Literal["", "true", "measured", "wanted", "allowed"]
_STROKES: dict[_Style, str] = {
    "true": 'stroke="currentColor" stroke-width="2.6" stroke-opacity="0.55"',
    "measured": 'stroke="#8c8c8c" stroke-width="1"',
    "wanted": 'stroke="currentColor" stroke-width="1" stroke-dasharray="5 3"',
    "allowed": 'stroke="#8c8c8c" stroke-width="1" stroke-dasharray="3 3"',
}


@dataclass(frozen=True)
class Line:
    """A curve.

    Args:
        label: text to show for it; empty for none. x, y: shape (rows,); what is not finite is a gap.
        style: what it is beside others.
        held: whether a value holds until the next one.
    """

    label: str
    x: np.ndarray
    y: np.ndarray
    style: _Style = ""
    held: bool = False


def line_picture(title: str, lines: Sequence[Line], x_title: str = "time [s]", settled: float | None = None) -> str:
    """A figure in HTML: title with unit, axes, curves, a legend; empty without a finite value.

    Args:
        title: above it. lines: what is drawn, the last above the others; the first `_MOST_CURVES`. x_title: below it.
        settled: where the start-up is over; the axis follows the values from there on.
    """
    shown = [line for line in lines[:_MOST_CURVES] if np.isfinite(line.y).any()]
    if not shown:
        return ""
    left, right = _ends([line.x for line in shown])
    later = [line.y[line.x >= settled] for line in shown] if settled is not None else []
    low, high = _ends(later if any(np.isfinite(y).any() for y in later) else [line.y for line in shown])
    margin = _MARGIN * (high - low)
    axes = _Axes(left, right, low - margin, high + margin)
    colours = iter(_COLOURS * (1 + len(shown) // len(_COLOURS)))
    strokes = [_STROKES.get(line.style) or f'stroke="{next(colours)}" stroke-width="1.5"' for line in shown]
    pieces = max(_PIECES // len(shown), _FEWEST_PIECES)
    drawn = [f'<path d="{axes.path(line, pieces)}" {s}/>' for line, s in zip(shown, strokes, strict=True)]
    more = len(lines) - _MOST_CURVES
    legend = [_legend(line.label, s) for line, s in zip(shown, strokes, strict=True) if line.label]
    legend += [f"<span>and {more} more</span>"] if more > 0 else []
    return (
        f'<figure style="margin: .6em 0; max-width: {_WIDTH:g}px;"><svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        f'role="img" style="width: 100%; height: auto; {_FONT};"><title>{_text(title)}</title>'
        f'<text x="{_LEFT:g}" y="15" fill="currentColor" font-weight="600">{_text(title)}</text>'
        f'{axes.drawn(x_title)}<svg x="{_LEFT:g}" y="{_TOP:g}" width="{axes.width:g}" height="{axes.height:g}" '
        f'viewBox="0 0 {axes.width:g} {axes.height:g}"><g fill="none" stroke-linejoin="round">{"".join(drawn)}</g>'
        f'</svg></svg><figcaption style="{_FONT};">{" ".join(legend)}</figcaption></figure>'
    )


def extreme_rows(values: np.ndarray, pieces: int) -> np.ndarray:
    """Rows that keep the course of a curve: of each piece the first, the last, the smallest and the largest.

    Args:
        values: shape (rows,). pieces: how many.

    Returns:
        Numbers of rows, increasing.
    """
    edges = np.unique(np.linspace(0, len(values), pieces + 1).astype(int))
    low, high = np.where(np.isnan(values), np.inf, values), np.where(np.isnan(values), -np.inf, values)
    kept = [
        row
        for a, b in pairwise(edges)
        for row in (a, a + int(np.argmin(low[a:b])), a + int(np.argmax(high[a:b])), b - 1)
    ]
    return np.unique(np.array(kept, dtype=int))


@dataclass(frozen=True)
class _Axes:
    """Where values stand in the picture."""

    left: float
    right: float
    low: float
    high: float
    width: float = _WIDTH - _LEFT - _RIGHT
    height: float = _HEIGHT - _TOP - _BOTTOM

    def place(self, x: np.ndarray | float, y: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Pixels of values; those far off stay near the picture."""
        across = (np.asarray(x) - self.left) / (self.right - self.left)
        up = (np.asarray(y) - self.low) / (self.high - self.low)
        return self.width * np.clip(across, -1.0, 2.0), self.height * (1.0 - np.clip(up, -1.0, 2.0))

    def path(self, line: Line, pieces: int) -> str:
        """A curve as the path of an SVG; a single point between gaps is a short stroke."""
        rows = np.arange(len(line.y)) if len(line.y) <= 4 * pieces else extreme_rows(line.y, pieces)
        x, y = line.x[rows], line.y[rows]
        with np.errstate(invalid="ignore"):
            across, down = self.place(x, y)
        parts, pen, finite = [], False, np.isfinite(x) & np.isfinite(y)
        for there, px, py in zip(finite.tolist(), across.tolist(), down.tolist(), strict=True):
            if there:
                step = f"H{px:.1f}V{py:.1f}" if line.held else f"L{px:.1f} {py:.1f}"
                parts.append(step if pen else f"M{px:.1f} {py:.1f}h.1")
            pen = there
        return "".join(parts)

    def drawn(self, x_title: str) -> str:
        """The frame with ticks and numbers."""
        bottom, right = _TOP + self.height, _LEFT + self.width
        found = [f'<rect x="{_LEFT:g}" y="{_TOP:g}" width="{self.width:g}" height="{self.height:g}"/>']
        texts = [f'<text x="{(_LEFT + right) / 2:g}" y="{_HEIGHT - 3:g}" text-anchor="middle">{_text(x_title)}</text>']
        for value, text in _ticks(self.left, self.right):
            x = _LEFT + float(self.place(value, self.low)[0])
            found.append(f'<path d="M{x:.1f} {_TOP:g}V{bottom:g}"/>')
            texts.append(f'<text x="{x:.1f}" y="{bottom + 14:g}" text-anchor="middle">{text}</text>')
        for value, text in _ticks(self.low, self.high):
            y = _TOP + float(self.place(self.left, value)[1])
            found.append(f'<path d="M{_LEFT:g} {y:.1f}H{right:g}"/>')
            texts.append(f'<text x="{_LEFT - 6:g}" y="{y + 4:.1f}" text-anchor="end">{text}</text>')
        frame = f'<g fill="none" stroke="#9a9a9a" stroke-opacity="0.45">{"".join(found)}</g>'
        return f'{frame}<g fill="currentColor" fill-opacity="0.8">{"".join(texts)}</g>'


def _ends(parts: Sequence[np.ndarray]) -> tuple[float, float]:
    """The smallest and the largest finite value, apart in any case."""
    finite = [part[np.isfinite(part)] for part in parts]
    low = min((float(part.min()) for part in finite if len(part)), default=0.0)
    high = max((float(part.max()) for part in finite if len(part)), default=1.0)
    if high - low > 1e-9 * max(abs(low), abs(high)):
        return low, high
    apart = 0.5 * abs(low) or 0.5
    return low - apart, high + apart


def _ticks(low: float, high: float) -> Iterator[tuple[float, str]]:
    """Round numbers between two, with their texts."""
    rough = (high - low) / _TICKS
    if not (0.0 < rough < inf and isfinite(low)):
        return
    power = 10.0 ** floor(log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if power * factor >= rough * (1.0 - 1e-9))
    for number in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1):
        yield number * step, f"{number * step:.6g}"


def _text(text: str) -> str:
    return escape(one_line(text))


def _legend(label: str, stroke: str) -> str:
    sample = f'<svg width="22" height="8" viewBox="0 0 22 8"><path d="M1 4H21" fill="none" {stroke}/></svg>'
    return f'<span style="white-space: nowrap; margin-right: 1em;">{sample} {_text(label)}</span>'

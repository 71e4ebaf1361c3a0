"""Pictures of few colours, as curves are: half the size of a file or less."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PIL import Image

COLOURS = 256


def save_small(figure: Any, path: Path, dpi: float = 80.0) -> None:
    """Save a matplotlib figure as a PNG with a palette.

    Args:
        figure: the figure. path: file; its folder is made. dpi: dots per inch.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi)
    shrink(path)


def shrink(path: Path) -> None:
    """Write a PNG again with a palette of its own."""
    with Image.open(path) as picture:
        smaller = picture.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    smaller.save(path, optimize=True)

"""Figures as files beside a page, where they are asked for. Touches only the folder it is given. No matplotlib here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

from cosim.report.page.page_files import explained, write_file

PictureKind = Literal["png", "svg"]
Pictures = bool | PictureKind
"""Whether figures are drawn, and as which kind of file; True is ``png``."""


def picture_kind(pictures: Pictures) -> PictureKind:
    """Kind of file that is asked for.

    Args:
        pictures: see `Pictures`.
    """
    return pictures if isinstance(pictures, str) else "png"


def write_pictures(drawn: Mapping[str, bytes], folder: Path, kind: PictureKind, former: str = "") -> dict[str, Path]:
    """Write figures, and return their paths by name. Those of an earlier page, which would not speak of this one, go,
    as do those of the same name in another kind.

    Args:
        drawn: by stem of the file. folder: created where a figure is written.
        kind: of the files. former: pattern of the stems of earlier ones; empty to keep all.

    Raises:
        OutputError: one cannot be written.
    """
    paths = {name: folder / f"{name}.{kind}" for name in drawn}
    with explained(f"Figures cannot be written to {folder}", "Choose another place."):
        for path in [*folder.glob(f"{former}.png"), *folder.glob(f"{former}.svg")] if former else []:
            path.unlink()
        for name, data in drawn.items():
            for other in get_args(PictureKind):
                paths[name].with_name(f"{name}.{other}").unlink(missing_ok=True)
            write_file(paths[name], data)
    return paths


def write_numbered(drawn: Mapping[str, bytes], folder: str | Path, kind: PictureKind) -> dict[str, Path]:
    """Write figures of signals or measures, whose names may hold anything, in their order; see `write_pictures`.

    Args:
        drawn: by name. folder: created where a figure is written; numbered ones that are there go. kind: of the files.

    Returns:
        Paths by name.

    Raises:
        OutputError: one cannot be written.
    """
    stems = [f"{i:02d}_{re.sub('[^A-Za-z0-9._-]+', '_', name)[:80]}" for i, name in enumerate(drawn, start=1)]
    paths = write_pictures(dict(zip(stems, drawn.values(), strict=True)), Path(folder), kind, "[0-9][0-9]*_*")
    return dict(zip(drawn, paths.values(), strict=True))

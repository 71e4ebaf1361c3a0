"""The structure of a run, with its text and its picture.

Made by `cosim.structure.inspect`, printed by `structure_text`, drawn by `structure_picture`.
"""

from __future__ import annotations

from pathlib import Path

from cosim.structure.structure_data import StructureData
from cosim.structure.structure_text import structure_text


class Structure(StructureData):
    """How the components of a run hang together, known before it; arguments as for `StructureData`."""

    def text(self, width: int | None = None) -> str:
        """The structure as tables for a terminal.

        Args:
            width: columns at which long lists are broken; None for no limit.
        """
        return structure_text(self, width)

    def draw(self, path: str | Path) -> Path:
        """Draw the structure to a file; its ending decides the format (``png``, ``svg``, ``pdf``).

        Returns:
            The path.

        Raises:
            OutputError: the ending is unknown or the file cannot be written.
        """
        from cosim.structure.structure_picture import draw_structure  # noqa: PLC0415 - matplotlib is loaded only by those who draw

        return draw_structure(self, path)

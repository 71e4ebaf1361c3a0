"""The structure of a run, with its text and its picture.

Made by `cosim.run.scenario_structure`, described by `structure_text`, drawn by `structure_picture`.
"""

from __future__ import annotations

from pathlib import Path

from cosim.structure.structure_data import StructureData
from cosim.structure.structure_text import structure_parts
from fmus.tables.table import Parts, joined


class Structure(StructureData):
    """How the components of a run hang together, known before it; arguments as for `StructureData`."""

    def tables(self) -> Parts:
        """The structure as tables and lists."""
        return structure_parts(self)

    def text(self, width: int | None = None) -> str:
        """The same as text.

        Args:
            width: of the terminal; None for lines as long as they are.
        """
        return joined(self.tables(), width)

    def draw(self, path: str | Path) -> Path:
        """Draw the structure to a file; its ending decides the format (``png``, ``svg``, ``pdf``).

        Returns:
            The path.

        Raises:
            OutputError: the ending is unknown or the file cannot be written.
        """
        from cosim.structure.structure_picture import draw_structure  # noqa: PLC0415 - matplotlib is loaded only by those who draw

        return draw_structure(self, path)

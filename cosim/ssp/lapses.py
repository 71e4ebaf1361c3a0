"""Lapses: form that public packages get wrong and that has one meaning all the same. Stated, and gone on with; refused
where asked.

What could mean two things, or other numbers, is no lapse: it is refused where it stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cosim.errors import ScenarioError
from cosim.ssp.document import Node, place


@dataclass
class Lapses:
    """The lapses of one package.

    Args:
        strict: whether the first one refuses it.
    """

    strict: bool = False
    _places: dict[str, list[str]] = field(default_factory=dict)

    def forgive(self, node: Node | str, text: str) -> None:
        """Go on although something is not as the standard wants it.

        Args:
            node: the element where it stands, or the place in words. text: what is wrong and how it is taken.

        Raises:
            ScenarioError: the reading is strict.
        """
        if self.strict:
            where = node if isinstance(node, str) else place(node)
            raise ScenarioError(f"{where}: {text} (Read strictly; without --strict this is a warning.)")
        self.note(node, text)

    def note(self, node: Node | str, text: str) -> None:
        """Something doubtful that is no fault by the standard.

        Args:
            node: element of the document. text: what was read, and how.
        """
        self._places.setdefault(text, []).append(node if isinstance(node, str) else place(node))

    def lines(self) -> list[str]:
        """Each of them once, with the first place where it was met and the number of others."""
        texts = []
        for text, places in self._places.items():
            others = len(set(places)) - 1
            more = f" (and {others} more place{'s' if others > 1 else ''})" if others else ""
            texts.append(f"{places[0]}{more}: {text}")
        return texts

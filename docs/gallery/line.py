"""One compared quantity of the gallery, and lines as cells of a table. Standard library only."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

EQUAL_WITHIN = 1e-2


@dataclass(frozen=True)
class Line:
    """One compared quantity.

    Args:
        quantity: what it is, with its conditions. unit: of both numbers.
        published: as printed; None where the thesis prints none, a text where it tells a story.
        measured: what comes out here, a number or a text.
        why: why they differ; required where what is measured is not within `EQUAL_WITHIN` of all others, or is alone.
        repeats: relative difference that another machine may show.
        independent: what an implementation gave that shares no code with this package; None where there is none.
    """

    quantity: str
    unit: str
    published: float | str | None
    measured: float | str
    why: str = ""
    repeats: float = EQUAL_WITHIN
    independent: float | str | None = None

    def differs(self) -> bool:
        """Whether the reader needs a reason."""
        others = [other for other in (self.published, self.independent) if other is not None]
        return not others or any(unequal(self.measured, other) for other in others)

    def content(self) -> dict[str, Any]:
        """What is kept: the fields that say something."""
        return {key: value for key, value in asdict(self).items() if key != "independent" or value is not None}


def unequal(measured: float | str, other: float | str) -> bool:
    """Whether two cells say different things: texts that are not equal, numbers further apart than `EQUAL_WITHIN`."""
    if isinstance(measured, str) or isinstance(other, str):
        return measured != other
    return abs(measured - other) > EQUAL_WITHIN * abs(other)


def table(lines: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Rows of cells with their heading, from the contents of lines; the independent column only where it is used."""
    shared = any("independent" in line for line in lines)
    columns = ("published", "independent", "measured") if shared else ("published", "measured")
    rows = [("quantity", "unit", *columns)]
    for line in lines:
        rows.append((line["quantity"], line["unit"], *(shown(line.get(column)) for column in columns)))
    return rows


def shown(value: float | str | None) -> str:
    """A number in four digits, a text as it is, a dash for nothing."""
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.4g}"

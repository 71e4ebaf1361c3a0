"""The index of the theses: figure or table, the script that computes it, and whether the two agree. Standard library.

What a row says follows from the lines that the sheet of the script has kept, and from nothing else: a published number
agrees where the measured one is within `EQUAL_WITHIN` of it, a published statement where the same is found.
"""

from __future__ import annotations

import ast
import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from line import EQUAL_WITHIN, unequal

GALLERY = Path(__file__).parent
STUDIES = GALLERY.parent / "studies"
HEADING = ["| figure, table or equation | script | agrees? |", "|---|---|---|"]


def figures() -> str:
    """One table a thesis, with a row for each script of its folder."""
    return "\n".join(thesis(head.parent) for head in sorted(GALLERY.glob("*/head.md")))


def thesis(folder: Path) -> str:
    """The table of one thesis, under the title of its page."""
    title = (folder / "head.md").read_text(encoding="utf-8").splitlines()[0].removeprefix("# Gallery: ").capitalize()
    sheets = [
        (path, json.loads(path.read_text(encoding="utf-8"))) for path in sorted((folder / "numbers").glob("*.json"))
    ]
    rows = [row(folder.name, path.stem, sheet) for path, sheet in sheets]
    return "\n".join(
        [f"### {title}", "", counted([sheet["lines"] for _path, sheet in sheets]), "", *HEADING, *rows, ""]
    )


def counted(sheets: list[list[dict[str, Any]]]) -> str:
    """How many sheets of a thesis agree, and how many of the published values."""
    said = Counter(agreement(lines).split()[0].strip("*;") for lines in sheets)
    published, off = (sum(map(len, part)) for part in zip(*map(compared, sheets), strict=True))
    return (
        f"{len(sheets)} sheets: {said['agrees']} agree, {said['differs']} differ, for {said['nothing']} nothing is "
        f"published. Of {published} published values {published - off} are met."
    )


def row(folder: str, name: str, sheet: dict[str, Any]) -> str:
    """Source, script with a link to its section, and whether it agrees."""
    section = re.sub(r"[^\w\- ]", "", f"{name[:2]} {sheet['title']}".lower()).replace(" ", "-")
    cells = (sheet["source"], f"[`{name}`](gallery_{folder}.md#{section})", agreement(sheet["lines"]))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def agreement(lines: list[dict[str, Any]]) -> str:
    """Agrees; differs, because; or nothing is published. Counted over the lines of a sheet."""
    published, off = compared(lines)
    if off:
        (reason, _count), *others = Counter(line["why"] for line in off).most_common()
        more = f" ({len(others)} further reasons)" if len(others) > 1 else " (and one further reason)" if others else ""
        return f"**differs** in {len(off)} of {len(published)}, because {shortened(reason)}{more}"
    if published:
        return f"agrees ({len(published)} within {EQUAL_WITHIN:.0%})"
    return f"nothing published{beside_independent(lines)}"


def compared(lines: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The lines for which something is published, and those of them for which the measured value is another."""
    published = [line for line in lines if line["published"] is not None]
    return published, [line for line in published if unequal(line["measured"], line["published"])]


def beside_independent(lines: list[dict[str, Any]]) -> str:
    """How many numbers agree with those of an implementation that shares no code with this package."""
    shared = [line for line in lines if line.get("independent") is not None]
    equal = sum(not unequal(line["measured"], line["independent"]) for line in shared)
    return f"; {equal} of {len(shared)} agree with an independent implementation" if shared else ""


def shortened(reason: str) -> str:
    """The first clause of a reason; the section of the sheet has the whole of it."""
    return re.split(r";\s|\.\s", reason, maxsplit=1)[0]


def studies() -> str:
    """A row for each study of the package: what it asks, its script, and the page that its tables stand in."""
    rows = ["| study | script | page |", "|---|---|---|"]
    for script in sorted(STUDIES.glob("*.py")):
        words = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
        page = re.search(r"docs/(\w+/(\w+)\.md)", script.read_text(encoding="utf-8"))
        if f"docs/studies/{script.name}" in words and page is not None:
            asked = re.split(r"[.:]\s", " ".join(words.split()), maxsplit=1)[0]
            rows.append(f"| {asked} | `docs/studies/{script.name}` | [{page[2]}](../{page[1]}) |")
    return "\n".join([*rows, ""])

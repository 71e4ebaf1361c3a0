"""Runs every numbered script of the gallery and writes the page ``docs/gallery.md`` with its figures.

``python docs/gallery/build.py`` runs all, with names as arguments only those. The numbers stay in
``docs/gallery/numbers``; the tests run the scripts again and compare.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE.parent / "gallery.md"
NUMBERS = HERE / "numbers"
PICTURES = HERE.parent / "images" / "gallery"
HEAD = """# Gallery

One script for every figure or table of Bouchama 2024 that its data allow, each with published beside measured. Figures of
the thesis were not available as data, so plots are ours; "–" means that nothing is printed. Run one with

    python docs/gallery/01_polach_maps.py

which prints its table and leaves a figure in `results/gallery`. This page is written by `python docs/gallery/build.py`; the
tests run all scripts and compare their numbers.
"""  # noqa: E501


def scripts() -> list[Path]:
    """The numbered scripts, in order."""
    return sorted(HERE.glob("[0-9][0-9]_*.py"))


def main(names: list[str]) -> None:
    """Run the scripts (all, or those named) and rewrite the page."""
    NUMBERS.mkdir(exist_ok=True)
    PICTURES.mkdir(parents=True, exist_ok=True)
    for script in scripts():
        if not names or script.stem in names:
            print(f"== {script.name}", flush=True)
            subprocess.run([sys.executable, str(script), "--out", str(NUMBERS)], check=True)
    for figure in NUMBERS.glob("*.png"):
        figure.replace(PICTURES / figure.name)
    PAGE.write_text(page(), encoding="utf-8")


def page() -> str:
    """The page from the numbers kept."""
    return "\n".join([HEAD, *(section(script) for script in scripts())])


def section(script: Path) -> str:
    """Title, docstring's first line, figure and table of one script."""
    content = json.loads((NUMBERS / f"{script.stem}.json").read_text(encoding="utf-8"))
    rows = ["| quantity | unit | published | measured |", "|---|---|---|---|"]
    for line in content["lines"]:
        cells = (line["quantity"], line["unit"], _shown(line["published"]), _shown(line["measured"]))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    reasons = dict.fromkeys(line["why"] for line in content["lines"] if line["why"])
    number = script.stem[:2]
    figure = [f"![{content['title']}](images/gallery/{script.stem}.png)", ""] if content["figure"] else []
    head = [f"## {number} {content['title']}", "", f"{content['source']}. Script: `docs/gallery/{script.name}`.", ""]
    return "\n".join([*head, *figure, *rows, "", *(f"- {reason}" for reason in reasons), ""])


def _shown(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.4g}"


if __name__ == "__main__":
    main(sys.argv[1:])

"""Runs the numbered scripts of the gallery, one folder a thesis, and writes one page a folder with its figures.

``python docs/gallery/build.py`` runs all, with names of folders or scripts as arguments only those, with ``--pages``
none: the pages are written again from the numbers kept. A folder with a ``head.md`` is taken up by itself; its page is
``docs/theses/gallery_FOLDER.md``. The numbers stay in the folder's ``numbers``; the tests run the scripts again and
compare.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))  # for those who load this file by its path
from line import table

HERE = Path(__file__).parent
PICTURES = HERE.parent / "images" / "gallery"
READING = """Each script shows what is published beside what is measured here; "independent" is what an
implementation gave that shares no code with this package, and "–" means that there is no such number. Figures of the
thesis were not available as data, so plots are ours. Run one with

    python docs/gallery/{folder}/{first}

which prints its table and leaves a figure in `results/gallery/{folder}`. This page is written by
`python docs/gallery/build.py`; the tests run all scripts and compare their numbers.
"""


def folders() -> list[Path]:
    """The folders of the gallery, one a thesis."""
    return sorted(head.parent for head in HERE.glob("*/head.md"))


def scripts(folder: Path) -> list[Path]:
    """The numbered scripts of a folder, in order."""
    return sorted(folder.glob("[0-9][0-9]_*.py"))


def page_path(folder: Path) -> Path:
    """The page of a folder."""
    return HERE.parent / "theses" / f"gallery_{folder.name}.md"


def main(names: list[str]) -> None:
    """Run the scripts (all, or those named by script or folder) and rewrite the pages."""
    chosen = set(names) - {"--pages"}
    unknown = chosen - {name for folder in folders() for name in (folder.name, *(s.stem for s in scripts(folder)))}
    if unknown:
        sys.exit(f"no folder or script {', '.join(sorted(unknown))}; there are {', '.join(f.name for f in folders())}")
    for folder in folders():
        numbers, pictures = folder / "numbers", PICTURES / folder.name
        numbers.mkdir(exist_ok=True)
        pictures.mkdir(parents=True, exist_ok=True)
        for script in scripts(folder):
            if not names or {script.stem, folder.name} & chosen:
                print(f"== {folder.name}/{script.name}", flush=True)
                subprocess.run([sys.executable, str(script), "--out", str(numbers)], check=True)
        for figure in numbers.glob("*.png"):
            figure.replace(pictures / figure.name)
        page_path(folder).write_text(page(folder), encoding="utf-8")


def page(folder: Path) -> str:
    """The page of a folder from the numbers kept."""
    head = (folder / "head.md").read_text(encoding="utf-8")
    here = scripts(folder)
    first = here[0].name if here else "NN_name.py"
    return "\n".join([head, READING.format(folder=folder.name, first=first), *(section(script) for script in here)])


def section(script: Path) -> str:
    """Title, source, figure and table of one script."""
    folder = script.parent
    numbers = folder / "numbers" / f"{script.stem}.json"
    if not numbers.is_file():
        sys.exit(f"{folder.name}/{script.name} has left no numbers yet: python docs/gallery/build.py {script.stem}")
    content = json.loads(numbers.read_text(encoding="utf-8"))
    heading, *rows = [[cell.replace("|", "\\|") for cell in row] for row in table(content["lines"])]
    lines = ["| " + " | ".join(cells) + " |" for cells in (heading, *rows)]
    lines.insert(1, "|" + "---|" * len(heading))
    reasons = dict.fromkeys(line["why"] for line in content["lines"] if line["why"])
    picture = f"../images/gallery/{folder.name}/{script.stem}.png"
    figure = [f"![{content['title']}]({picture})", ""] if content["figure"] else []
    source = f"{content['source']}. Script: `docs/gallery/{folder.name}/{script.name}`."
    head = [f"## {script.stem[:2]} {content['title']}", "", source, ""]
    return "\n".join([*head, *figure, *lines, "", *(f"- {reason}" for reason in reasons), ""])


if __name__ == "__main__":
    main(sys.argv[1:])

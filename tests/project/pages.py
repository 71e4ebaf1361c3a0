"""The pages a reader sees, README.md and those of docs and its books, and their fenced blocks. Reads files only."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
PACKAGES = ("plant_models", "fmu_observer", "fmus", "cosim")
BOOKS = ("guide", "theses", "reference")
PAGES = [README, *sorted(p for folder in (".", *BOOKS) for p in (ROOT / "docs" / folder).glob("*.md"))]
STEP_BY_STEP = "<!-- each line is typed into a shell, in order -->"
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
TUTORIALS = [page for page in PAGES if STEP_BY_STEP in page.read_text(encoding="utf-8")]

MARK, FENCED = r"(?:^<!-- command: (?P<command>\w+) -->\n)?", r"^```(?P<language>\w+)\n(?P<code>.*?)^```$"
FENCE = re.compile(MARK + FENCED, re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block: language, code, line in the page, and the name of the command it is marked as."""

    language: str
    code: str
    line: int
    command: str | None


def blocks(page: Path) -> list[Block]:
    """Fenced blocks with a language, in order."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(m["language"], m["code"], text.count("\n", 0, m.start("code")) + 1, m["command"])
        for m in FENCE.finditer(text)
    ]


def code_cells(notebook: Path) -> list[str]:
    """Code of the cells of a notebook, in order."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def generator() -> ModuleType:
    """``docs/generate.py`` as a module."""
    if "docs_generate" not in sys.modules:
        spec = importlib.util.spec_from_file_location("docs_generate", ROOT / "docs" / "generate.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules["docs_generate"] = module
    return sys.modules["docs_generate"]

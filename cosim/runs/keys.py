"""Keys of runs: digests of content, the same wherever files lie and whenever they were written. Reads files."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from cosim.run.results_manifest import sha256
from cosim.scenario.origin import ForeignFile
from cosim.scenario.paths import map_paths
from cosim.scenario.saving import plain
from fmus.tables.plain_data import jsonable
from fmus.versions import versions

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable


def digest(*texts: str) -> str:
    """Digest of texts in their order, 64 hexadecimal digits.

    Args:
        texts: whatever a row follows from.
    """
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


def table_content(table: ScenarioTable, folder: Path) -> str:
    """What a run of a scenario follows from, as one text: its tables, seed among them, with the content of each file in
    place of its path, and the versions of Python and the packages.

    Args:
        table: of the scenario, with all settings in it. folder: start of its relative paths.
    """
    tables = plain(table.model_dump(by_alias=True, exclude_unset=True))
    moved = map_paths(tables, lambda path: file_content((folder / path).resolve()))
    return f"{json.dumps(jsonable(moved), sort_keys=True)} {version_text()}"


def file_content(path: Path) -> str:
    """Digest of a file, and of those that belong to it: what a Python file imports beside it, the tables of results.

    Args:
        path: of the file, or of a results folder; of one that does not exist the path itself stands for it.
    """
    try:
        parts = ForeignFile("", path).parts
        return digest(*(text for part in parts for text in (part.name, sha256(part))))
    except OSError:
        return str(path)


@cache
def version_text() -> str:
    """Versions of Python and of the packages that can change a number; the platform is not one of them."""
    return json.dumps({name: number for name, number in versions().items() if name != "platform"}, sort_keys=True)

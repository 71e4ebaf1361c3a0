"""TOML files that people edit: read as they come from any editor, with faults said in words. Reads only the file it is
given.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from cosim.errors import not_utf8
from cosim.scenario.toml_mistakes import mistake

_ARCHIVE = b"PK\x03\x04"


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file; the mark that some editors put before UTF-8 is passed over.

    Args:
        path: of the file.

    Raises:
        ValueError: it is not TOML; the message says what it is and what to do. OSError: it cannot be read.
    """
    data = path.read_bytes()
    if data.startswith(_ARCHIVE):
        raise ValueError(
            "it is an archive (an FMU?), not a text file; for an FMU 'cosim new' writes a scenario to start from"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{not_utf8(data)}; save the file as UTF-8 text") from error
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(mistake(text, str(error))) from error

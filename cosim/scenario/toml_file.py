"""TOML files that people edit: read as they come from any editor, with faults said in words. Reads only the file it is
given.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

_ARCHIVE = b"PK\x03\x04"
_CONFLICT = re.compile(r"(<{7}|={7}|>{7})( |$)")


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
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line} is not UTF-8; save the file as UTF-8 text") from error
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        marked = next((n for n, line in enumerate(text.splitlines(), start=1) if _CONFLICT.match(line)), None)
        if marked is not None:
            raise ValueError(f"line {marked} begins the conflict of a merge; resolve it") from error
        raise ValueError(str(error)) from error

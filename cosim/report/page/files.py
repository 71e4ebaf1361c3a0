"""Files written whole or not at all. Touches only the file it is given, and a hidden folder beside it while it writes."""

from __future__ import annotations

import tempfile
from pathlib import Path


def write_file(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that no half of it is ever seen.

    Args:
        path: the file; replaced where it exists. data: its content.

    Raises:
        OSError: it cannot be written; a former one is still whole.
    """
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as scratch:
        part = Path(scratch) / path.name
        part.write_bytes(data)
        part.replace(path)

"""What the baseline of a test is called: readable, and safe on every file system. Standard library only."""

from __future__ import annotations

import re
from hashlib import sha256

LONGEST = 120
"""Characters of a name; some file systems end at 255, with folders and endings."""


def baseline_name(node: str, call: str = "") -> str:
    """The name of a baseline, without folder and ending.

    Args:
        node: of the test behind its file: ``test_brakes[wet]``, ``TestDrive::test_start``.
        call: name or number of the call in a test that makes several; empty for the first without a name.

    Returns:
        ``test_brakes-wet``, ``TestDrive.test_start``, ``test_brakes-wet@second``. Where characters had to be replaced,
        some characters of a digest follow, so that two tests never share a baseline.
    """
    plain = re.sub(r"\[(.*)\]$", r"-\1", node, flags=re.DOTALL).replace("::", ".")
    name = _safe(plain) + (f"@{_safe(call)}" if call else "")
    return name if len(name) <= LONGEST else f"{name[:LONGEST]}-{_digest(node + call)}"


def _safe(text: str) -> str:
    safe = re.sub(r"[^A-Za-z0-9._-]", "_", text)
    return safe if safe == text and not text.endswith(".") else f"{safe}-{_digest(text)}"


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]

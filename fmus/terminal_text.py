"""Text for a terminal: what an FMU says, without the control characters that would move the cursor or change colours there."""

from __future__ import annotations

import re

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
"""All of C0 but tab and line feed, DEL, C1, and what changes the direction of writing."""


def printable(text: str) -> str:
    """The text with each control character written out, e.g. ``\\x1b``; tabs and line feeds stay."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), text.replace("\r\n", "\n"))

"""Colour in a terminal: for what is wrong, doubtful and well, and for headings. Standard library only.

None where nobody sees it: in a file or a pipe, in a terminal that says it cannot (``TERM=dumb``), or where the user
wants none (``NO_COLOR``, see no-color.org).
"""

from __future__ import annotations

import os
import sys
from typing import Literal, TextIO

Role = Literal["bad", "doubtful", "good", "heading"]
_CODES: dict[Role, str] = {"bad": "1;31", "doubtful": "33", "good": "32", "heading": "1"}


def coloured(text: str, role: Role, stream: TextIO | None = None) -> str:
    """The text in the colour of its role, where the stream shows colours.

    Args:
        text: made plain already. role: what it is. stream: that it is printed to; None for standard output.
    """
    return f"\x1b[{_CODES[role]}m{text}\x1b[0m" if _shows_colour(sys.stdout if stream is None else stream) else text


def _shows_colour(stream: TextIO) -> bool:
    return not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb" and stream.isatty()

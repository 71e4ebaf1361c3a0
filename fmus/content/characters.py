"""Characters: what a text may hold that goes into XML, and how a number is written there."""

from __future__ import annotations

import math
import re

_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""All but `Char` of XML 1.0, section 2.2."""

DIGITS = 12
"""Significant decimal digits of a number that is taken for meant; a conversion factor such as 3.6 has few."""


class TextRefusedError(ValueError):
    """A text that XML cannot hold; the message says whose it is and which character is the matter."""


def check_text(text: str, whose: str) -> None:
    """Refuse characters that XML 1.0 forbids: an XML file cannot hold them in any way, not even escaped.

    Args:
        text: what is to be written. whose: what it is, for the message.

    Raises:
        TextRefusedError: there is such a character.
    """
    found = _FORBIDDEN.search(text)
    if found:
        what = f"the character U+{ord(found[0]):04X} at position {found.start() + 1}"
        raise TextRefusedError(f"{whose} holds {what}, which XML 1.0 forbids; remove it.")


def number_text(value: float) -> str:
    """A number as text: the decimal of few digits that is next to it where there is one (3.6, not 3.5999999999999996),
    else all.

    A quotient such as ``1 / (1 / 3.6)`` is one rounding away from the number that is meant; so is what is written here
    at most.

    Args:
        value: a finite number.
    """
    neat = float(f"{value:.{DIGITS}g}")
    return repr(neat if abs(neat - value) <= math.ulp(value) else float(value))

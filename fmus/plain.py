"""Plain text: what others wrote (an FMU's log, names in its description), made harmless for a terminal. Standard
library only.
"""

from __future__ import annotations

from unicodedata import category

UNSEEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of characters that steer a terminal or turn its text around, and are not seen themselves."""


def plain(text: str, keep: str = "\n\t") -> str:
    r"""Text in which every control character is shown in place of acting, as ``\x1b``; ends of lines are made ``\n``
    first.

    Args:
        text: of anyone.
        keep: control characters that stay.
    """
    return "".join(c if c in keep or category(c) not in UNSEEN else _shown(c) for c in text.replace("\r\n", "\n"))


def one_line(text: str) -> str:
    """The same in one line, spaces and ends of lines folded.

    Args:
        text: of others.
    """
    return plain(" ".join(text.split()), keep="")


def _shown(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")

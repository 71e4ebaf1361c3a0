"""A long text cut behind its first sentence. Standard library only."""

from __future__ import annotations

import re

_SENTENCE_END = re.compile(r"(?<=[.]) (?=[A-Z])|(?<=;) ")
LONGEST = 220
"""Characters; a shorter text stays whole."""


def first_sentence(text: object) -> tuple[str, str]:
    """A long text cut behind its first sentence.

    Args:
        text: what is cut.

    Returns:
        The sentence, and the rest.
    """
    whole = str(text)
    first, *rest = _SENTENCE_END.split(whole, 1) if len(whole) > LONGEST else [whole]
    return (first.removesuffix(";"), rest[0]) if rest else (whole, "")

"""Names that are used more than once. Uses nothing of the project."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def repeated_names(names: Iterable[str]) -> list[str]:
    """Those that occur more than once, sorted.

    Args:
        names: any number of them.
    """
    return sorted(name for name, count in Counter(names).items() if count > 1)

"""Names that MATLAB accepts for given names. Standard library only."""

from __future__ import annotations

import re
from collections.abc import Iterable

_MAX_LENGTH = 63  # namelengthmax of MATLAB
_FLOW_KEYWORDS = (
    "break",
    "case",
    "catch",
    "continue",
    "else",
    "elseif",
    "end",
    "for",
    "if",
    "otherwise",
    "parfor",
    "return",
)
_KEYWORDS = frozenset(
    (*_FLOW_KEYWORDS, "classdef", "function", "global", "persistent", "spmd", "switch", "try", "while")
)


def _legal(name: str) -> str:
    legal = re.sub(r"[^A-Za-z0-9_]", "_", name)
    if not legal or not legal[0].isalpha() or legal in _KEYWORDS:
        legal = "x" + legal
    return legal[:_MAX_LENGTH]


def matlab_names(names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """A legal and unique MATLAB variable name for each name: ``locomotive.position`` gives ``locomotive_position``.

    Args:
        names: names to translate.
        taken: legal names that are in use already.

    Returns:
        Legal names by original name, in the order given; clashes get ``_2``, ``_3``, ...
    """
    used, legal = set(taken), {}
    for name in names:
        stem = candidate = _legal(name)
        number = 1
        while candidate in used:
            number += 1
            suffix = f"_{number}"
            candidate = stem[: _MAX_LENGTH - len(suffix)] + suffix
        used.add(candidate)
        legal[name] = candidate
    return legal

"""The C that CasADi generates, stripped to what an FMU calls and made private, so that two FMUs never meet in one
program.
"""

from __future__ import annotations

import re
from collections.abc import Collection

FUNCTION = re.compile(
    r"^(?P<static>static )?(?:const )?(?:int|void|char|casadi_int|casadi_real)\s?\*? ?(?P<name>\w+)\([^;{]*\) ?"
    r"\{(?:.*\}|[\s\S]*?^\})\n\n?",
    re.MULTILINE,
)
_SPARSITY = re.compile(
    r"^(?:#define (?P<macro>casadi_s\d+) |static const casadi_int (?P<array>casadi_s\d+)\[).*\n", re.MULTILINE
)

_INLINE = {
    "return fmax(x, y);": "return y != y ? x : x > y ? x : y;",
    "return fmin(x, y);": "return y != y ? x : x < y ? x : y;",
    "for (i=0; i<n; ++i) *y++ = *x++;": "if (n < 8) for (i=0; i<n; ++i) *y++ = *x++;\n"
    "      else memmove(y, x, n * sizeof(*x));",
}
"""The same values as the functions of the C library, NaN included, without a call; long vectors copied at once."""


def private_source(source: str, called: Collection[str]) -> str:
    """Generated C with nothing visible outside its file.

    CasADi writes a dozen functions of information beside each function (names, sizes, sparsity); nobody calls them
    here.

    Args:
        source: what ``CodeGenerator.dump()`` returned.
        called: names of the functions that are called from outside.

    Returns:
        The source with only those functions and what they need, all of them static.
    """
    for call, inline in _INLINE.items():
        source = source.replace(call, inline)
    kept = FUNCTION.sub(lambda match: _kept(match, called), source)
    return _SPARSITY.sub(lambda match: match[0] if _is_used(match["macro"] or match["array"], kept) else "", kept)


def _kept(match: re.Match[str], called: Collection[str]) -> str:
    if match["static"]:
        return match[0]
    return f"static {match[0]}" if match["name"] in called or match["name"].startswith("casadi_") else ""


def _is_used(name: str, source: str) -> bool:
    """Whether a sparsity pattern occurs elsewhere than in its own definition."""
    return len(re.findall(rf"\b{name}\b", source)) > 2

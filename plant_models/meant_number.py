"""What number a text means that stands in place of one: with a decimal comma, or with a unit behind it. Standard
library only.
"""

from __future__ import annotations

import re
from collections.abc import Callable

_WHOLE = r"[-+]?(?:\d{1,3}(?:\.\d{3})+(?=,)|\d{1,3}(?:\.\d{3}){2,}|\d{1,3}(?:[' \u202f]\d{3})+|\d+)"
"""German, Swiss or French: marks or blanks between thousands; a single point may be that of a decimal number."""
_NUMBER = rf"(?P<whole>{_WHOLE})(?:(?P<mark>[.,])(?P<part>\d+))?(?P<power>[eE][-+]?\d+)?"
_GROUPED = r"(?P<whole>[-+]?\d{1,3}(?:,\d{3})+)(?P<mark>\.)(?P<part>\d+)(?P<power>[eE][-+]?\d+)?"
"""English: commas between thousands."""
_CUT = r"(?P<whole>[-+]?\d*)(?P<mark>[.,])(?P<part>\d*)(?P<power>[eE][-+]?\d+)?"
"""No digit on one side of the mark: ``.05``, ``5.``, which TOML takes for no numbers."""
_UNIT = r"\s*(?P<unit>[A-Za-zµ°%‰][\w/.°%^*-]*)?"
_MEANT = [re.compile(rf"\s*{number}{_UNIT}\s*") for number in (_GROUPED, _NUMBER, rf"(?=[-+]?[.,]?\d){_CUT}")]
_NO_DIGIT = re.compile(r"[^\d+-]")


def _without_unit(value: float, _unit: str) -> str:
    return f" without its unit: {value:.10g}"


def meant_number(stated: str, *, whole: bool = False, with_unit: Callable[[float, str], str] = _without_unit) -> str:
    """What to write in place of a text, as the end of a sentence that begins with 'expected a number'.

    Args:
        stated: the text. whole: whether a whole number is expected, which has no unit.
        with_unit: what to say of a number and the name of the unit behind it.

    Returns:
        Empty where the text means no number.
    """
    found = next((match for pattern in _MEANT if (match := pattern.fullmatch(stated)) is not None), None)
    if found is None:
        return ""
    digits = _NO_DIGIT.sub("", found["whole"])
    cut = bool(found["mark"]) and not (digits[-1:].isdigit() and found["part"])
    digits += "" if digits[-1:].isdigit() else "0"
    written = f"{digits}.{found['part']}" if found["part"] else digits
    written += found["power"] or ""
    if whole:
        return "" if written == stated.strip() and written.lstrip("+-").isdigit() else _whole(float(written), found)
    if found["unit"]:
        return with_unit(float(written), found["unit"])
    if cut:
        return f"; write {written}"
    if digits != found["whole"]:
        return f"; write {written}, with a point and no marks between thousands"
    return f"; write a point in place of the comma: {written}" if found["mark"] == "," else ""


def _whole(value: float, found: re.Match[str]) -> str:
    marks = [name for name, there in (("comma", found["mark"] == ","), ("unit", found["unit"])) if there]
    its = f"its {' and '.join(marks)}"
    if value.is_integer():
        return f"; write {value:.0f}" + (f" without {its}" if marks else ", with digits alone")
    return f"; with {its} it means {value:g}" if marks else f"; {value:g} is none"

"""What was expected in place of a value that a table refuses, in plain words, with what is likely meant."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from cosim.components.meant_in_unit import meant_in_unit
from cosim.errors import nearest

_CHOICE = re.compile(r"'([^']*)'")
_NUMBER, _WHOLE = "expected a number", "expected a whole number"
_KINDS = {
    "float_parsing": _NUMBER,
    "float_type": _NUMBER,
    "int_parsing": _WHOLE,
    "int_type": _WHOLE,
    "int_from_float": _WHOLE,
    "bool_parsing": "expected true or false",
    "bool_type": "expected true or false",
    "finite_number": "expected a finite number",
    "string_type": "expected a text, in quotation marks",
    "list_type": "expected a list, as in [1, 2]",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "missing": "is missing",
}
"""By the kinds of errors of pydantic."""
_BOUNDS: Mapping[str, tuple[str, str]] = {
    "greater_than": ("gt", "expected more than {:g}"),
    "greater_than_equal": ("ge", "expected at least {:g}"),
    "less_than": ("lt", "expected less than {:g}"),
    "less_than_equal": ("le", "expected at most {:g}"),
}


def wrong_value(item: Mapping[str, Any]) -> str:
    """What was expected.

    Args:
        item: an error of pydantic, of a value that has another kind or lies out of its range.

    Returns:
        A part of a sentence, without the place and without the value that was given.
    """
    kind, stated, context = str(item["type"]), item.get("input"), item.get("ctx", {})
    if kind == "literal_error":
        choices = _CHOICE.findall(str(context.get("expected", "")))
        hint = nearest(stated, choices) if isinstance(stated, str) else ""
        return f"expected {context['expected']}" + (f"; {hint}" if hint.startswith("did you mean") else "")
    if kind in _BOUNDS:
        key, text = _BOUNDS[kind]
        return text.format(context[key])
    expected = _KINDS.get(kind, str(item["msg"]))
    if not isinstance(stated, str) or expected not in (_NUMBER, _WHOLE):
        return expected
    return expected + meant_in_unit(stated, whole=expected == _WHOLE)

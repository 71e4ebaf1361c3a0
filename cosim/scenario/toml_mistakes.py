"""Mistakes that people make in TOML files, said in their words: what stands in the line, and what to write in place of
it. Standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Callable

_AT = re.compile(r"\(at line (\d+)")
_DECLARED = re.compile(r"Cannot declare \((.*)\) twice")
_MARKS = dict.fromkeys("“”„‟«»", '"') | dict.fromkeys("‘’‚‛", "'")
"""Quotation marks of word processors, and those of TOML."""
_KEY = r"^\s*(?P<key>[\w.\"'-]+)\s*"
_END = r"\s*,?\s*(#.*)?$"
_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_WITH_COMMA = r"=\s*(?P<whole>[-+]?\d+(?:\.\d{3})*),(?P<part>\d+(?:[eE][-+]?\d+)?)"


def mistake(text: str, reason: str) -> str:
    """What is wrong in a text that is no TOML.

    Args:
        text: of the file. reason: what the reader of TOML says, with the number of a line where it knows one.

    Returns:
        One line for the user, with the number of the line.
    """
    lines = text.splitlines()
    conflict = next((n for n, line in enumerate(lines, 1) if re.match(r"(<{7}|={7}|>{7})( |$)", line)), None)
    if conflict is not None:
        return f"line {conflict} begins the conflict of a merge; resolve it"
    if text.lstrip().startswith("{"):
        return "it is JSON; a scenario is TOML: lines such as stop = 60.0, and tables such as [components.train]"
    at = _AT.search(reason)
    number = min(int(at[1]), len(lines)) if at is not None else len(lines)
    return _twice(reason, lines, number) or _in_lines(lines, number) or reason


def _twice(reason: str, lines: list[str], number: int) -> str:
    """A key or a table that stands there already."""
    declared = _DECLARED.search(reason)
    if declared is not None:
        name = ".".join(part.strip(" '\"") for part in declared[1].split(",") if part.strip())
        head = re.compile(rf"^\s*\[\s*{re.escape(name)}\s*\]")
        first = next((n for n, line in enumerate(lines, 1) if head.match(line)), number)
        return f"line {number}: the table [{name}] stands in line {first} already; put all its keys there"
    key = re.match(_KEY + "=", lines[number - 1]) if "Cannot overwrite a value" in reason else None
    if key is None:
        return ""
    equal = re.compile(rf"^\s*{re.escape(key['key'])}\s*=")
    first = next(n for n in range(number - 1, -1, -1) if n == 0 or equal.match(lines[n - 1]))
    where = f" in line {first}" if first else ""
    return f"line {number}: {key['key']} has a value{where} already; remove one of them"


def _in_lines(lines: list[str], number: int) -> str:
    """What is wrong in a line or, where a list or a text is not closed, in one before it."""
    line = lines[number - 1] if lines else ""
    for explain in _MISTAKES:
        found = explain(line)
        if found:
            return f"line {number}: {found}"
    before = lines[number - 2].split("#")[0].rstrip() if number > 1 else ""
    if line.lstrip()[:1] in ('"', "'", "{") and before[-1:] in ('"', "'", "}"):
        return f"line {number - 1}: a comma is missing at its end"
    return ""


def _comma(line: str) -> str:
    """A decimal comma, also in a table within the line."""
    inner = r"[{,]\s*" + _KEY.removeprefix("^") + _WITH_COMMA + r"\s*[,}]"
    found = re.match(_KEY + _WITH_COMMA + _END, line) or re.search(inner, line)
    if found is None:
        return ""
    written = f"{found['key']} = {found['whole']}"
    meant = f"{found['key']} = {found['whole'].replace('.', '')}.{found['part']}"
    return f"{written},{found['part']} has a decimal comma; write a point: {meant}"


def _truth(line: str) -> str:
    found = re.match(_KEY + r"=\s*(?P<value>true|false|yes|no|on|off)" + _END, line, re.IGNORECASE)
    if found is None:
        return ""
    meant = "true" if found["value"].lower() in ("true", "yes", "on") else "false"
    return f"{found['value']} is no truth value; write {found['key']} = {meant}, in small letters"


def _unit(line: str) -> str:
    found = re.match(_KEY + rf"=\s*(?P<value>{_NUMBER})\s*(?P<unit>[A-Za-zµ°%][\w/.°%]*)" + _END, line)
    if found is None:
        return ""
    return (
        f"{found['key']} = {found['value']} {found['unit']}: a number stands without its unit; state it in SI units "
        f"(s, m, m/s, kg, N)"
    )


def _quotation_marks(line: str) -> str:
    mark = next((m for m in _MARKS if m in line), None)
    return "" if mark is None else f"{mark} is a quotation mark of a word processor; write {_MARKS[mark]}"


def _backslash(line: str) -> str:
    found = re.search(r'"(?P<path>[^"]*\\[^"]*)"', line)
    if found is None:
        return ""
    return f"a path with \\ stands in single quotation marks: '{found['path']}'"


def _no_quotation_marks(line: str) -> str:
    found = re.match(_KEY + r"=\s*(?P<value>[A-Za-z./\\][^\s\"'=\[\]{}#]*)" + _END, line)
    if found is None:
        return ""
    return f'a text stands in quotation marks: {found["key"]} = "{found["value"].rstrip(",")}"'


def _colon(line: str) -> str:
    found = re.match(_KEY + r":\s*(?P<value>[^\s#].*)$", line)
    return "" if found is None else f"a colon in place of =; write {found['key']} = {found['value'].rstrip()}"


def _semicolon(line: str) -> str:
    found = re.match(r"(?P<whole>[^#]*?)\s*;" + _END, line)
    return "" if found is None else f"a semicolon at its end; write {found['whole'].strip()}"


def _no_value(line: str) -> str:
    found = re.match(_KEY + "=" + _END, line)
    return "" if found is None else f"{found['key']} has no value behind ="


_MISTAKES: tuple[Callable[[str], str], ...] = (
    _quotation_marks,
    _comma,
    _semicolon,
    _truth,
    _unit,
    _backslash,
    _no_quotation_marks,
    _colon,
    _no_value,
)
"""In their order: the first that fits is reported."""

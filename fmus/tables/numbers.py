"""Numbers as people read them. Standard library only."""

from __future__ import annotations

import math

DASH = "–"


def number(value: object, digits: int = 3) -> str:
    """A number with a few significant digits and no more exponent than it needs.

    Args:
        value: the number; None and NaN give a dash, infinity gives its sign; anything else is shown as its text.
        digits: significant digits.
    """
    if value is None:
        return DASH
    if isinstance(value, (bool, str)) or not isinstance(value, (int, float)):
        return str(value)
    if math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    return _finite(float(value), digits)


def instant(value: object) -> str:
    """An instant to the millisecond, as long as a run may be: 1003.25; one before the first to three digits: 0.00002.

    Args:
        value: [s]; None and NaN give a dash.
    """
    if not isinstance(value, int | float) or not math.isfinite(value):
        return number(value)
    places = 2 - math.floor(math.log10(abs(value))) if 1e-9 <= abs(value) < 1e-3 else 3
    return f"{round(value, places) + 0.0:.{places}f}".rstrip("0").rstrip(".")


def _finite(value: float, digits: int) -> str:
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    if not -5 < int(exponent) < 6:
        return f"{mantissa}e{int(exponent)}"
    return f"{float(f'{mantissa}e{exponent}'):.{max(digits - 1 - int(exponent), 0)}f}"


def error_number(value: float | None, digits: int = 3) -> str:
    """A size of an error: as `number`, but an infinite one reads ``diverged``.

    Args:
        value: the size; None and NaN give a dash.
        digits: significant digits.
    """
    return "diverged" if value is not None and math.isinf(value) else number(value, digits)

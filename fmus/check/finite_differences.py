"""Directional derivatives against finite differences, for both interface types."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from fmpy.model_description import ModelVariable

from fmus.check.findings import CheckOutcome, failed, passed

RELATIVE_STEP = 1e-6
"""Of a finite difference: near the cube root of the rounding unit, where central differences are best."""

TOLERANCE = 1e-3
"""Between a derivative and its finite difference, as a share of either: far above what differences lose, far below a
mistake.
"""

ROUNDING = 1e3 * np.finfo(float).eps
"""What evaluation loses, as a share of the values; internal sums and functions cost some digits."""

NOTHING = 1e-9
"""A change of an unknown over the nominal range of a known that counts as none: at a flat point both sides are
rounding.
"""


_SCATTERED = 0.5 + np.sqrt(np.arange(2.0, 10.0)) % 1.0
"""Steps, as multiples of that of the differences, at which the rounding of a column is measured: unevenly spaced, for
steps that fall on the grid of what is rounded show nothing.
"""


def nominal_of(variable: ModelVariable) -> float:
    """The nominal value of a variable, 1 where it declares none."""
    declared = getattr(variable, "nominal", None)
    return abs(float(declared)) if declared else 1.0


def compare(
    evaluate: Callable[[str, float], np.ndarray],
    directional: Callable[[str], np.ndarray],
    knowns: Mapping[str, float],
    unknowns: Sequence[str],
    nominal: Mapping[str, float],
) -> CheckOutcome:
    """Compare column by column.

    Args:
        evaluate: values of the unknowns with one known set to a value; the known is put back by the caller's next call.
        directional: what the FMU says, by known.
        knowns: their present values. unknowns: names for messages. nominal: size of each known.

    A kink between the two points is no mistake: a derivative between the two one-sided differences is right. Nor is
    what the FMU rounds away inside, where large terms cancel: a column that seems wrong is evaluated again with twice
    the scatter of its values about a line, over steps too short for anything else to bend it.
    """
    pairs = 0
    for name, value in knowns.items():
        said = directional(name)
        wrong = _wrong(partial(evaluate, name), said, value, nominal[name])
        pairs += len(said)
        if wrong is not None:
            k, found = wrong
            return failed(
                f"the derivative of {unknowns[k]} along {name} is said to be {said[k]:g}, differences give {found:g}"
            )
    return passed(f"{pairs} derivatives agree with finite differences")


def _wrong(
    evaluate: Callable[[float], np.ndarray], said: np.ndarray, value: float, nominal: float
) -> tuple[int, float] | None:
    """The first unknown of a column that disagrees, with its central difference; None where all agree."""
    delta = RELATIVE_STEP * max(abs(value), nominal)
    above, here, below = (evaluate(value + d) for d in (delta, 0.0, -delta))
    right, left = (above - here) / delta, (here - below) / delta
    low, high = np.minimum(left, right), np.maximum(left, right)
    size = np.max(np.abs([above, here, below]), axis=0)
    slack = TOLERANCE * np.maximum(np.abs(said), np.maximum(np.abs(low), np.abs(high))) + ROUNDING * size / delta
    slack += NOTHING / nominal
    bad = ~((said >= low - slack) & (said <= high + slack))
    if bad.any() and np.isfinite(size).all():
        slack = slack + 2.0 * _scatter([evaluate(value + share * delta) for share in _SCATTERED]) / delta
        bad = ~((said >= low - slack) & (said <= high + slack))
    if not bad.any():
        return None
    k = int(np.argmax(bad))
    return k, float(0.5 * (right[k] + left[k]))


def _scatter(values: Sequence[np.ndarray]) -> np.ndarray:
    """Largest distance of values at `_SCATTERED` from a line through them, by unknown."""
    seen = np.array(values)
    if not np.isfinite(seen).all():
        return np.zeros(seen.shape[1])
    line = np.polynomial.polynomial.polyfit(_SCATTERED, seen, 1)
    return np.asarray(np.max(np.abs(seen - np.polynomial.polynomial.polyval(_SCATTERED, line).T), axis=0))

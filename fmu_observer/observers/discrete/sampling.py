"""One sample of an observer that lives at samples only: first the period that has passed, then the measurement. A pure
function.

What such an observer publishes after a sample belongs to that sample, and not to the next one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from plant_models.hybrid import Signal, memory, vector
from plant_models.hybrid.system import Array

Update = Callable[[Array], Array]  # (memory without the last, shape (k,)) -> the same, shape (k,)

PRIMED = memory("primed", "1", 0.0, "1 after the first sample")


def primed_memory(*signals: Signal) -> tuple[Signal, ...]:
    """Memory of an observer, with the mark of the first sample behind it.

    Args:
        signals: memory of the observer itself.
    """
    return (*signals, PRIMED)


def at_sample(x: Array, advance: Update, correct: Update) -> Array:
    """State after a sample: advanced over the period since the last one (not at the first), then corrected.

    Args:
        x: whole state, shape (k + 1,), the last one `PRIMED`.
        advance: over one period. correct: by the measurement at hand.

    Returns:
        Shape (k + 1,).
    """
    count = x.shape[0] - 1
    before = x[:count]
    corrected = correct(np.where(x[count] > 0.5, advance(before), before))
    return vector(*(corrected[i] for i in range(count)), 1.0 + 0.0 * x[count])

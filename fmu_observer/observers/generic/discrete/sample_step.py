"""One sample of an observer that lives at samples only: first the period that has passed, then the measurement. A pure
function.

What such an observer publishes after a sample belongs to that sample, and not to the next one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from plant_models.hybrid import Array, Signal, memory

Update = Callable[[Any], dict[str, Array]]  # named tuple of the memory -> what of it changes, by name

INITIALISED = memory("primed", "1", 0.0, "1 after the first sample")


def initialised_memory(*signals: Signal) -> tuple[Signal, ...]:
    """Memory of an observer, with the mark of the first sample behind it.

    Args:
        signals: memory of the observer itself.
    """
    return (*signals, INITIALISED)


def at_sample(x: Any, advance: Update, correct: Update) -> dict[str, Array]:
    """What a sample changes: the memory is advanced over the period since the last one (not at the first), then
    corrected.

    Args:
        x: named tuple of the memory, `INITIALISED` among it.
        advance: over one period. correct: by the measurement at hand.
    """
    moved = {name: np.where(x.primed > 0.5, value, getattr(x, name)) for name, value in advance(x).items()}
    return moved | correct(x._replace(**moved)) | {INITIALISED.name: 1.0}

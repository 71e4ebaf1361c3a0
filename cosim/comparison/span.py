"""Where the rows of two results begin, end and leave out something. NumPy only; texts come from here too."""

from __future__ import annotations

import numpy as np


def rounding(*times: float) -> float:
    """How much two instants may differ by rounding alone [s].

    Args:
        times: instants [s].
    """
    return 8.0 * float(np.finfo(float).eps) * max(abs(time) for time in times)

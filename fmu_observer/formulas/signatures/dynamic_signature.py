"""Dynamic signatures: the pencil map slid over a record draws a curve. NumPy on recordings, all windows at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmu_observer.formulas.signatures.pencil import EPS, NextScaling, pencil_point


def dynamic_signature(
    record: np.ndarray | Sequence[float], order: int, eps: float = EPS, next_scaling: NextScaling = "norm"
) -> np.ndarray:
    """Signature S^N of a record: one point for each sample that has N before it, Omar 2012, section 2.4 and (4.4.1).

    Args:
        record: samples at equal distances from the oldest to the newest, shape (M + N,); or of several records that
            are as long, shape (M + N, ...). order: past samples a point, N, 2 at least. eps: regularisation in the
            unit of the samples. next_scaling: ``norm`` or ``literal``, see `pencil_point`.

    Returns:
        Abscissas and ordinates of the M points [1], from the oldest to the newest, shape (2, M, ...). The thesis
        counts them from the newest.

    Raises:
        ValueError: the order is less than 2, or the record is not longer than it or holds what is not finite.
    """
    samples = np.asarray(record, dtype=float)
    if samples.ndim == 0 or len(samples) <= order:
        length = len(samples) if samples.ndim else 0
        raise ValueError(f"a signature of order {order} needs {order + 1} samples at least, the record has {length}.")
    if not np.all(np.isfinite(samples)):
        first = int(np.argwhere(~np.isfinite(samples))[0][0])
        raise ValueError(f"sample {first} of the record is not finite; cut the record or mend it first.")
    windows = np.lib.stride_tricks.sliding_window_view(samples, order + 1, axis=0)  # shape (M, ..., N + 1)
    ordered = np.moveaxis(windows, -1, 0)
    return np.asarray(pencil_point(ordered[:-1], ordered[-1], eps, next_scaling))

"""Distance of one point to envelopes, as formulas that trace: `envelope_distance` for observers. It knows nothing but
NumPy and the envelope's numbers.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.formulas.signatures.envelope import Envelope
from plant_models.hybrid import Array

_NO_LINE = 1e9
"""Distance along a line that misses the envelope; finite, so that it traces."""


def envelope_numbers(envelope: Envelope) -> np.ndarray:
    """An envelope as one row: cosine and sine of its angle, edges, lower and upper bounds; shape (3 q + 3,).

    Args:
        envelope: of q slabs.
    """
    turn = [np.cos(envelope.angle), np.sin(envelope.angle)]
    return np.concatenate([turn, envelope.edges, envelope.lower, envelope.upper])


def class_distance(point: Array, numbers: Array, slope: Array) -> Array:
    """Distance of a point to an envelope along a line, the smallest of which over several lines is (4.5.18): Omar 2012,
    (4.5.15)-(4.5.16).

    Args:
        point: shape (2,). numbers: see `envelope_numbers`. slope: cosine and sine of the line's direction in the
            envelope's frame, neither of them 0, shape (2,); see `line_slopes`.

    Returns:
        A number [1]; 0 in the envelope, `_NO_LINE` where the line misses it.
    """
    slabs = (len(numbers) - 3) // 3
    x = numbers[0] * point[0] - numbers[1] * point[1]
    y = numbers[1] * point[0] + numbers[0] * point[1]
    across = (numbers[2 : slabs + 3] - x) / slope[0]
    lower, upper = ((numbers[k * slabs + 3 : (k + 1) * slabs + 3] - y) / slope[1] for k in (1, 2))
    begin = np.maximum(np.minimum(across[:-1], across[1:]), np.minimum(lower, upper))
    end = np.minimum(np.maximum(across[:-1], across[1:]), np.maximum(lower, upper))
    whole = np.sum(np.maximum(end - begin, 0.0))
    nearest = np.min(np.where(end >= begin, np.maximum(np.maximum(begin, -end), 0.0), _NO_LINE))
    share = np.where(whole > 0.0, nearest / np.where(whole > 0.0, whole, 1.0), _NO_LINE)
    return np.where(nearest > 0.0, np.minimum(share, _NO_LINE), 0.0)


def line_slopes(directions: int) -> np.ndarray:
    """Slopes of lines for `class_distance`, half a step beside the axes so that none is parallel to an edge, shape
    (directions, 2).

    Args:
        directions: number of lines, equally spaced over half a turn.
    """
    angles = (np.arange(directions) + 0.5) * np.pi / directions
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)

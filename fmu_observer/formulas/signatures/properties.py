"""Properties of signatures: what is read off a curve as one number. NumPy, many signatures at once.

The thesis names five of them as examples, section 3.4.2; the branches are those of section 2.5. The rest are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from plant_models.hybrid import Array

_Property = Callable[[np.ndarray], np.ndarray]
_SMALLEST = 1e-3
"""eps of the largest quotient: keeps it finite where an ordinate is 0."""


def _largest_quotient(signature: np.ndarray) -> np.ndarray:
    """Largest ``xi / (eps + |eta|)``: Omar 2012, section 3.4.2.

    Args:
        signature: shape (2, M, ...).
    """
    return np.asarray((signature[0] / (_SMALLEST + np.abs(signature[1]))).max(axis=0))


def _path_length(signature: np.ndarray) -> np.ndarray:
    """Length of the curve through the points [ours].

    Args:
        signature: shape (2, M, ...).
    """
    steps = np.diff(signature, axis=1)
    return np.asarray(np.hypot(steps[0], steps[1]).sum(axis=0))


def _chord(signature: np.ndarray) -> np.ndarray:
    """Distance between first and last point [ours].

    Args:
        signature: shape (2, M, ...).
    """
    ends = signature[:, -1] - signature[:, 0]
    return np.asarray(np.hypot(ends[0], ends[1]))


def slope(signature: np.ndarray) -> np.ndarray:
    """Slope of the line of least squares, ordinate over abscissa: Omar 2012, section 4.6.2.

    A signature without extent along the abscissa has the slope 0.

    Args:
        signature: shape (2, M, ...).
    """
    xi, eta = signature - signature.mean(axis=1, keepdims=True)
    spread = (xi * xi).sum(axis=0)
    found = np.divide((xi * eta).sum(axis=0), spread, out=np.zeros_like(spread), where=spread > 0.0)
    return np.asarray(found)


def branch_tips(signature: Array, interpolate: bool = False) -> tuple[Array, Array]:
    """Abscissas at which the two right-hand branches turn: the largest and the smallest local maximum of the abscissa.

    Local maxima left of the middle between the extremes are of other branches and do not count. This takes the place
    of the printed x_m of Omar 2012, section 2.5, which looks for points at the ordinate of the tip and finds those far
    left as well. It traces.

    Args:
        signature: abscissas and ordinates, each of shape (M, ...) with M at least 3.
        interpolate: take the top of the parabola through three points, for coarse samples.

    Returns:
        Farthest and nearest tip, each of shape (...); both the largest abscissa where there is no local maximum.
    """
    xi = signature[0]
    left, inner, right = xi[:-2], xi[1:-1], xi[2:]
    top, bottom = np.max(xi, axis=0), np.min(xi, axis=0)
    turns = (inner > left) * (inner >= right) * (inner > 0.5 * (top + bottom))
    if interpolate:
        bend = 2.0 * inner - left - right
        inner = inner + np.where(turns, 0.125 * (right - left) ** 2 / np.where(turns, bend, 1.0), 0.0)
    far = np.max(np.where(turns, inner, bottom), axis=0)
    near = np.min(np.where(turns, inner, np.maximum(top, far)), axis=0)
    found = np.max(np.where(turns, 1.0, 0.0), axis=0) > 0.5
    return np.where(found, far, top), np.where(found, near, top)


def _branch_gap(signature: np.ndarray) -> np.ndarray:
    """Gap r3 between the two right-hand branches: Omar 2012, section 2.5, in the reading of `branch_tips`.

    Args:
        signature: S1, shape (2, M, ...).
    """
    far, near = branch_tips(signature)
    return np.asarray(far - near)


def _length_to_middle(signature: np.ndarray) -> np.ndarray:
    """Length r1 from the left end to the middle between the right-hand branches: Omar 2012, section 2.5.

    Args:
        signature: S1, shape (2, M, ...).
    """
    far, near = branch_tips(signature)
    return np.asarray(0.5 * (far + near) - signature[0].min(axis=0))


def printed_branches(signature: Array, tolerance: float = 0.01) -> tuple[Array, Array]:
    """Largest abscissa x_max, and x_m as printed: the smallest one whose ordinate is nearly that of the largest, Omar
    2012, section 2.5. It traces.

    Args:
        signature: S1, abscissas and ordinates, each of shape (M, ...). tolerance: of the ordinate.
    """
    xi, eta = signature[0], signature[1]
    top, floor = np.max(xi, axis=0), np.min(eta, axis=0)
    at_top = np.max(np.where(xi >= top, eta, floor), axis=0)
    return top, np.min(np.where(np.abs(eta - at_top) < tolerance, xi, top), axis=0)


def printed_tip(signature: Array) -> Array:
    """Abscissa r2 as printed: of the point with the largest second difference of the ordinates, Omar 2012, section
    2.5. It traces.

    Args:
        signature: S2, abscissas and ordinates, each of shape (M, ...) with M at least 3.
    """
    xi, eta = signature[0], signature[1]
    bend = eta[2:] - 2.0 * eta[1:-1] + eta[:-2]
    return np.max(np.where(bend >= np.max(bend, axis=0), xi[1:-1], np.min(xi, axis=0)), axis=0)


PROPERTIES: Mapping[str, _Property] = {
    "max_xi": lambda s: s[0].max(axis=0),
    "min_xi": lambda s: s[0].min(axis=0),
    "max_eta": lambda s: s[1].max(axis=0),
    "min_eta": lambda s: s[1].min(axis=0),
    "range_xi": lambda s: np.ptp(s[0], axis=0),
    "range_eta": lambda s: np.ptp(s[1], axis=0),
    "mean_xi": lambda s: s[0].mean(axis=0),
    "mean_eta": lambda s: s[1].mean(axis=0),
    "deviation_xi": lambda s: s[0].std(axis=0),
    "deviation_eta": lambda s: s[1].std(axis=0),
    "median_xi": lambda s: np.median(s[0], axis=0),
    "median_eta": lambda s: np.median(s[1], axis=0),
    "largest_quotient": _largest_quotient,
    "path_length": _path_length,
    "chord": _chord,
    "slope": slope,
    "branch_gap": _branch_gap,
    "length_to_middle": _length_to_middle,
}
"""Properties among which a classifier is sought, by name: a signature of shape (2, M, ...) to shape (...)."""

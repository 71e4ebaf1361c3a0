"""Explicit inversion of signatures: from properties of a window back to the state at its start, by tables built
beforehand. Pure functions that trace, so that observers carry them; they know nothing but NumPy.

The map from states to properties is given as values at the nodes of a grid. What inverts it needs no iteration over an
unknown number of steps: every curve, cell or candidate is examined, and the best one is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array
from plant_models.hybrid.scan import enclosed, scan

_TINY = 1e-300
"""Keeps quotients finite where both of their sides vanish."""


class Found(NamedTuple):
    """What a look-up gives.

    Attributes:
        values: the quantities found, shape (m,). outside: how far the properties lie beyond the table, in cells of
            it [1]; 0 within.
    """

    values: Array
    outside: Array


def monotone_inverse(nodes: np.ndarray, values: Array, target: Array) -> Found:
    """Place at which a monotone table takes a value, linear between nodes, the end where it lies beyond.

    Args:
        nodes: increasing, shape (a,). values: at the nodes, strictly rising or falling, shape (a, ...).
        target: the value, shape (...).

    Returns:
        `values` of shape (...), and `outside`, the way beyond the table in lengths of its outermost interval.
    """
    shares = [(target - values[i]) / (values[i + 1] - values[i]) for i in range(len(nodes) - 1)]
    steps = [(nodes[i + 1] - nodes[i]) * np.clip(share, 0.0, 1.0) for i, share in enumerate(shares)]
    outside = np.maximum(np.maximum(-shares[0], shares[-1] - 1.0), 0.0)
    return Found(nodes[0] + sum(steps), outside)


def interpolated(nodes: np.ndarray, values: Array, place: Array) -> Array:
    """Table at a place, linear between equidistant nodes, the end value beyond them.

    Args:
        nodes: increasing at equal distances, shape (a,). values: numbers or arrays, one a node. place: a number, or an
            array that broadcasts with the values.

    Returns:
        Of the shape of one value times a weight.
    """
    inside = np.clip(place, nodes[0], nodes[-1])
    weights = [np.maximum(1.0 - np.abs(inside - node) / (nodes[1] - nodes[0]), 0.0) for node in nodes]
    return sum(weights[i] * values[i] for i in range(len(nodes)))


def curve_distances(curves: Sequence[Array], point: Array) -> Array:
    """Distances of a point from polygonal lines.

    Args:
        curves: abscissas and ordinates of the corners of c curves, shape (c, s) each. point: shape (2,).

    Returns:
        Shape (c,).
    """
    count, corners = curves[0].shape
    flat = [np.reshape(values, (count * corners,)) for values in curves]
    return np.hstack(enclosed(_all_distances(corners), *flat, point))


@lru_cache
def _all_distances(corners: int) -> Callable[..., tuple[Array, ...]]:
    """Distances of a point from all curves of so many corners, a loop; the same function for the same number."""

    def distances(abscissas: Array, ordinates: Array, point: Array) -> tuple[Array, ...]:
        starts = range(0, abscissas.shape[0], corners)
        rows = [(abscissas[i : i + corners], ordinates[i : i + corners]) for i in starts]
        return tuple(found[0] for found in scan(_distance, (), rows, (point,))[1])

    return distances


def _distance(_carry: Any, curve: Any, shared: Any) -> Any:
    """Distance of a point from one polygonal line."""
    along = [values[1:] - values[:-1] for values in curve]
    to = [shared[0][i] - curve[i][:-1] for i in range(2)]
    return (), (np.stack([np.sqrt(np.min(_nearest(along, to)[0]))]),)


def _nearest(along: Sequence[Array], to: Sequence[Array]) -> tuple[Array, Array]:
    """Squared distance of a point from a segment, and where on it the nearest point is, from 0 to 1.

    Args:
        along: from the begin of the segment to its end. to: from its begin to the point.
    """
    share = (to[0] * along[0] + to[1] * along[1]) / (along[0] * along[0] + along[1] * along[1] + _TINY)
    share = np.clip(share, 0.0, 1.0)
    return (to[0] - share * along[0]) ** 2 + (to[1] - share * along[1]) ** 2, share


def place_on_curve(nodes: np.ndarray, curve: Array, point: Array) -> Array:
    """Label of the point of a polygonal line that is nearest to a point, linear between corners.

    Args:
        nodes: labels of the corners, shape (s,). curve: shape (2, s). point: shape (2,).
    """
    best: tuple[Array, ...] | None = None
    for i in range(len(nodes) - 1):
        along, to = [curve[k, i + 1] - curve[k, i] for k in range(2)], [point[k] - curve[k, i] for k in range(2)]
        square, share = _nearest(along, to)
        found = (square, nodes[i] + share * (nodes[i + 1] - nodes[i]))
        best = (
            found if best is None else tuple(np.where(square < best[0], a, b) for a, b in zip(found, best, strict=True))
        )
    assert best is not None
    return best[1]


def soft_inverse(labels: np.ndarray, curves: Sequence[Array], point: Array, sharpness: Array) -> Array:
    """Mean of labels of curves, weighted by nearness: Omar 2012, (4.6.5) with the distance that (4.6.6) means.

    (4.6.6) prints the smallest distance over the curves; it is that over the points of a curve. Weights are
    ``exp(-mu Delta_j)``, of which a common factor is left out so that they do not all vanish.

    Args:
        labels: quantity that is constant on each curve, shape (c,). curves: see `curve_distances`.
        point: shape (2,). sharpness: mu [1], of distances on axes scaled to [0, 1].
    """
    distance = curve_distances(curves, point)
    weights = np.exp(-sharpness * (distance - np.min(distance)))
    return np.sum(weights * labels) / np.sum(weights)


def network_inverse(
    first: np.ndarray, second: np.ndarray, network: Sequence[Array], point: Array, extrapolated: float = 0.0
) -> Found:
    """Place in a network of quadrilaterals, the curvilinear look-up: Omar 2012, sections 4.6.1 and 4.7.

    In each cell the bilinear map is inverted by two Newton steps from its centre; the cell whose place lies least
    beyond it is taken, and the place is brought back into it.

    Args:
        first: nodes of the first quantity, shape (a,). second: of the second, shape (b,).
        network: both properties at the nodes, shape (a, b) each. point: properties found, shape (2,).
        extrapolated: how far the place may lie beyond its cell, in cells [1].

    Returns:
        `values` of shape (2,), and `outside`.
    """
    cells = []
    for i in range(len(first) - 1):
        for j in range(len(second) - 1):
            corners = ((i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1))
            place = np.array([first[i], first[i + 1] - first[i], second[j], second[j + 1] - second[j]])
            cells.append((np.stack([values[c] for c in corners for values in network]), place))

    def nearer(carry: Any, cell: Any, shared: Any) -> Any:
        found = _in_cell(cell[0], cell[1], shared[0], extrapolated)
        return (np.where(found[0] < carry[0][0], found, carry[0]),), ()

    begin = np.array([np.inf, first[0], second[0]])
    best = scan(nearer, (begin,), cells, (point,))[0][0]
    return Found(np.stack([best[1], best[2]]), best[0])


def _in_cell(corners: Array, cell: Array, point: Array, extrapolated: float) -> Array:
    """How far a place lies beyond a cell, and the place brought into it, shape (3,).

    `corners`: properties at the four corners, both of each, shape (8,). `cell`: beginning and width in both quantities.
    """
    corner, next_first, next_second, opposite = (corners[2 * k : 2 * k + 2] for k in range(4))
    right, up, twist = next_first - corner, next_second - corner, opposite - next_first - next_second + corner
    s, t = 0.5, 0.5
    for _ in range(2):
        error = point - (corner + s * right + t * up + s * t * twist)
        by_s, by_t = right + t * twist, up + s * twist
        area = by_s[0] * by_t[1] - by_s[1] * by_t[0]
        area = np.where(np.abs(area) > _TINY, area, _TINY)
        s = s + (error[0] * by_t[1] - error[1] * by_t[0]) / area
        t = t + (by_s[0] * error[1] - by_s[1] * error[0]) / area
    beyond = np.maximum(np.maximum(np.abs(s - 0.5), np.abs(t - 0.5)) - 0.5, 0.0)
    low, high = -extrapolated, 1.0 + extrapolated
    return np.stack([beyond, cell[0] + cell[1] * np.clip(s, low, high), cell[2] + cell[3] * np.clip(t, low, high)])


def weighted_inverse(
    places: np.ndarray, properties: Sequence[Array], point: Sequence[Array], sharpness: Array
) -> Array:
    """Mean of known quantities, weighted by the nearness of their properties: the weights of Omar 2012, (4.6.5), on the
    nodes themselves [ours].

    Each property is scaled by its range over the nodes, so that ``mu`` has the meaning it has in `soft_inverse`. Under
    noise a mean draws towards the middle of the nodes, which costs a bias and takes away more of the variance.

    Args:
        places: quantities at k nodes, shape (k, m). properties: of the nodes, shape (k, ...) each. point: properties
            found, shape (...) each. sharpness: mu [1].

    Returns:
        The quantities, shape (m, ...).
    """
    square = sum(
        ((values - read) / (np.max(values, axis=0) - np.min(values, axis=0))) ** 2
        for values, read in zip(properties, point, strict=True)
    )
    distance = np.sqrt(square)
    weights = np.exp(-sharpness * (distance - np.min(distance, axis=0)))
    return (places.T @ weights) / np.sum(weights, axis=0)


def polynomial_refinement(nodes: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Matrix that makes of values at some nodes those of the polynomial through them at other places, shape (f, a).

    Args:
        nodes: shape (a,). fine: the other places, shape (f,).
    """
    others = [np.delete(nodes, i) for i in range(len(nodes))]
    columns = [np.prod((fine[:, None] - others[i]) / (node - others[i]), axis=1) for i, node in enumerate(nodes)]
    return np.stack(columns, axis=1)


def nearest_two(distances: Sequence[Array], labels: np.ndarray) -> Array:
    """Mean of the labels with the two smallest distances, each weighted by the distance of the other: Omar 2012,
    (4.6.14) and (4.6.15).

    Args:
        distances: not negative, one a label. labels: shape (c,).
    """
    first, second = (distances[0], labels[0] + 0.0 * distances[0]), (distances[0] + np.inf, labels[0] + 0.0)
    for distance, label in zip(distances[1:], labels[1:], strict=True):
        leads, follows = distance < first[0], distance < second[0]
        second = tuple(
            np.where(leads, a, np.where(follows, c, b))
            for a, b, c in zip(first, second, (distance, label), strict=True)
        )
        first = tuple(np.where(leads, c, a) for a, c in zip(first, (distance, label), strict=True))
    total = first[0] + second[0] + _TINY
    return (second[0] * first[1] + first[0] * second[1]) / total


def corrected_inverse(
    look_up: Callable[[Array], Found],
    forward: Callable[[Array], Array],
    target: Array,
    times: int,
    low: Array = -np.inf,
    high: Array = np.inf,
) -> Found:
    """A look-up that is corrected by what it makes of its own result [ours]: ``z <- z + L(r) - L(T(z))``.

    A table with few nodes is only nearly the inverse of the map. Its error at the place that it found is nearly its
    error at the place that is sought, so that it cancels; each time gains about as many digits as the table has.

    Args:
        look_up: L, from properties to quantities. forward: T, from quantities to properties, by the model.
        target: r, the properties measured. times: how often. low, high: bounds of the quantities, shape (m,).
    """
    first = look_up(target)
    values = first.values
    for _ in range(times):
        values = np.clip(values + first.values - look_up(forward(values)).values, low, high)
    return Found(values, first.outside)


def best_candidate(candidates: np.ndarray, residuals: Array) -> Found:
    """Candidate with the smallest sum of squares, the search over z2 of Omar 2012, (4.3.3); between candidates the
    residuals are taken as linear [ours].

    Args:
        candidates: increasing, shape (c,). residuals: measured minus what each candidate gives, shape (m, c).

    Returns:
        The quantity [of `candidates`], and `outside`: 1 where the smallest sum stands at either end, so that the
        candidates do not bracket it, else 0.
    """
    best: tuple[Array, ...] | None = None
    last = len(candidates) - 2
    for i in range(last + 1):
        along = residuals[:, i + 1] - residuals[:, i]
        share = -np.sum(residuals[:, i] * along) / (np.sum(along * along) + _TINY)
        share = np.clip(share, 0.0, 1.0)
        cost = np.sum((residuals[:, i] + share * along) ** 2)
        at_end = 0.0 * share
        at_end = np.where(share <= 0.0, 1.0, at_end) if i == 0 else at_end
        at_end = np.where(share >= 1.0, 1.0, at_end) if i == last else at_end
        found = (cost, candidates[i] + share * (candidates[i + 1] - candidates[i]), at_end)
        if best is None:
            best = found
        else:
            lower = cost < best[0]
            best = tuple(np.where(lower, a, b) for a, b in zip(found, best, strict=True))
    assert best is not None
    return Found(best[1], best[2])


def require_monotone(name: str, nodes: np.ndarray, values: np.ndarray, where: str = "") -> None:
    """Refuse a table that cannot be inverted.

    Args:
        name: of the quantity. nodes: its values, shape (a,). values: property at the nodes, shape (a, ...).
        where: what the other quantities are, for the message.

    Raises:
        ValueError: the property does not rise or fall throughout; the message names quantity and range.
    """
    steps = np.diff(np.asarray(values, dtype=float), axis=0)
    turning = np.argwhere(~((steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)))
    if len(turning):
        column = steps[(slice(None), *turning[0])]
        i = int(np.argmax(np.sign(column) != np.sign(column[np.argmax(np.abs(column))])))
        raise ValueError(
            f"signature table: the property does not show {name} between {nodes[i]:g} and {nodes[i + 1]:g}"
            f"{' ' + where if where else ''}: it turns there, expected one that rises or falls throughout "
            f"{nodes[0]:g} to {nodes[-1]:g}. Narrow the range, or take another property, scaling or order."
        )

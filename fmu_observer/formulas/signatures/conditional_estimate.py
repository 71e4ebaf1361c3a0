"""Values between classes: along a curve through the centres of clouds, and a second quantity under the condition of the
first. NumPy on recordings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from fmu_observer.formulas.signatures.classification import Drawn, PencilSpace, Plane, drawn_planes

_PLACES = 400
"""Places at which a curve is compared with a point."""
_CLOSE = 1e-9
"""Centres nearer than this, in units of the ranges, count as this far apart."""


class _Located(NamedTuple):
    """Where points lie along a curve of classes.

    Attributes:
        value: interpolated between the two classes around, shape (n,). distance: of the point from the curve, in units
            of the ranges, shape (n,).
    """

    value: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True)
class _ClassCurve:
    """Smooth curve through the centres of clouds, each the cloud of one value: Omar 2012, section 3.5, (3.5.5).

    Args:
        plane: of the clouds. values: of the classes, rising, shape (c,). places: points of the curve, shape (2, k).
            place_values: value at each of them, shape (k,). reach: largest distance of an experiment of the training
            from the curve.
    """

    plane: Plane
    values: np.ndarray
    places: np.ndarray
    place_values: np.ndarray
    reach: float

    def locate(self, records: np.ndarray) -> _Located:
        """Value of each experiment: that of the nearest place, with the weights of (3.4.10).

        Args:
            records: samples first, shape (K, n).
        """
        return self.nearest(self.plane.points(records))

    def nearest(self, points: np.ndarray) -> _Located:
        """Value at the nearest place of the curve.

        Args:
            points: in the plane, shape (2, n).
        """
        away = np.hypot(*(points[:, :, None] - self.places[:, None, :]))
        place = np.argmin(away, axis=1)
        return _Located(self.place_values[place], away[np.arange(len(place)), place])


def _train_curve(records: np.ndarray, values: Sequence[float], space: PencilSpace) -> tuple[_ClassCurve, float]:
    """Curve of classes in the drawn plane in which it gives the experiments of the training back best [ours: the plane
    with the widest strips may have the classes out of order, and values between them are then lost].

    Args:
        records: samples first, shape (K, n). values: of the quantity, one a record; equal ones are a class.
        space: what is drawn.

    Returns:
        The curve, and the narrowest strip between two clouds in its plane, as a share of the range across it, negative
        where they overlap.

    Raises:
        ValueError: there are fewer than two classes, or not one value a record.
    """
    quantity = np.asarray(values, dtype=float)
    curves = [(_curve(drawn, quantity), drawn) for drawn in drawn_planes(records, list(values), space)]
    off = [np.sqrt(np.mean((curve.nearest(drawn.points).value - quantity) ** 2)) for curve, drawn in curves]
    best, drawn = curves[int(np.argmin(off))]
    return best, drawn.margin


def _curve(drawn: Drawn, values: np.ndarray) -> _ClassCurve:
    """Spline through the centres of the clouds in a plane, parametrised by the way along their broken line."""
    classes = np.unique(values)
    clouds = [drawn.points[:, values == value] for value in classes]
    centres = np.stack([0.5 * (cloud.min(axis=1) + cloud.max(axis=1)) for cloud in clouds], axis=1)
    steps = np.maximum(np.hypot(*np.diff(centres, axis=1)), _CLOSE)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    fine = np.linspace(0.0, along[-1], _PLACES)
    smooth = scipy.interpolate.make_interp_spline(along, centres, k=min(3, len(classes) - 1), axis=1)
    curve = _ClassCurve(drawn.plane, classes, smooth(fine), np.interp(fine, along, classes), 0.0)
    return replace(curve, reach=float(curve.nearest(drawn.points).distance.max()))


class Estimated(NamedTuple):
    """Both quantities of experiments.

    Attributes:
        first: shape (n,). second: under the condition of the first, shape (n,). covered: whether each point lies as
            near to its curves as those of the training do, shape (n,).
    """

    first: np.ndarray
    second: np.ndarray
    covered: np.ndarray


@dataclass(frozen=True)
class _ConditionalEstimator:
    """First one quantity, then a second one under its condition: Omar 2012, section 3.5.

    Args:
        first: curve of the first quantity. second: for each of its classes the curve of the second one there, or the
            only value that it has there.
    """

    first: _ClassCurve
    second: Mapping[float, _ClassCurve | float]

    def estimate(self, records: np.ndarray, reach: float = 1.0) -> Estimated:
        """Both quantities; the second is blended linearly between the classes of the first, (3.5.7).

        Args:
            records: samples first, shape (K, n). reach: how far from its curve a point may lie to be covered, as a
                multiple of the farthest experiment of the training.
        """
        found = self.first.locate(records)
        near = found.distance <= reach * self.first.reach
        classes = np.array(sorted(self.second))
        each, covered = zip(*(self._second(value, records, reach) for value in classes), strict=True)
        at = np.clip(np.searchsorted(classes, found.value, side="right") - 1, 0, len(classes) - 2)
        share = (found.value - classes[at]) / (classes[at + 1] - classes[at])
        n = np.arange(len(found.value))
        second = (1.0 - share) * np.stack(each)[at, n] + share * np.stack(each)[at + 1, n]
        held = np.where(share < 0.5, np.stack(covered)[at, n], np.stack(covered)[at + 1, n])
        return Estimated(found.value, second, near & held)

    def _second(self, value: float, records: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        curve = self.second[value]
        if not isinstance(curve, _ClassCurve):
            count = np.asarray(records).shape[1]
            return np.full(count, curve), np.ones(count, dtype=bool)
        located = curve.locate(records)
        return located.value, located.distance <= reach * curve.reach


def train_conditional(
    records: np.ndarray, first: Sequence[float], second: Sequence[float], space: PencilSpace
) -> tuple[_ConditionalEstimator, dict[str, float]]:
    """Curves of both stages from experiments at known places.

    Args:
        records: samples first, shape (K, n). first: first quantity, one a record. second: second quantity.
            space: what is drawn, for every stage.

    Returns:
        The estimator, and the narrowest strip of each stage by its name.

    Raises:
        ValueError: the first quantity has fewer than two classes, or there is not one value a record.
    """
    records, other = np.asarray(records, dtype=float), np.asarray(second, dtype=float)
    curve, margin = _train_curve(records, first, space)
    margins, stages = {"first": margin}, dict[float, _ClassCurve | float]()
    for value in curve.values:
        here = np.asarray(first) == value
        if len(np.unique(other[here])) < 2:
            stages[float(value)] = float(other[here][0])
            continue
        stages[float(value)], margins[f"second at {value:g}"] = _train_curve(records[:, here], list(other[here]), space)
    return _ConditionalEstimator(curve, stages), margins

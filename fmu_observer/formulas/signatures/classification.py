"""Classification by signatures: a random search for coordinates in which clouds stand apart, and the decisions that
follow. NumPy on recordings.

The thesis calls the search DiagSign and prints neither the margin nor the number of draws; both are arguments here.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.signatures.clouds import Coordinate, Separation, extent, separation
from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.pencil import EPS, NextScaling
from fmu_observer.formulas.signatures.properties import PROPERTIES

_UNDECIDED = -1


@dataclass(frozen=True)
class PencilSpace:
    """Coordinates among which is drawn.

    Args:
        orders: N, past samples a point. quantities: keys of `PROPERTIES`. eps: regularisations in the unit of the
            samples. scalings: of the next sample.
        margin: d_min, least width of the strip between clouds, as a share of their range across it.
        draws: pairs of coordinates that are drawn. seed: of the draws.
    """

    orders: Sequence[int]
    quantities: Sequence[str] = tuple(name for name in PROPERTIES if not name.startswith(("branch", "length")))
    eps: Sequence[float] = (EPS,)
    scalings: Sequence[NextScaling] = ("norm", "literal")
    margin: float = 0.05
    draws: int = 300
    seed: int = 0

    def coordinates(self) -> list[Coordinate]:
        """All coordinates of the space."""
        return [
            Coordinate(order, quantity, eps, scaling)
            for order in self.orders
            for eps in self.eps
            for scaling in self.scalings
            for quantity in self.quantities
        ]


@dataclass(frozen=True)
class Plane:
    """Two coordinates, each scaled to the range of the experiments that it was made with: Omar 2012, section 3.4.4.

    Args:
        coordinates: of abscissa and ordinate. low: smallest values, shape (2,). size: ranges, shape (2,).
    """

    coordinates: tuple[Coordinate, Coordinate]
    low: np.ndarray
    size: np.ndarray

    def points(self, records: np.ndarray) -> np.ndarray:
        """Points of experiments, (r1, r2) in units of the ranges.

        Args:
            records: samples first, shape (K, ...).

        Returns:
            Shape (2, ...).
        """
        values = np.stack([c.of(records) for c in self.coordinates])
        behind = (2, *[1] * (values.ndim - 1))
        return np.asarray((values - self.low.reshape(behind)) / self.size.reshape(behind))


@dataclass(frozen=True)
class SearchStage:
    """One decision: is it this class, or one of those left?

    Args:
        label: of the class that is distinguished. plane: in which. rivals: what holds it apart from each class left.
        margin: width of the narrowest strip, as a share of the range across it.
    """

    label: Hashable
    plane: Plane
    rivals: Mapping[Hashable, Separation]
    margin: float


@dataclass(frozen=True)
class _Classified:
    """Verdicts on experiments.

    Args:
        index: of the label in `SignatureClassifier.labels`, -1 where a point lies in the strip between two clouds,
            shape (n,). score: distance to the decision line that was nearest, in units of the ranges, shape (n,).
    """

    index: np.ndarray
    score: np.ndarray


@dataclass(frozen=True)
class SignatureClassifier:
    """Decisions one after another, each on a plane of its own: Omar 2012, section 3.4.5.

    Args:
        stages: in their order. last: label of what no stage has distinguished. labels: all.
    """

    stages: tuple[SearchStage, ...]
    last: Hashable
    labels: tuple[Hashable, ...] = field(default=())

    def classify(self, records: np.ndarray, strip: float = 1.0) -> _Classified:
        """Classes of experiments.

        Args:
            records: samples first, shape (K, n). strip: share of the strips between clouds in which nothing is decided,
                0 for a verdict everywhere.
        """
        count = np.asarray(records).shape[1]
        index, open_ = np.full(count, _UNDECIDED), np.ones(count, dtype=bool)
        nearest = np.full(count, np.inf)
        for stage in self.stages:
            points = stage.plane.points(records)
            beyond = np.stack([r.normal @ points - r.threshold for r in stage.rivals.values()])
            half = np.array([[0.5 * strip * max(r.gap, 0.0)] for r in stage.rivals.values()])
            inside, outside = (beyond > half).all(axis=0), (beyond <= -half).any(axis=0)
            nearest = np.where(open_, np.minimum(nearest, np.abs(beyond).min(axis=0)), nearest)
            index = np.where(open_ & inside, self.labels.index(stage.label), index)
            open_ &= outside
        return _Classified(np.where(open_, self.labels.index(self.last), index), nearest)


class SeparationError(ValueError):
    """No pair of coordinates that was drawn holds a class apart from all others by the margin."""


def train_classifier(
    records: np.ndarray, labels: Sequence[Hashable], space: PencilSpace, *, overlap: bool = False
) -> SignatureClassifier:
    """Decisions that distinguish classes, by random search: Omar 2012, section 3.4.5.

    Pairs of coordinates are drawn. In the pair with the widest strip around one class, all classes that it holds apart
    by the margin are distinguished, and the search goes on with the rest.

    Args:
        records: of all experiments, samples first, shape (K, n). labels: class of each, n of them. space: what is
            drawn. overlap: take the best pair also where its strip is narrower than the margin, or clouds overlap.

    Raises:
        ValueError: there are fewer than two classes, or not one label a record.
        SeparationError: no pair holds a class apart and `overlap` is False; it names the classes and the best margin.
    """
    records, groups = np.asarray(records, dtype=float), _groups(records, labels)
    values = _table(records, space)
    drawn = {pair: _strips(pair, values, groups) for pair in _draws(values, space)}
    left, stages = set(groups), list[SearchStage]()
    while len(left) > 1:
        found = {pair: _isolated(strips, left) for pair, strips in drawn.items()}
        best = max(found, key=lambda pair: max(found[pair].values()))
        ranked = sorted(found[best], key=lambda label: -found[best][label])
        if found[best][ranked[0]] < space.margin and not overlap:
            raise _not_separable(space, left, found[best][ranked[0]])
        for label in ranked[: len(left) - 1]:
            rivals = {rival: s for rival, s in drawn[best][label].items() if rival in left}
            margin = min(s.margin for s in rivals.values())
            if label == ranked[0] or margin >= space.margin:
                stages.append(SearchStage(label, _plane(best, values), rivals, margin))
                left.remove(label)
    return SignatureClassifier(tuple(stages), next(iter(left)), tuple(groups))


def _not_separable(space: PencilSpace, left: Iterable[Hashable], widest: float) -> SeparationError:
    return SeparationError(
        f"no pair of {space.draws} draws holds one of the classes {_listed(left)} apart from the others by "
        f"{space.margin:g} of the range; the best strip is {widest:.3g}. Draw more, offer other orders or properties, "
        f"ask for a smaller margin, or accept overlap=True."
    )


class Drawn(NamedTuple):
    """A pair of coordinates that was drawn.

    Attributes:
        plane: of the pair. points: of the experiments in it, shape (2, n). margin: of the narrowest strip between two
            classes, as a share of the range across it, negative where they overlap.
    """

    plane: Plane
    points: np.ndarray
    margin: float


def drawn_planes(records: np.ndarray, labels: Sequence[Hashable], space: PencilSpace) -> list[Drawn]:
    """All pairs of a search with the experiments in them, for those who choose by something else than the margin.

    Args:
        records: of all experiments, samples first, shape (K, n). labels: class of each. space: what is drawn.

    Raises:
        ValueError: there are fewer than two classes, or not one label a record.
    """
    records = np.asarray(records, dtype=float)
    groups, values = _groups(records, labels), _table(records, space)
    found = list[Drawn]()
    for pair in _draws(values, space):
        margin = min(_isolated(_strips(pair, values, groups), set(groups)).values())
        found.append(Drawn(_plane(pair, values), np.stack([_scaled(c, values) for c in pair]), margin))
    return found


def _groups(records: np.ndarray, labels: Sequence[Hashable]) -> dict[Hashable, np.ndarray]:
    """Numbers of the experiments of each class, in the order in which classes appear."""
    count = np.asarray(records).shape[-1]
    if len(labels) != count:
        raise ValueError(f"{count} records and {len(labels)} labels; give each record its class.")
    groups = {label: np.flatnonzero([other == label for other in labels]) for label in dict.fromkeys(labels)}
    if len(groups) < 2:
        raise ValueError(f"a classifier needs two classes at least, the labels name {_listed(groups)}.")
    return groups


def _table(records: np.ndarray, space: PencilSpace) -> dict[Coordinate, np.ndarray]:
    """Values of all coordinates; each signature is computed once. Those without a range or not finite are left out."""
    table: dict[Coordinate, np.ndarray] = {}
    for order in space.orders:
        for eps in space.eps:
            for scaling in space.scalings:
                signature = dynamic_signature(records, order, eps, scaling)
                for quantity in space.quantities:
                    table[Coordinate(order, quantity, eps, scaling)] = PROPERTIES[quantity](signature)
    usable = {c: v for c, v in table.items() if np.all(np.isfinite(v)) and np.ptp(v) > 0.0}
    if len(usable) < 2:
        raise ValueError("fewer than two properties differ between the records; offer other orders or properties.")
    return usable


def _draws(values: Mapping[Coordinate, np.ndarray], space: PencilSpace) -> list[tuple[Coordinate, Coordinate]]:
    """Pairs without repetition in a pair, from the seed."""
    names, generator = list(values), np.random.default_rng(space.seed)
    pairs = (generator.choice(len(names), 2, replace=False) for _ in range(space.draws))
    return [(names[i], names[j]) for i, j in pairs]


def _scaled(coordinate: Coordinate, values: Mapping[Coordinate, np.ndarray]) -> np.ndarray:
    found = values[coordinate]
    return np.asarray((found - found.min()) / np.ptp(found))


def _plane(pair: tuple[Coordinate, Coordinate], values: Mapping[Coordinate, np.ndarray]) -> Plane:
    found = np.stack([values[c] for c in pair])
    return Plane(pair, found.min(axis=1), np.ptp(found, axis=1))


def _strips(
    pair: tuple[Coordinate, Coordinate], values: Mapping[Coordinate, np.ndarray], groups: Mapping[Hashable, np.ndarray]
) -> dict[Hashable, dict[Hashable, Separation]]:
    """Of each class what holds it apart from each other."""
    points = np.stack([_scaled(c, values) for c in pair])
    extents = {label: extent(points[:, members]) for label, members in groups.items()}
    strips: dict[Hashable, dict[Hashable, Separation]] = {label: {} for label in groups}
    labels = list(groups)
    for i, first in enumerate(labels):
        for second in labels[i + 1 :]:
            found = separation(extents[first], extents[second])
            strips[first][second], strips[second][first] = found, found.turned()
    return strips


def _isolated(strips: Mapping[Hashable, Mapping[Hashable, Separation]], left: set[Hashable]) -> dict[Hashable, float]:
    """Of each class left the narrowest strip to another one left."""
    return {
        label: min(s.margin for rival, s in strips[label].items() if rival in left) for label in strips if label in left
    }


def _listed(labels: Iterable[Hashable]) -> str:
    return ", ".join(sorted(map(str, labels))) or "none"

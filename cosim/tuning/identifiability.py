"""Which directions of the parameters a run shows: singular values of what its cost depends on. Runs nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_observer.design.optimisers.search_space import SearchSpace

STEP = 0.1  # relative, of a parameter that is not zero; of its range, of one that may be
NOTHING = 1e-6  # of the largest change: such a parameter changes nothing
WEAK = 0.02  # of the largest singular value: such a direction hardly shows; a start P(0) that fades leaves up to 1 %
COVARIANCE = "variance"  # `process_covariance`, `measurement_variance`


@dataclass(frozen=True)
class Directions:
    """What moves what the cost depends on, at one candidate.

    Args:
        names: of the parameters, d of them. sizes: how much each moves it, relative to the most, shape (d,).
        singular_values: relative to the largest, falling, shape (d,). directions: of them, rows in relative changes of
            the parameters, shape (d, d).
        scale: how much a common factor of all covariances moves it, relative to the largest singular value;
            NaN where not all of process and measurement noise is tuned.
    """

    names: Sequence[str]
    sizes: np.ndarray
    singular_values: np.ndarray
    directions: np.ndarray
    scale: float

    @property
    def idle(self) -> list[str]:
        """Parameters that change nothing."""
        return [name for name, size in zip(self.names, self.sizes, strict=True) if not size > NOTHING]

    @property
    def scale_invariant(self) -> bool:
        """Whether a common factor of all covariances changes next to nothing."""
        return bool(self.scale < WEAK)

    def warnings(self) -> list[str]:
        """What the user should know, in words."""
        texts = [
            f"{name} changes nothing that the cost of this run depends on: it cannot be tuned by it."
            for name in self.idle
        ]
        if self.scale_invariant:
            texts.append(
                "A common factor of all covariances changes next to nothing "
                f"({self.scale:.2g} of the strongest direction): only their ratios can be tuned."
            )
        for value, direction in zip(self.singular_values, self.directions, strict=True):
            parts = [(n, w) for n, w in zip(self.names, direction, strict=True) if abs(w) > 0.2 and n not in self.idle]
            if value < WEAK and len(parts) > 1 and not (self.scale_invariant and _all_alike(parts)):
                text = ", ".join(f"{name} {weight:+.2f}" for name, weight in parts)
                texts.append(f"Hardly visible together ({value:.2g} of the strongest direction): {text}.")
        return texts


def neighbours(space: SearchSpace, values: Mapping[str, float]) -> list[dict[str, float]]:
    """The candidate, then one with each parameter moved, then, of covariances, one with all of them scaled.

    Args:
        space: of the search. values: the candidate, by name.
    """
    moved = [dict(values)]
    for p in space.parameters:
        step = STEP * values[p.name] if p.log or values[p.name] != 0.0 else STEP * (p.high - p.low)
        moved.append({**values, p.name: values[p.name] + step})
    scaled = covariances(space)
    return [*moved, {n: v * (1.0 + STEP) if n in scaled else v for n, v in values.items()}] if scaled else moved


def covariances(space: SearchSpace) -> list[str]:
    """The entries of covariances among the parameters, where they are of more than one matrix.

    Args:
        space: of the search.
    """
    found = [name for name in space.names if COVARIANCE in name]
    return found if len({name.partition("[")[0] for name in found}) > 1 else []


def directions(space: SearchSpace, effects: Sequence[np.ndarray | None]) -> Directions | None:
    """What moves what the cost depends on.

    Args:
        space: of the search. effects: what it is with the candidates of `neighbours`, each of one shape.

    Returns:
        None where one of them has none, or nothing moves at all.
    """
    first = effects[0]
    if first is None or any(e is None or e.shape != first.shape or not np.isfinite(e).all() for e in effects):
        return None
    if not first.size:
        return None
    moves = np.stack([e - first for e in effects[1:] if e is not None])
    count = len(space.parameters)
    _, values, rows = np.linalg.svd(moves[:count].T, full_matrices=False)
    sizes = np.linalg.norm(moves[:count], axis=1)
    if not values[0] > 0.0:
        return Directions(space.names, sizes, values, rows, np.nan)
    scaled = np.linalg.norm(moves[count]) / np.sqrt(len(covariances(space))) if len(moves) > count else np.nan
    return Directions(space.names, sizes / sizes.max(), values / values[0], rows, float(scaled / values[0]))


def _all_alike(parts: Sequence[tuple[str, float]]) -> bool:
    """Whether a direction is the common factor."""
    return len({weight > 0.0 for _, weight in parts}) == 1

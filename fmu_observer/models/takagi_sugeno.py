"""The Takagi-Sugeno model: linear vertices blended by premises, with continuous and sampled measurements. A value.

It knows signals and arrays; it does not move by itself and holds no gain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

import numpy as np

from fmu_observer.models.checks import check_identifiers, check_numbers, check_signals, checked_matrix
from fmu_observer.models.observer_model import NamedStates, stacked
from plant_models.hybrid import Array, Signal, vector

PremiseFunction = Callable[[Array, Array], Array]  # (x of shape (n,), u of shape (m,)) -> a number


@dataclass(frozen=True, eq=False)
class Premise:
    """One premise: a scalar function of state and inputs with the bounds between which the model is exact.

    Args:
        name: identifier. unit: its unit. low, high: bounds [unit]; beyond them the nearer bound is used.
        of: plain NumPy that can be traced, (x of shape (n,), u of shape (m,)) to a number. A premise that is measured
            reads only states that the measurements give.
        description: one line.

    Raises:
        ValueError: the bounds are not finite or not in order, or the name is no identifier.
    """

    name: str
    unit: str
    low: float
    high: float
    of: PremiseFunction
    description: str = ""

    def __post_init__(self) -> None:
        check_identifiers("Premise", name=self.name)
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise ValueError(
                f"Premise {self.name!r}: bounds [{self.low}, {self.high}] must be finite, the lower one first."
            )

    def share(self, value: Array) -> Array:
        """Membership of the upper bound, ``(f - low) / (high - low)`` limited to [0, 1]; the lower bound has the
        rest.

        Args:
            value: of the premise.
        """
        return np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0)

    def outside(self, value: Array) -> Array:
        """1 where the value [unit] lies outside the bounds, by more than rounding, else 0."""
        slack = 1e-9 * (self.high - self.low)
        return np.where(np.abs(value - np.clip(value, self.low, self.high)) > slack, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class TakagiSugenoModel(NamedStates):
    """``dx = sum_i h_i (A_i x + B_i u) + G w``, ``y1(t_k) = C1 x`` at samples, ``y2 = C2 x + D v`` always.

    Bouchama 2024, (2.1)-(2.5). Vertex i is the corner where premise j is at its upper bound if bit j of i is set, so
    the first premise changes fastest; h_i is the product of the memberships, and the h_i add up to one.

    Args:
        name, description, source, states, inputs: see `NamedStates`.
        sampled: scalar signals by `input_signal` y1 that arrive at `event`; an observer calls them ``<event>_<name>``.
        continuous: scalar signals by `input_signal` y2 that are there always; an observer calls them
        ``measured_<name>``.
        premises: p of them. A: shape (2**p, n, n). B: shape (2**p, n, m).
        C_sampled: C1, shape (q1, n). C_continuous: C2, shape (q2, n).
        D: how the noise v enters y2, shape (q2, nv); None for the identity.
        G: how the disturbance w enters, shape (n, nw); None for none.
        event: name of the event at which y1 arrives. max_gap: longest gap between samples it is meant for [s].
        scaling: positive numbers T, one a state, for design and certificates: ``T x`` is of order one; () for ones.

    Raises:
        ValueError: a shape does not fit the signals or the number of premises, a number is not finite, a name is no
        identifier or
            stands twice, or nothing is measured; the message names it.
    """

    sampled: tuple[Signal, ...]
    continuous: tuple[Signal, ...]
    premises: tuple[Premise, ...]
    A: np.ndarray
    B: np.ndarray
    C_sampled: np.ndarray
    C_continuous: np.ndarray
    D: np.ndarray | None = None
    G: np.ndarray | None = None
    event: str = "sample"
    max_gap: float = 0.1
    scaling: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        where = f"Takagi-Sugeno model {self.name!r}"
        check_identifiers(where, name=self.name, event=self.event)
        check_signals(where, states=self.states, inputs=self.inputs, measurements=self.measurements)
        check_numbers(where, {"max_gap": self.max_gap})
        n, m, q1, q2, N = self.order, len(self.inputs), len(self.sampled), len(self.continuous), 2 ** len(self.premises)
        if self.D is None:
            object.__setattr__(self, "D", np.eye(q2))
        if self.G is None:
            object.__setattr__(self, "G", np.zeros((n, 0)))
        noises, disturbances = (np.shape(matrix)[-1] if np.ndim(matrix) else 0 for matrix in (self.D, self.G))  # type: ignore[arg-type]
        if not self.scaling:
            object.__setattr__(self, "scaling", (1.0,) * n)
        if len(self.scaling) != n or not all(isfinite(T) and T > 0.0 for T in self.scaling):
            raise ValueError(f"{where}: scaling {self.scaling} must be {n} positive numbers, one a state.")
        counts = f"{n} states, {m} inputs, {q1} sampled and {q2} continuous measurements"
        reason = f"{counts} and {len(self.premises)} premises"
        shapes = {"A": (N, n, n), "B": (N, n, m), "C_sampled": (q1, n), "C_continuous": (q2, n)}
        for name, shape in (shapes | {"D": (q2, noises), "G": (n, disturbances)}).items():
            object.__setattr__(self, name, checked_matrix(where, name, getattr(self, name), shape, reason))

    @property
    def vertices(self) -> int:
        """Number of vertices, N."""
        return len(self.A)

    @property
    def C(self) -> np.ndarray:
        """Both kinds of measurements, sampled ones first, shape (q1 + q2, n)."""
        return np.vstack([self.C_sampled, self.C_continuous])

    @property
    def measurements(self) -> tuple[Signal, ...]:
        """Both kinds, sampled ones first."""
        return (*self.sampled, *self.continuous)

    def corner(self, vertex: int) -> np.ndarray:
        """Values of the premises at a vertex, shape (p,)."""
        return np.array([p.high if vertex >> j & 1 else p.low for j, p in enumerate(self.premises)])

    def premise_values(self, x: Array, u: Array) -> tuple[Array, ...]:
        """``f_j(x, u)``, p numbers."""
        return tuple(p.of(x, u) for p in self.premises)

    def weights(self, values: tuple[Array, ...]) -> tuple[Array, ...]:
        """Weights h_i, N numbers in [0, 1] that add up to one, from the values of the premises."""
        shares = [p.share(value) for p, value in zip(self.premises, values, strict=True)]
        weights = []
        for vertex in range(self.vertices):
            weight: Array = 1.0
            for j, share in enumerate(shares):
                weight = weight * (share if vertex >> j & 1 else 1.0 - share)
            weights.append(weight)
        return tuple(weights)

    def outside(self, values: tuple[Array, ...]) -> Array:
        """1 where some premise is outside its bounds, else 0.

        Args:
            values: of the premises.
        """
        flags = [p.outside(value) for p, value in zip(self.premises, values, strict=True)]
        worst: Array = 0.0
        for flag in flags:
            worst = np.maximum(worst, flag)
        return worst

    def blend(self, weights: tuple[Array, ...], x: Array, u: Array) -> Array:
        """``sum_i h_i (A_i x + B_i u)``, shape (n,).

        Args:
            weights: of the vertices, sum 1.
        """
        total = 0.0 * x
        for weight, A, B in zip(weights, self.A, self.B, strict=True):
            linear = A @ x
            total = total + weight * (linear + B @ u if len(self.inputs) else linear)
        return total

    def flow(self, x: Array, u: Array) -> Array:
        """The model itself, premises from x, without disturbance, shape (n,)."""
        return self.blend(self.weights(self.premise_values(x, u)), x, u)

    def informed(self, x: Array, sampled: Array | None = None, continuous: Array | None = None) -> Array:
        """The state nearest to an estimate that agrees with measurements: what premises are read from.

        Args:
            x: estimate, shape (n,). sampled: y1 of shape (q1,), or None to keep what the estimate says. continuous: y2,
                likewise.

        Returns:
            ``x + C^+ (y - C x)``, shape (n,); where rows of C pick states, these are replaced.
        """
        rows, values = [], []
        for C, y in ((self.C_sampled, sampled), (self.C_continuous, continuous)):
            if y is not None and len(C):
                rows.append(C)
                values += [y[i] for i in range(len(C))]
        if not rows:
            return x
        C = np.vstack(rows)
        error = stacked(tuple(values)) if np.ndim(values[0]) == 0 else vector(*values)
        return x + np.linalg.pinv(C) @ (error - C @ x)

    @cached_property
    def unmeasured(self) -> tuple[str, ...]:
        """Names of premises that read more than the measurements give, found by trying."""
        generator = np.random.default_rng(0)
        hidden = np.eye(self.order) - np.linalg.pinv(self.C) @ self.C
        found = []
        for p in self.premises:
            tried = [(generator.normal(size=self.order), generator.normal(size=len(self.inputs))) for _ in range(8)]
            moved = [abs(p.of(x, u) - p.of(x + hidden @ generator.normal(size=self.order), u)) for x, u in tried]
            if max(moved) > 1e-9:
                found.append(p.name)
        return tuple(found)

"""The observer model: ``dx = A x + B u + phi(x, u) + H d``, ``y = C x``, with names and units of its signals. A value.

It knows signals and arrays; it does not move by itself and holds no gain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from fmu_observer.models.checks import check_identifiers, check_numbers, check_signals, checked_matrix
from plant_models.hybrid import Array, Signal, vector
from plant_models.hybrid.exact_jacobian import exact_jacobian
from plant_models.hybrid.signal import state


@dataclass(frozen=True, eq=False)
class NamedStates:
    """A model of n scalar states and m scalar inputs.

    Args:
        name: identifier. description: one line. source: where the equations come from.
        states: n scalar signals by `state`, named by the quantity (``angle``); their starts are the observer's starts.
        inputs: m scalar signals by `input_signal`, the known inputs u.
    """

    name: str
    description: str
    source: str
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]

    @property
    def order(self) -> int:
        """Number of states, n."""
        return len(self.states)

    @property
    def start(self) -> np.ndarray:
        """Start of the estimates, shape (n,)."""
        return np.array([float(s.start_values[0]) for s in self.states])

    @property
    def start_inputs(self) -> np.ndarray:
        """Inputs at their starts, shape (m,)."""
        return np.array([float(s.start_values[0]) for s in self.inputs])


_PROBES = 5  # states at which a phi of unknown slope is examined


def zero_states(signals: Iterable[Signal]) -> tuple[Signal, ...]:
    """States that start at zero, called as signals of the plant.

    Args:
        signals: scalar ones, such as outputs that show the plant's states.
    """
    return tuple(state(s.name, s.unit, 0.0, s.description) for s in signals)


Remainder = Callable[[Array, Array], Array]  # (x of shape (n,), u of shape (m,)) -> shape (n,)


@dataclass(frozen=True, eq=False)
class ObserverModel(NamedStates):
    """What an observer believes of its plant.

    Args:
        name, description, source, states, inputs: see `NamedStates`.
        measurements: scalar signals by `input_signal` named by the quantity; measured continuously an observer calls
        them
            ``measured_angle``, at an event ``<event>_angle``.
        A: shape (n, n). B: shape (n, m). C: shape (q, n).
        phi: nonlinear remainder, plain NumPy that can be traced; None for a linear model.
        lipschitz: Lipschitz constant of `phi` in x over the range the model is used in [1/s]. Where none is given it is
            the largest norm of the slopes; without these inf, unless `phi` does not depend on x.
        slopes: matrices of shape (n, n) whose convex hull holds the Jacobian of `phi` over that range. Certificates of
            a nonlinear model need them.
        event: name of the event at which a sampled measurement arrives.
        sample_period: sampling period [s] that observers assume unless set otherwise.
        unknown_inputs: scalar signals by `input_signal`, the inputs d that nobody measures; unknown-input observers
            know what to do with them, the others leave them out.
        H: how the unknown inputs act, shape (n, nd).

    Raises:
        ValueError: a shape does not fit the signals, a number is not finite, a name is no identifier or stands twice,
        or nothing
            is measured; the message names it.
    """

    measurements: tuple[Signal, ...]
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    phi: Remainder | None = None
    lipschitz: float = 0.0
    slopes: tuple[np.ndarray, ...] = field(default=())
    event: str = "sample"
    sample_period: float = 0.1
    unknown_inputs: tuple[Signal, ...] = ()
    H: np.ndarray | None = None

    def __post_init__(self) -> None:
        where = f"Observer model {self.name!r}"
        check_identifiers(where, name=self.name, event=self.event)
        groups = {"states": self.states, "inputs": self.inputs, "measurements": self.measurements}
        check_signals(where, **groups, unknown_inputs=self.unknown_inputs)
        check_numbers(where, {"sample_period": self.sample_period}, {"lipschitz": self.lipschitz})
        n, m, q = self.order, len(self.inputs), len(self.measurements)
        reason = f"{n} states, {m} inputs and {q} measurements"
        for name, shape in {"A": (n, n), "B": (n, m), "C": (q, n)}.items():
            object.__setattr__(self, name, checked_matrix(where, name, getattr(self, name), shape, reason))
        if self.unknown_inputs or np.size(self.H if self.H is not None else ()):
            reason_H = f"{n} states and {len(self.unknown_inputs)} unknown inputs"
            H = checked_matrix(where, "H", self.H, (n, len(self.unknown_inputs)), reason_H)
        else:
            H = np.zeros((n, 0))
        object.__setattr__(self, "H", H)
        slopes = tuple(checked_matrix(where, "a slope", slope, (n, n), reason) for slope in self.slopes)
        object.__setattr__(self, "slopes", slopes)
        self._check_remainder(where)
        if self.phi is not None and self.lipschitz == 0.0:
            object.__setattr__(self, "lipschitz", self._lipschitz())

    def _check_remainder(self, where: str) -> None:
        """phi is tried at the starts: a wrong shape would be broadcast in silence."""
        if self.phi is None:
            return
        try:
            found = np.shape(self.phi(self.start, self.start_inputs))
        except Exception as error:
            raise ValueError(f"{where}: phi(x, u) fails at the start values: {error}") from error
        if found != (self.order,):
            raise ValueError(
                f"{where}: phi(x, u) returns shape {found}, expected {(self.order,)}, one value a state, as of "
                f"vector(...)."
            )

    def remainder(self, x: Array, u: Array) -> Array:
        """``phi(x, u)``, shape (n,); zero for a linear model."""
        return 0.0 * x if self.phi is None else self.phi(x, u)

    def flow(self, x: Array, u: Array) -> Array:
        """``A x + B u + phi(x, u)``, shape (n,)."""
        linear = self.A @ x
        driven = linear + self.B @ u if len(self.inputs) else linear
        return driven + self.remainder(x, u)

    def measured(self, x: Array) -> Array:
        """``C x``, shape (q,)."""
        return self.C @ x

    @cached_property
    def jacobian(self) -> Callable[[Array, Array], Array]:
        """Exact Jacobian of `flow` by x, a function of (x, u) that returns shape (n, n); works on traced symbols
        too.
        """
        return exact_jacobian(self.flow, self.order, len(self.inputs))

    @property
    def drifts(self) -> tuple[np.ndarray, ...]:
        """``A + slope`` for every slope: vertices of the Jacobian of the flow, each of shape (n, n).

        Raises:
            ValueError: phi depends on x and no slopes are given.
        """
        if self.phi is not None and self.lipschitz > 0.0 and not self.slopes:
            raise ValueError(
                f"Observer model {self.name!r}: nothing can be certified without the slopes of its nonlinear part phi; "
                f"give "
                "`slopes`, matrices whose convex hull holds the Jacobian of phi over the range of use."
            )
        return tuple(self.A + slope for slope in self.slopes) or (self.A,)

    def _lipschitz(self) -> float:
        """What the slopes say; without slopes 0 if the Jacobian of phi vanishes at a few states, else inf, for
        unknown.
        """
        if self.slopes:
            return max(float(np.linalg.norm(slope, 2)) for slope in self.slopes)
        at, u = np.random.default_rng(0).normal(size=(_PROBES, self.order)), np.ones(len(self.inputs))
        rounding = 1e-12 * max(1.0, float(np.abs(self.A).max()))
        try:
            found = [np.abs(np.asarray(self.jacobian(x, u)) - self.A).max() for x in at]
        except Exception:  # phi worked at the starts, so what fails is the tracing
            return inf
        return 0.0 if all(size <= rounding for size in found) else inf


def shift_matrix(length: int, width: int = 1) -> np.ndarray:
    """Block upper shift matrix of a chain of `length` blocks of `width` states, shape (length * width, length *
    width).
    """
    return np.kron(np.diag(np.ones(length - 1), 1), np.eye(width))


def stacked(values: tuple[Array, ...]) -> Array:
    """Scalars as a vector; an empty tuple gives shape (0,).

    Args:
        values: numbers or arrays of shape (members,).
    """
    return vector(*values) if values else np.zeros(0)


def stacked_of(values: Any, signals: Sequence[Signal], prefix: str = "") -> Array:
    """Values by name as a vector, in the order of the signals, vectors element by element, shape (k,).

    Args:
        values: named tuple, of states, inputs or parameters. signals: which ones. prefix: before each name.
    """
    return stacked(tuple(v for s in signals for v in s.entries(getattr(values, f"{prefix}{s.name}"))))


def named_as(signals: Sequence[Signal], values: Iterable[Array], prefix: str = "") -> dict[str, Array]:
    """The way back: values by the names of scalar signals.

    Args:
        signals: k of them. values: shape (k,), or a list. prefix: before each name.
    """
    return {f"{prefix}{s.name}": value for s, value in zip(signals, values, strict=True)}

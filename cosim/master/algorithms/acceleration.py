"""Acceleration: the next guess for the values on an interface, from the guesses so far and what came back for them.

Wanted is ``z = G(z)``. One call of G is one sweep over the components of a loop. All methods see the same scaled
residual; none knows what a component is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from cosim.restorable import Restorable

LONGEST = 1e4
"""No guess moves further than so many times the largest residual. Without a bound a loop that has no solution is
followed to values so large that the residual is a small share of them, which looks like convergence."""

Jacobian = Callable[[], np.ndarray | None]


class Acceleration(Restorable, ABC):
    """Makes the next guess. `begin` starts a new search; what was learnt in earlier ones may be kept.

    Args:
        size: length n of the interface.
    """

    name: ClassVar[str]

    def __init__(self, size: int) -> None:
        self.size = size
        self._scale = np.ones(size)

    def begin(self, scale: np.ndarray) -> None:
        """Start a search.

        Args:
            scale: magnitude of each value, positive, shape (n,).
        """
        self._scale = scale

    @abstractmethod
    def next(self, z: np.ndarray, g: np.ndarray) -> np.ndarray:
        """The guess after `z`, for which `g` came back, each of shape (n,)."""


class _FixedPoint(Acceleration):
    """``z + w (g - z)`` with a constant `w`; with ``w = 1`` the plain exchange.

    Args:
        size: length n of the interface. relaxation: w.
    """

    name = "fixed-point"

    def __init__(self, size: int, relaxation: float = 1.0) -> None:
        super().__init__(size)
        self.relaxation = relaxation

    def next(self, z: np.ndarray, g: np.ndarray) -> np.ndarray:
        following: np.ndarray = z + self.relaxation * (g - z)
        return following


class _Aitken(Acceleration):
    """``z + w (g - z)`` with `w` from the last two residuals; exact for a linear loop of one value, whatever its gain.

    Args:
        size: length n of the interface. relaxation: the first w of each search.

    Source: U. Kuettler, W. A. Wall, Fixed-point fluid-structure interaction solvers with dynamic relaxation,
    Computational Mechanics 43 (2008) 61-72, equation (44); the residuals are scaled here, since values of different
    units meet in them.
    """

    name = "aitken"

    def __init__(self, size: int, relaxation: float = 1.0) -> None:
        super().__init__(size)
        self._first = self._factor = relaxation
        self._residual: np.ndarray | None = None

    def begin(self, scale: np.ndarray) -> None:
        super().begin(scale)
        self._factor, self._residual = self._first, None

    def next(self, z: np.ndarray, g: np.ndarray) -> np.ndarray:
        residual = (g - z) / self._scale
        if self._residual is not None:
            change = residual - self._residual
            length = float(change @ change)
            if length > 0.0:
                factor = -self._factor * float(self._residual @ change) / length
                self._factor = min(max(factor, -LONGEST), LONGEST)
        self._residual = residual
        following: np.ndarray = z + self._factor * (g - z)
        return following


class Newton(Acceleration):
    """Solves ``(D + E - 1) dz = z - g``; D is the part of G' that is known, E what the sweeps have shown besides.

    D comes from directional derivatives: it is what passes through the components at once. E starts at zero and takes
    Broyden's (good) update with every sweep, so that also the part of G' is found that passes through states, and all
    of it where nothing is known. E is kept from search to search.

    Args:
        size: length n of the interface.
        jacobian: gives D where the last sweep ended, shape (n, n), or None where it is not to be had.

    Source: C. G. Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation
    19 (1965) 577-593, equation (4.5); the split of the Jacobian follows J. E. Dennis, H. F. Walker, SIAM J. Numer.
    Anal. 18 (1981) 949-987.
    """

    name = "newton"

    def __init__(self, size: int, jacobian: Jacobian | None = None) -> None:
        super().__init__(size)
        self._jacobian = jacobian or (lambda: None)
        self._one = np.eye(size)
        self._found = np.zeros((size, size))
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def begin(self, scale: np.ndarray) -> None:  # noqa: D102 - see Acceleration
        super().begin(scale)
        self._last = None

    def next(self, z: np.ndarray, g: np.ndarray) -> np.ndarray:  # noqa: D102 - see Acceleration
        known = self._jacobian()
        slope = self._found if known is None else known + self._found
        if self._last is not None:
            correction = self._secant(slope, z - self._last[0], g - self._last[1])
            self._found = self._found + correction
            slope = slope + correction
        self._last = z.copy(), g.copy()
        return self._solved(slope, z, g)

    def save(self) -> Any:  # noqa: D102 - see Acceleration
        return self._found

    def restore(self, state: Any) -> None:  # noqa: D102 - see Acceleration
        self._found = state

    def _solved(self, slope: np.ndarray, z: np.ndarray, g: np.ndarray) -> np.ndarray:
        scale = self._scale
        residual = (g - z) / scale
        try:
            change = np.linalg.solve(self._one - slope * scale / scale[:, None], residual)
        except np.linalg.LinAlgError:
            return g.copy()  # no direction is better than the plain exchange
        if not np.isfinite(change).all():
            return g.copy()
        longest = LONGEST * float(np.abs(residual).max()) / max(float(np.abs(change).max()), np.finfo(float).tiny)
        following: np.ndarray = z + min(longest, 1.0) * change * scale
        return following

    def _secant(self, slope: np.ndarray, dz: np.ndarray, dg: np.ndarray) -> np.ndarray:
        """The least change of the slope, in scaled values, that makes it fit the last two sweeps."""
        weighted = dz / self._scale**2
        length = float(weighted @ dz)
        if not length > 0.0:
            return np.zeros_like(slope)
        return np.outer(dg - slope @ dz, weighted / length)


def make_acceleration(
    method: str, size: int, relaxation: float = 1.0, jacobian: Jacobian | None = None
) -> Acceleration:
    """An acceleration by name: ``fixed-point``, ``aitken`` or ``newton``.

    Args:
        method: name of the acceleration. size: number of values that are iterated.
        relaxation: share of the change that is taken [1]. jacobian: of one sweep; None where it is not known.
    """
    if method == "newton":
        return Newton(size, jacobian)
    return _Aitken(size, relaxation) if method == "aitken" else _FixedPoint(size, relaxation)


def scaled_norm(z: np.ndarray, g: np.ndarray, relative: float, absolute: float) -> float:
    """Largest ``|g - z| / (absolute + relative * max(|z|, |g|))``: 1 or less is within tolerance; infinite where not a
    number.
    """
    if not (np.isfinite(z).all() and np.isfinite(g).all()):
        return np.inf
    with np.errstate(over="ignore"):
        return float((np.abs(g - z) / (absolute + relative * np.maximum(np.abs(z), np.abs(g)))).max(initial=0.0))

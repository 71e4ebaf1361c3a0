"""Adhesion laws: a nominal and a degraded curve and the blend between them, as a plant's option.

A law brings its own parameters, so that every curve stays adjustable from outside. Knows the two curves and
the signal vocabulary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy

from plant_models.hybrid import Array, Signal, parameter

KMH = 3.6  # km/h in one m/s
CREEP_STIFFNESS = 25.0


@dataclass(frozen=True)
class PolachCurve:
    """Creep curve of Polach in the slip ``s = v_g / v``, odd in ``s``.

    ``f = (2 mu / pi) (K_A eps / (1 + (K_A eps)^2) + atan(K_S eps))`` with ``eps = k s / mu`` and the friction
    coefficient ``mu = mu0 ((1 - A) exp(-B v_g) + A)``, which falls with the sliding speed ``v_g``.

    Units. The thesis names none for ``B`` and gives none of the contact patch's numbers. Its Table 4.5 settles both:
    the table comes out to four digits with ``v_g`` in **km/h** and ``k = G pi a b c_jj / (4 Q) = 25``. With ``v_g`` in
    m/s the same maxima can be had, but at optimal slips three times those of the table (independently measured). So
    ``B`` is in h/km here, and the methods take speeds in m/s and convert.
    The text orders the reductions ``K_A <= K_S``; its Table 3.1, and Polach, have ``K_S <= K_A <= 1``.

    Args:
        ka: reduction in the area of adhesion K_A [1].
        ks: reduction in the area of slip K_S [1].
        mu0: friction coefficient at zero sliding speed [1].
        ratio: friction at infinite sliding speed over that at zero, A [1].
        decay: decay of the friction with the sliding speed, B [h/km].
        stiffness: creep stiffness k [1].

    Source: Bouchama 2024, (3.4)-(3.10) and Table 3.1; after Polach, Wear 258 (2005) 992-1000.
    """

    ka: Array
    ks: Array
    mu0: Array
    ratio: Array
    decay: Array
    stiffness: Array = CREEP_STIFFNESS

    def friction(self, sliding: Array) -> Array:
        """Friction coefficient [1] at the sliding speed [m/s], even in it."""
        return self.mu0 * ((1.0 - self.ratio) * np.exp(-self.decay * KMH * np.abs(sliding)) + self.ratio)

    def coefficient(self, slip: Array, speed: Array) -> Array:
        """Adhesion coefficient [1], odd in the slip.

        Args:
            slip: sliding speed over speed [1].
            speed: speed the slip refers to, positive [m/s]; ``slip * speed`` is the sliding speed.
        """
        mu = self.friction(slip * speed)
        eps = self.stiffness * slip / mu
        return 2.0 * mu / np.pi * (self.ka * eps / (1.0 + (self.ka * eps) ** 2) + np.arctan(self.ks * eps))

    def initial_slope(self) -> Array:
        """Slope at zero slip, ``(2 / pi) k (K_A + K_S)`` [1], the same at every speed."""
        return 2.0 / np.pi * self.stiffness * (self.ka + self.ks)

    def peak(self, speed: float) -> tuple[float, float]:
        """Slip of the first maximum of the coefficient, and the coefficient there [1], at one speed; a search, not
        traceable.

        Not the largest value at any slip: above 60 km/h (dry) or 80 km/h (wet) that is the coefficient of a wheel that
        spins without bound, where the friction has ceased to fall. No controller seeks that, and no slip is near it.

        Args:
            speed: [m/s].

        Raises:
            ValueError: the speed is not positive, or the coefficient falls at no slip up to 10.
        """
        if speed <= 0.0:
            raise ValueError(f"The peak of a Polach curve needs a positive speed, got {speed} m/s.")
        slips = np.geomspace(1e-4, 10.0, 4000)
        falling = np.flatnonzero(np.diff(self.coefficient(slips, speed)) < 0.0)
        if falling.size == 0:
            raise ValueError(
                f"The Polach curve has no peak at {speed:.4g} m/s: its coefficient rises at all slips up to 10."
            )
        bounds = (slips[max(int(falling[0]) - 1, 0)], slips[int(falling[0]) + 1])
        found = scipy.optimize.minimize_scalar(
            lambda s: -self.coefficient(s, speed), bounds=bounds, method="bounded", options={"xatol": 1e-10}
        )
        return float(found.x), float(-found.fun)


POLACH_DRY = PolachCurve(1.0, 0.4, 0.55, 0.4, 0.6)
POLACH_WET = PolachCurve(0.3, 0.1, 0.30, 0.4, 0.2)


@dataclass(frozen=True)
class BurckhardtCurve:
    """``mu(lam) = a1 (1 - exp(-a2 lam)) - a3 lam`` for ``lam >= 0``, odd in ``lam``.

    Two departures from the print. The branch for negative slip is printed with the exponent of the positive one and
    blows up (``mu(-0.1) = +23``); the odd extension ``mu(-lam) = -mu(lam)`` is used. The formula turns negative beyond
    140 to 165 % slip, which would let a spinning wheel brake the train; beyond 100 % slip the coefficient therefore
    stays at ``mu(1)``, the value of a fully sliding wheel.

    Args:
        a1: height of the exponential part [1].
        a2: steepness of the exponential part [1].
        a3: slope of the falling part [1].

    Source: Bouchama 2024, (3.12) and Table 3.2.
    """

    a1: Array
    a2: Array
    a3: Array

    def coefficient(self, slip: Array) -> Array:
        """Adhesion coefficient [1] at slip [1], any shape; odd, and never against the slip."""
        bounded = np.clip(slip, -1.0, 1.0)
        # Two one-sided exponentials: odd, free of overflow, and with the exact derivative a1*a2 - a3 at zero slip,
        # where sign(0) = 0 would hide the stiffness of the wheel from the implicit integrator.
        rise = np.expm1(self.a2 * np.minimum(bounded, 0.0)) - np.expm1(-self.a2 * np.maximum(bounded, 0.0))
        return self.a1 * rise - self.a3 * bounded

    def peak_slip(self) -> Array:
        """Slip of the largest coefficient, ``ln(a1 a2 / a3) / a2`` [1]."""
        return np.log(self.a1 * self.a2 / self.a3) / self.a2

    def peak(self) -> Array:
        """Largest coefficient [1], in closed form ``a1 - (a3 / a2) (1 + ln(a1 a2 / a3))``."""
        return self.a1 - self.a3 / self.a2 * (1.0 + np.log(self.a1 * self.a2 / self.a3))

    def initial_slope(self) -> Array:
        """Slope at zero slip, ``a1 a2 - a3`` [1]."""
        return self.a1 * self.a2 - self.a3


BURCKHARDT_NOMINAL = BurckhardtCurve(0.4287, 40.0, 0.3)
BURCKHARDT_DEGRADED = BurckhardtCurve(0.165, 25.0, 0.1)


CONDITIONS = ("nominal", "degraded")
_BURCKHARDT_TEXTS = {
    "a1": "height of the exponential part",
    "a2": "steepness of the exponential part",
    "a3": "slope of the falling part",
}
_POLACH_TEXTS = {
    "ka": "reduction in the area of adhesion K_A",
    "ks": "reduction in the area of slip K_S",
    "mu0": "friction coefficient at zero sliding speed",
    "ratio": "friction at infinite over zero sliding speed A",
    "decay": "decay of the friction with the sliding speed B",
}


class AdhesionLaw(Protocol):
    """What a plant needs of the wheel-rail contact.

    1. `parameters` are added to the plant's own.
    2. `coefficient` and `limit` are plain NumPy and find their parameters in the plant's ``p``.
    3. `degraded` runs from 0 (nominal) to 1 (degraded); in between, the two curves are mixed linearly.
    """

    parameters: tuple[Signal, ...]

    def coefficient(self, slip: Array, speed: Array, degraded: Array, p: Any) -> Array:
        """Adhesion coefficient [1] at slip [1] and reference speed [m/s]; odd in the slip, never against it."""

    def limit(self, degraded: Array, p: Any) -> Array:
        """Largest coefficient that can hold a wheel without sliding [1]."""


class _BurckhardtLaw:
    """Burckhardt's curves; the coefficient does not depend on the speed. Source: Bouchama 2024, (3.12), Table 3.2."""

    parameters = tuple(
        parameter(
            f"burckhardt_{condition}_{key}", "1", getattr(curve, key), f"Burckhardt, {condition}: {text}", min=1e-9
        )
        for condition, curve in zip(CONDITIONS, (BURCKHARDT_NOMINAL, BURCKHARDT_DEGRADED), strict=True)
        for key, text in _BURCKHARDT_TEXTS.items()
    )

    def coefficient(self, slip: Array, speed: Array, degraded: Array, p: Any) -> Array:
        """Adhesion coefficient [1]; the speed is not used."""
        nominal, low = (self._curve(condition, p).coefficient(slip) for condition in CONDITIONS)
        return nominal + degraded * (low - nominal)

    def limit(self, degraded: Array, p: Any) -> Array:
        """The peak of the curve [1]."""
        nominal, low = (self._curve(condition, p).peak() for condition in CONDITIONS)
        return nominal + degraded * (low - nominal)

    @staticmethod
    def _curve(condition: str, p: Any) -> BurckhardtCurve:
        return BurckhardtCurve(*(getattr(p, f"burckhardt_{condition}_{key}") for key in _BURCKHARDT_TEXTS))


class _PolachLaw:
    """Polach's curves, dry rail as nominal and wet rail as degraded. Source: Bouchama 2024, (3.4)-(3.10), Table 3.1."""

    parameters = (
        *(
            parameter(
                f"polach_{condition}_{key}",
                "h/km" if key == "decay" else "1",
                getattr(curve, key),
                f"Polach, {condition}: {text}",
                min=0.0 if key in ("ratio", "decay") else 1e-9,
                max=1.0 if key in ("ka", "ks", "ratio") else None,
            )
            for condition, curve in zip(CONDITIONS, (POLACH_DRY, POLACH_WET), strict=True)
            for key, text in _POLACH_TEXTS.items()
        ),
        parameter(
            "polach_stiffness", "1", CREEP_STIFFNESS, "Polach: creep stiffness k = G pi a b c_jj / (4 Q)", min=1e-9
        ),
    )

    def coefficient(self, slip: Array, speed: Array, degraded: Array, p: Any) -> Array:
        """Adhesion coefficient [1]."""
        nominal, low = (self._curve(condition, p).coefficient(slip, speed) for condition in CONDITIONS)
        return nominal + degraded * (low - nominal)

    def limit(self, degraded: Array, p: Any) -> Array:
        """The friction coefficient at zero sliding speed [1]."""
        nominal, low = (getattr(p, f"polach_{condition}_mu0") for condition in CONDITIONS)
        return nominal + degraded * (low - nominal)

    @staticmethod
    def _curve(condition: str, p: Any) -> PolachCurve:
        return PolachCurve(
            **{key: getattr(p, f"polach_{condition}_{key}") for key in _POLACH_TEXTS}, stiffness=p.polach_stiffness
        )


ADHESION_LAWS: dict[str, type[_BurckhardtLaw] | type[_PolachLaw]] = {"burckhardt": _BurckhardtLaw, "polach": _PolachLaw}

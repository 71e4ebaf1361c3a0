"""Adhesion laws: a nominal and a degraded curve and the blend between them, as a plant's option.

A law brings its own parameters, so that every curve stays adjustable from outside. Knows the two curves and
the signal vocabulary.
"""

from __future__ import annotations

from typing import Any, Protocol

from plant_models.hybrid import Array, Signal, parameter
from plant_models.railway.adhesion.burckhardt import BURCKHARDT_DEGRADED, BURCKHARDT_NOMINAL, BurckhardtCurve
from plant_models.railway.adhesion.polach import CREEP_STIFFNESS, POLACH_DRY, POLACH_WET, PolachCurve

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

"""Running resistance and gravity, the forces on a train that do not come from its wheels' torque, and Davis
coefficients that were published per unit mass, each with the speeds in which it holds.

Plain NumPy on numbers, batches and traced symbols. The constant part of the Davis formula is not here as a force: it is
dry friction, which the plants declare and the integrator resolves, so that it can stop a train but never push one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from plant_models.hybrid import Array


@dataclass(frozen=True)
class DavisSet:
    """Coefficients of ``w(v) = a + b v + c v^2`` of a train of unit mass.

    Args:
        a: constant part [m/s2]. b: viscous part [1/s]. c: aerodynamic part [1/m]; negative in a fit to a short range.
        fitted_from: lowest speed of the fit [m/s]. fitted_to: highest speed of the fit [m/s].
        origin: where the set stands, and who states its range.
        effort_coefficient: factor b_T = b_B between relative effort and force [1].
        adhesion_level: share of the dry adhesion on the rails on which it was measured [1].
    """

    a: float
    b: float
    c: float
    fitted_from: float
    fitted_to: float
    origin: str
    effort_coefficient: float = 1.0
    adhesion_level: float = 1.0

    def resistance(self, speed: float) -> float:
        """``w(v)`` [m/s2] for a speed [m/s] that is not negative.

        Args:
            speed: of the train [m/s].
        """
        return self.a + self.b * speed + self.c * speed * speed

    @property
    def zero_crossing(self) -> float | None:
        """The speed [m/s] above which the set pulls the train; None where it never does."""
        if self.c >= 0.0:
            return None
        root = (self.b * self.b - 4.0 * self.a * self.c) ** 0.5
        return float((-self.b - root) / (2.0 * self.c))


ADHESION_LEVELS = {"dry": 1.0, "LoA": 0.5, "BaA": 0.3, "EBA": 0.1}
"""Share of the dry adhesion [1] at low (rain), bad (rain and leaves) and extremely bad adhesion. The thesis names the
levels and gives no numbers; these are ours."""
DAVIS_SETS = {
    "set_a": DavisSet(0.01, 0.1, 0.001, 0.0, 50.0, "section 3.2.3, stopping control; range ours", 0.1),
    "set_b": DavisSet(0.02, 0.003, -0.00024, 0.0, 17.0, "section 3.3.4, plant; range ours, up to where it pulls"),
    "set_b_observer": DavisSet(
        0.016, 0.0024, -0.000192, 0.0, 17.0, "section 3.3.4, what the observer believes, 20 % less; range ours"
    ),
    "set_c": DavisSet(0.0852, 0.04, -5e-5, 0.0, 50.0, "section 4.3.4; range ours"),
    "set_d": DavisSet(
        0.46, 5.7e-3, -2.4e-4, 5.0, 50.0, "Table 5.1, low adhesion LoA", adhesion_level=ADHESION_LEVELS["LoA"]
    ),
    "set_e": DavisSet(
        0.35, 3e-3, -1e-4, 5.0, 50.0, "Table 5.1, bad adhesion BaA", adhesion_level=ADHESION_LEVELS["BaA"]
    ),
    "set_f": DavisSet(
        0.25, 5e-3, -2e-4, 5.0, 50.0, "Table 5.1, extremely bad adhesion EBA", adhesion_level=ADHESION_LEVELS["EBA"]
    ),
}
"""Sets by the name of their preset. Source: Aguiar Cota 2019, sections 3.2.3, 3.3.4, 4.3.4 and Table 5.1."""


GRAVITY = 9.81  # [m/s2], the value of Bouchama 2024, ch. 4


def moving_resistance(speed: Array, davis_b: Array, davis_c: Array) -> Array:
    """Speed-dependent part of the Davis resistance, ``b v + c v |v|`` [N], odd in the speed.

    Args:
        speed: [m/s], any shape.
        davis_b: viscous coefficient [N.s/m].
        davis_c: aerodynamic coefficient [N.s2/m2].

    Source: Bouchama 2024, (3.14), which is written for ``v > 0`` only.
    """
    return davis_b * speed + davis_c * speed * np.abs(speed)


def gradient_resistance(mass: Array, gravity: Array, gradient: Array) -> Array:
    """Downhill pull of gravity as a resistance, ``M g i`` [N], positive uphill.

    Args:
        mass: [kg]. gravity: [m/s2].
        gradient: sine of the slope angle [1]; 0.008 is 8 per mille uphill.

    Source: Bouchama 2024, (4.1)-(4.5), ``F_d = M g sin(theta)``.
    """
    return mass * gravity * gradient


@dataclass(frozen=True)
class _DavisCoefficients:
    """Coefficients of ``F = a + b v + c v^2``: `a` [N], `b` [N.s/m], `c` [N.s2/m2]."""

    a: float
    b: float
    c: float


def davis_from_vehicle(
    mass: float,
    axle_mass: float,
    cross_section: float,
    perimeter: float,
    length: float,
    *,
    gamma: float = 1.5,
    k1: float = 9e-4,
    k2: float = 30e-6,
) -> _DavisCoefficients:
    """Davis coefficients from the dimensions of a vehicle.

    ``a = 1e-5 gamma M sqrt(1e4 / m)``, ``b = 3.6e-7 M``, ``c = 0.1296 (k1 S + k2 P L)``. The thesis does not name the
    units of the result: they are kN, kN.s/m and kN.s2/m2 (independently derived); this function returns newtons. The
    same formula for a whole train: M is its mass, m the mass on one axle, S the front area, P L the skin.

    Args:
        mass: mass of the vehicle M [kg].
        axle_mass: mass on one axle m [kg].
        cross_section: frontal area S [m2].
        perimeter: partial perimeter down to the rail P [m]. The 2.857 m tabulated for the BB27000 is its width; it is
            the value that gives the tabulated coefficients.
        length: length of the vehicle L [m].
        gamma: quality of the bearings and the track, 0.9 (modern) to 1.5 (mixed freight) [1].
        k1: front and rear shape, 9e-4 (high-speed) to 20e-4 (conventional) [daN/((km/h)^2 m^2)].
        k2: condition of the surface, 20e-6 (high-speed) to 30e-6 (conventional) [daN/((km/h)^2 m^2)].

    Raises:
        ValueError: a mass or a length is not positive.

    Source: Bouchama 2024, (3.15), and Aguiar Cota 2019, (2.3)-(2.5), which prints N/m2 for k1 and k2 and kilograms for
    tonnes under the root. The defaults are the values that give a, b, c of Table 4.1 of Bouchama 2024 for the BB27000.
    """
    for name, value in {"mass": mass, "axle_mass": axle_mass, "cross_section": cross_section, "length": length}.items():
        if value <= 0.0:
            raise ValueError(f"davis_from_vehicle: {name} must be positive, got {value}.")
    newtons = 1e3
    return _DavisCoefficients(
        a=newtons * 1e-5 * gamma * mass * sqrt(1e4 / axle_mass),
        b=newtons * 3.6e-7 * mass,
        c=newtons * 0.1296 * (k1 * cross_section + k2 * perimeter * length),
    )

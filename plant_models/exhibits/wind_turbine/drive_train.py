"""Drive train of a wind turbine: two inertias and a shaft that twists. Pure formulas; they know only NumPy."""

from __future__ import annotations

from typing import NamedTuple

from plant_models.hybrid import Array


class DriveTrain(NamedTuple):
    """Parameters of the drive train, each a number or of shape (members,).

    Args:
        rotor_inertia: Jr [kg.m2]. generator_inertia: Jg [kg.m2]. gear_ratio: Ng [1].
        shaft_stiffness: Kdt [N.m/rad]. shaft_damping: Bdt [N.m.s/rad].
        rotor_friction: Br [N.m.s/rad]. generator_friction: Bg [N.m.s/rad].
        efficiency: eta [1], lowered by a fault of the drive train.
        printed: 1 for the matrix as the thesis prints it, 0 for the repaired one [1].
    """

    rotor_inertia: Array = 55e6
    generator_inertia: Array = 390.0
    gear_ratio: Array = 95.0
    shaft_stiffness: Array = 2.7e9
    shaft_damping: Array = 775.49
    rotor_friction: Array = 7.11
    generator_friction: Array = 45.6
    efficiency: Array = 0.97
    printed: Array = 0.0

    def matrix(self) -> tuple[tuple[Array, Array, Array], ...]:
        """Rows of the matrix A of ``dx = A x + B (rotor torque, generator torque)``, x = (rotor speed [rad/s],
        generator speed [rad/s], torsion [rad]).

        Printed are ``A11 = -(Bdt - Br) / Jr`` and ``A22 = (eta Bdt - Bg) / (Ng^2 Jg)``, where friction drives. The
        thesis calls the drive train stable; so it is with the repaired entries ``-(Bdt + Br) / Jr`` and ``-(eta Bdt /
        Ng^2 + Bg) / Jg``.

        Returns:
            Three rows of three entries, in units of the states.

        Source: Omar 2012, (7.3.3), (7.3.4).
        """
        ratio, eta, right = self.gear_ratio, self.efficiency, 1.0 - self.printed
        damping, stiffness = self.shaft_damping, self.shaft_stiffness
        squared = ratio * ratio * self.generator_inertia
        rotor = -(damping + (right - self.printed) * self.rotor_friction) / self.rotor_inertia
        repaired = -(eta * damping + self.generator_friction * ratio * ratio) / squared
        printed = (eta * damping - self.generator_friction) / squared
        turned = ratio * self.generator_inertia
        return (
            (rotor, damping / (ratio * self.rotor_inertia), -stiffness / self.rotor_inertia),
            (eta * damping / turned, right * repaired + self.printed * printed, eta * stiffness / turned),
            (1.0, -1.0 / ratio, 0.0),
        )

    def rates(self, x: tuple[Array, Array, Array], rotor_torque: Array, generator_torque: Array) -> tuple[Array, ...]:
        """Derivatives of rotor speed [rad/s2], generator speed [rad/s2] and torsion [rad/s].

        Args:
            x: rotor speed [rad/s], generator speed [rad/s] and torsion [rad].
            rotor_torque, generator_torque: of the wind on the rotor, and of the generator against it [N.m].
        """
        torques = (rotor_torque / self.rotor_inertia, -generator_torque / self.generator_inertia, 0.0)
        rotor, generator, torsion = x
        rows = zip(self.matrix(), torques, strict=True)
        return tuple(row[0] * rotor + row[1] * generator + row[2] * torsion + torque for row, torque in rows)

    def hurwitz(self) -> tuple[Array, Array, Array]:
        """Hurwitz determinants of the characteristic polynomial; the drive train is stable where all are positive.

        Returns:
            ``a1``, ``a1 a2 - a3`` and ``a3`` of ``s^3 + a1 s^2 + a2 s + a3``.
        """
        (a, b, c), (d, e, f), (g, h, i) = self.matrix()
        trace = a + e + i
        minors = a * e - b * d + a * i - c * g + e * i - f * h
        determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
        return -trace, -trace * minors + determinant, -determinant

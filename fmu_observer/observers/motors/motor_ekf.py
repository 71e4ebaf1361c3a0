"""The printed extended Kalman filters of a synchronous motor: currents measured in the rotor frame or in the stator
frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from fmu_observer.observers.motors.motor_filter import MotorFilter, traction_preset
from plant_models.hybrid import Array, matrix, vector
from plant_models.hybrid.option import require_chosen
from plant_models.railway.traction.motor_equations import AXES, FRAMES, Frame, euler_step, rotor_voltages
from plant_models.railway.traction.transforms import to_rotor, to_stator

Load = Literal["known", "estimated"]
NOISE = {"quiet": (1e-4, 1e-2), "very_quiet": (1e-5, 1e-3), "faint": (1e-7, 1e-4), "loud": (1e-3, 0.1)}
"""Variances of currents and speed per sample, and of measured currents [A2], by preset; the angle has a hundredth."""


class MotorEkfStator(MotorFilter):
    """Extended Kalman filter on alpha-beta voltages and currents: what a drive without a position sensor really has.

    Model: `motor_ekf`'s, with ``y = R(theta) (i_d, i_q)`` and voltages turned by the estimated angle, so that both
    depend on the angle, which is then observable while the motor turns (`condition()`: rank 4 of 4; not at standstill).

    Args:
        load: ``known``: an input; ``estimated``: a fifth state that wanders with its own variance. A filter that
            believes in no load while there is one is off by 100 rad/s and more.

    Raises:
        ValueError: `load` is unknown.

    P(0) is that of a rotor whose angle is known to 0.1 rad, since it was aligned before the start.

    Presets: `quiet` (default): variances 1e-4 per sample and 1e-2; `very_quiet`: 1e-5 and 1e-3; `faint`: 1e-7 and 1e-4,
    with which the drive holds 100 rpm under load; `loud`: 1e-3 and 0.1, at which it loses synchronism under load;
    `traction_200kw`. They are those of the motor's presets, but for the angle and the load.

    Source: ours, on the equations of Allaoui 2024, (4.31), (b.4).
    """

    name = "motor_ekf_stator"
    description = "Extended Kalman filter of a synchronous motor, currents in the stator frame, sensorless"
    source = "ours, on the equations of Allaoui 2024, (4.31) and (b.4)"
    default_preset = "quiet"
    option_choices = {"load": ("known", "estimated")}

    def __init__(self, *, load: Load = "known") -> None:
        require_chosen(self.name, self.option_choices, load=load)
        extra = () if load == "known" else (1e-6,)
        heavy = () if load == "known" else (1.0,)
        self.presets: Mapping[str, Mapping[str, Any]] = {
            name: {"process_variance": (w, w, w, 1e-2 * w, *extra), "measurement_variance": (v, v)}
            for name, (w, v) in NOISE.items()
        } | {"traction_200kw": traction_preset((0.01, 0.01, 1e-6, 1e-8, *heavy), 1.0)}
        start = (1.0, 1.0, 1.0, 0.01) if load == "known" else (1.0, 1.0, 1.0, 0.01, 1e-4)
        super().__init__("stator", load == "known", start, load=load)

    def predict(self, estimate: Array, u: Any, p: Any) -> tuple[Array, Array]:
        """Euler step of the motor with its voltages turned by the estimated angle, and its Jacobian."""
        current_d, current_q, speed, angle, *estimated_load = estimate
        voltage_d, voltage_q = to_rotor(u.voltage_alpha, u.voltage_beta, angle)
        (load,) = estimated_load or (u.load_torque,)
        moved = euler_step((current_d, current_q, speed, angle), voltage_d, voltage_q, load, p.sample_period, p)
        rows = _rotor_jacobian(current_d, current_q, speed, p.sample_period, p)
        rows[0][3] = p.sample_period * voltage_q / p.inductance_d
        rows[1][3] = -p.sample_period * voltage_d / p.inductance_q
        if self.known_load:
            return vector(*moved), matrix(*rows)
        wide = [[*row, 0.0] for row in rows]
        wide[2][4] = -p.sample_period / p.inertia
        return vector(*moved, load), matrix(*wide, [0.0, 0.0, 0.0, 0.0, 1.0])

    def measure(self, estimate: Array, u: Any, p: Any) -> tuple[Array, Array]:
        """Measured less predicted currents in the stator frame [A]."""
        current_d, current_q, _, angle, *_ = estimate
        alpha, beta = to_stator(current_d, current_q, angle)
        along_d, along_q = to_stator(1.0, 0.0, angle), to_stator(0.0, 1.0, angle)
        rest = () if self.known_load else (0.0,)
        H = matrix([along_d[0], along_q[0], 0.0, -beta, *rest], [along_d[1], along_q[1], 0.0, alpha, *rest])
        return vector(u.measured_current_alpha - alpha, u.measured_current_beta - beta), H


ROWS: Mapping[str, tuple[float, float, float, float, float, float]] = {
    "hand": (0.01, 0.001, 10.0, 10.0, 0.02, 0.001),
    "pso_5": (0.0105, 0.0042, 0.0484, 0.1165, 0.2145, 0.0750),
    "pso_10": (0.0108, 0.0024, 0.0803, 0.1154, 0.1961, 0.0755),
    "pso_15": (0.0014, 0.0043, 0.0898, 0.0881, 0.2245, 0.1270),
    "pso_20": (0.0022, 0.0035, 0.1675, 0.2367, 0.2937, 0.1569),
    "ga_5": (0.036, 0.112, 0.559, 0.971, 0.884, 0.512),
    "ga_10": (0.014, 0.104, 0.856, 1.047, 0.942, 0.655),
    "ga_15": (0.013, 0.141, 0.863, 1.144, 1.760, 1.601),
    "ga_20": (0.013, 0.014, 0.818, 1.258, 0.650, 0.347),
    "bbo_5": (0.1090, 0.3750, 8.8364, 9.0673, 0.1818, 0.0838),
    "bbo_10": (0.0881, 0.4852, 17.7553, 12.3701, 12.2714, 4.1770),
    "bbo_15": (0.5789, 0.1584, 6.1838, 19.4921, 17.0806, 12.9395),
    "bbo_20": (0.0127, 0.0108, 0.6934, 0.5012, 1.5007, 1.5733),
    "hand_repaired": (0.01, 0.001, 10.0, 10.0, 0.01, 0.001),
    "ga_20_repaired": (0.013, 0.014, 0.818, 1.258, 0.650, 1.347),
    "true_noise": (1e-3, 1e-3, 1e-3, 1e-3, 0.1, 0.1),
}
"""Rows by preset. `hand_repaired` has 0.01 in place of the printed 0.02 of current d, `ga_20_repaired` 1.347 in place
of 0.347 of current q: conjectures, which reproduce the printed errors. `true_noise` holds the variances of the noise.
"""
_MOTOR_PRESETS = {
    row: {"process_variance": values[:4], "measurement_variance": values[4:]} for row, values in ROWS.items()
}


Jacobian = Literal["exact", "as_published"]
MEASURED = np.eye(2, 4)


class MotorEkf(MotorFilter):
    """Extended Kalman filter of a motor whose currents along d and q are measured: speed and angle are estimated.

    Model: ``x(k+1) = x(k) + T_s f(x(k), v(k), C_r(k))``, ``y = (i_d, i_q)``, noise additive and diagonal, P(0) = I. The
    torque of the load must be known.

    **The angle is not observable**: no measured current depends on it, so its estimate is the integral of the estimated
    speed, and its variance grows for ever (`condition()`: rank 3 of 4). A drive that turns its currents by it loses
    synchronism; `motor_ekf_stator` holds. Only the ratios of the variances matter, but for the start.

    Presets: the rows of the printed tables, ``hand``, ``pso_5`` ... ``bbo_20`` (default); ``hand_repaired`` and
    ``ga_20_repaired`` with one entry changed, which give the printed errors; ``true_noise``: the variances of
    the noise.

    Args:
        frame: ``rotor``, as printed; ``stator``: alpha-beta voltages and currents are turned into the rotor frame by
            the filter's own angle, which is the sensorless drive as it is printed.
        jacobian: ``exact``, or ``as_published``: with the misprints of its first two rows.

    Raises:
        ValueError: an option is unknown.
    """

    name = "motor_ekf"
    description = "Extended Kalman filter of a synchronous motor, currents in the rotor frame"
    source = 'Allaoui 2024, "3.39"-"3.45" (4.39-4.45), Tables 1-3'
    presets = {
        **_MOTOR_PRESETS,
        "traction_200kw": traction_preset((0.01, 0.01, 1e-6, 1e-8), 1.0),
    }
    default_preset = "bbo_20"
    option_choices = {"frame": FRAMES, "jacobian": ("exact", "as_published")}

    def __init__(self, *, frame: Frame = "rotor", jacobian: Jacobian = "exact") -> None:
        require_chosen(self.name, self.option_choices, frame=frame, jacobian=jacobian)
        self.jacobian = _printed_jacobian if jacobian == "as_published" else _rotor_jacobian
        super().__init__(frame, True, (1.0, 1.0, 1.0, 1.0), jacobian=jacobian)
        self.options["frame"] = frame

    def predict(self, estimate: Array, u: Any, p: Any) -> tuple[Array, Array]:
        """Euler step of the motor, and its Jacobian in the rotor frame."""
        current_d, current_q, speed, angle = estimate
        voltages = rotor_voltages(self.frame, u, angle)
        moved = euler_step((current_d, current_q, speed, angle), *voltages, u.load_torque, p.sample_period, p)
        return vector(*moved), matrix(*self.jacobian(current_d, current_q, speed, p.sample_period, p))

    def measure(self, estimate: Array, u: Any, p: Any) -> tuple[Array, Array]:
        """Measured less predicted currents in the rotor frame [A]."""
        first, second = (getattr(u, f"measured_current_{axis}") for axis in AXES[self.frame])
        current_d, current_q, _, angle = estimate
        seen_d, seen_q = (first, second) if self.frame == "rotor" else to_rotor(first, second, angle)
        return vector(seen_d - current_d, seen_q - current_q), MEASURED


def _printed_jacobian(current_d: Array, current_q: Array, speed: Array, period: Array, p: Any) -> list[list[Array]]:
    """Rows of F as they are printed: current d in place of q in the first row, plus in place of minus in the second,
    L_d under R_s in the second.

    Source: Allaoui 2024, "3.42" (4.42), as printed.
    """
    rows = _rotor_jacobian(current_d, current_q, speed, period, p)
    share_d, share_q = period / p.inductance_d, period / p.inductance_q
    rows[0][2] = share_d * p.inductance_q * p.pole_pairs * current_d
    rows[1][1] = 1.0 - share_d * p.stator_resistance
    rows[1][2] = share_q * p.pole_pairs * (p.inductance_d * current_d - p.rotor_flux)
    return rows


def _rotor_jacobian(current_d: Array, current_q: Array, speed: Array, period: Array, p: Any) -> list[list[Array]]:
    """Rows of ``F = d x(k+1) / d x(k)`` with voltages given in the rotor frame, 4 by 4.

    Source: Allaoui 2024, "3.42" (4.42), repaired: current q in the first row, minus in the second, L_q under R_s.
    """
    electrical, saliency = p.pole_pairs * speed, p.inductance_d - p.inductance_q
    share_d, share_q = period / p.inductance_d, period / p.inductance_q
    torque, pairs = period * 1.5 * p.pole_pairs / p.inertia, p.pole_pairs
    by_speed = (
        share_d * p.inductance_q * pairs * current_q,
        -share_q * pairs * (p.inductance_d * current_d + p.rotor_flux),
        1.0 - period * p.viscous_friction / p.inertia,
        period * pairs,
    )
    return [
        [1.0 - share_d * p.stator_resistance, share_d * p.inductance_q * electrical, by_speed[0], 0.0],
        [-share_q * p.inductance_d * electrical, 1.0 - share_q * p.stator_resistance, by_speed[1], 0.0],
        [torque * saliency * current_q, torque * (saliency * current_d + p.rotor_flux), by_speed[2], 0.0],
        [0.0, 0.0, by_speed[3], 1.0],
    ]

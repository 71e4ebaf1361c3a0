"""The extended Kalman filter of a synchronous motor whose currents are measured in the stator frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from fmu_observer.observers.motors.motor_filter import MotorFilter, traction_preset
from fmu_observer.observers.motors.motor_jacobians import rotor_jacobian
from plant_models.hybrid import Array, matrix, vector
from plant_models.hybrid.option import require_chosen
from plant_models.railway.traction.motor_equations import euler_step
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
        rows = rotor_jacobian(current_d, current_q, speed, p.sample_period, p)
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

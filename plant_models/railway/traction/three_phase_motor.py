"""The permanent-magnet synchronous motor in its phases: three windings in star, smooth poles."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state
from plant_models.railway.traction.motor_equations import LOAD_TORQUE, MOTOR_PARAMETERS, STATE_OUTPUTS, TORQUE
from plant_models.railway.traction.transforms import park

THIRD = 2.0 * float(np.pi) / 3.0
PHASES = ("a", "b", "c")


class ThreePhaseMotor(HybridSystem):
    """Motor with phase currents as states: ``v = R i + d(L_ss i + phi)/dt``, ``phi_k = phi_sf cos(theta - 2 pi k/3)``.

    The torque follows from the co-energy: ``C_em = p sum i_k dphi_k/dtheta``, in the same angle. Smooth poles:
    ``L_s - M_s = L_d = L_q = cyclic_inductance``. The star point is not connected [ours], so the currents add up to
    zero, two of them are states, and what the phase voltages have in common acts on nothing.

    Under `inverse_park` voltages it is `synchronous_motor` in other coordinates.

    Source: Allaoui 2024, (4.22)-(4.26); the third flux is printed as ``cos(theta + 4 pi/3)``, which is the second one.
    """

    name = "three_phase_motor"
    description = "Permanent-magnet synchronous motor in its three phases"
    source = "Allaoui 2024, (4.22)-(4.26)"
    internal_step = 1e-4
    bounded_parameters = "all"
    states = (
        state("phase_current_a", "A", 0.0, "Current of phase a"),
        state("phase_current_b", "A", 0.0, "Current of phase b"),
        state("shaft_speed", "rad/s", 0.0, "Speed of the shaft"),
        state("electrical_angle", "rad", 0.0, "Electrical angle of the rotor"),
    )
    inputs = (
        *(input_signal(f"voltage_{phase}", "V", 0.0, f"Voltage of phase {phase}") for phase in PHASES),
        LOAD_TORQUE,
    )
    outputs = (
        *(output_signal(f"current_{phase}", "A", f"Current of phase {phase}") for phase in PHASES),
        *STATE_OUTPUTS,
        TORQUE,
    )
    parameters = (
        parameter("cyclic_inductance", "H", 0.0121, "L_s - M_s", min=1e-9),
        *(s for s in MOTOR_PARAMETERS if not s.name.startswith("inductance")),
    )
    presets = {"annex_c": {}}
    default_preset = "annex_c"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        currents = _currents(x)
        slopes = _flux_slopes(x.electrical_angle, p)
        electrical = p.pole_pairs * x.shaft_speed
        driving = [
            voltage - p.stator_resistance * current - electrical * slope
            for voltage, current, slope in zip((u.voltage_a, u.voltage_b, u.voltage_c), currents, slopes, strict=True)
        ]
        star = (driving[0] + driving[1] + driving[2]) / 3.0  # voltage of the star point
        torque = _torque(currents, slopes, p)
        return {
            "phase_current_a": (driving[0] - star) / p.cyclic_inductance,
            "phase_current_b": (driving[1] - star) / p.cyclic_inductance,
            "shaft_speed": (torque - u.load_torque - p.viscous_friction * x.shaft_speed) / p.inertia,
            "electrical_angle": electrical,
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        currents = _currents(x)
        current_d, current_q = park(*currents, x.electrical_angle)
        return {
            **{f"current_{phase}": current for phase, current in zip(PHASES, currents, strict=True)},
            "current_d": current_d,
            "current_q": current_q,
            "speed": x.shaft_speed,
            "angle": x.electrical_angle,
            "torque": _torque(currents, _flux_slopes(x.electrical_angle, p), p),
        }


def _currents(x: Any) -> tuple[Array, Array, Array]:
    return x.phase_current_a, x.phase_current_b, -(x.phase_current_a + x.phase_current_b)


def _flux_slopes(angle: Array, p: Any) -> tuple[Array, Array, Array]:
    """Derivatives of the rotor fluxes of the phases by the electrical angle [Wb]."""
    return (
        -p.rotor_flux * np.sin(angle),
        -p.rotor_flux * np.sin(angle - THIRD),
        -p.rotor_flux * np.sin(angle + THIRD),
    )


def _torque(currents: tuple[Array, Array, Array], slopes: tuple[Array, Array, Array], p: Any) -> Array:
    """Electromagnetic torque [N.m], from the co-energy."""
    work = currents[0] * slopes[0] + currents[1] * slopes[1] + currents[2] * slopes[2]
    return p.pole_pairs * work

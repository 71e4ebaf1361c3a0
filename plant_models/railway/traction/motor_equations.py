"""The permanent-magnet synchronous motor in the rotor frame: parameters, currents, torque, shaft. Pure functions.

Written once for the continuous motor, its Euler form and the filters that have it as their model.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, PeriodicEvent, input_signal, output_signal, parameter, standard_normal
from plant_models.railway.traction.transforms import to_rotor

STATE_NAMES = ("current_d", "current_q", "speed", "angle")
STATE_OUTPUTS = (
    output_signal("current_d", "A", "Current along d"),
    output_signal("current_q", "A", "Current along q"),
    output_signal("speed", "rad/s", "Speed of the shaft", display_unit="rpm"),
    output_signal("angle", "rad", "Electrical angle of the rotor, not wrapped"),
)
TORQUE = output_signal("torque", "N.m", "Electromagnetic torque C_em")
LOAD_TORQUE = input_signal("load_torque", "N.m", 0.0, "Torque of the load against the rotation, C_r")
PUBLISHED_NOISE = {"process_variance": (1e-3, 1e-3, 1e-3, 1e-3), "measurement_variance": (0.1, 0.1)}
"""Variances of one sample as the tables of the thesis demand them: not deviations, not densities."""
NOISE_PARAMETERS = (
    parameter("sample_period", "s", 1e-4, "Time between two samples T_s", min=1e-7),
    parameter(
        "process_variance",
        "1",
        0.0,
        "Variances added per sample to current d, current q, speed, angle, in squares of their units; 0: none",
        min=0.0,
        size=4,
    ),
    parameter(
        "measurement_variance",
        "A2",
        0.0,
        "Variances of both measured currents; 0: exact",
        min=0.0,
        size=2,
    ),
)


Frame = Literal["rotor", "stator"]
FRAMES: tuple[Frame, ...] = ("rotor", "stator")
AXES: Mapping[str, tuple[str, str]] = {"rotor": ("d", "q"), "stator": ("alpha", "beta")}
"""Names of the axes of each frame."""

MOTOR_PARAMETERS = (
    parameter("stator_resistance", "Ohm", 3.4, "Resistance of a phase R_s", min=0.0),
    parameter("inductance_d", "H", 0.0121, "Inductance along d, L_d", min=1e-9),
    parameter("inductance_q", "H", 0.0121, "Inductance along q, L_q", min=1e-9),
    parameter("rotor_flux", "Wb", 0.013, "Flux of the magnets phi_sf, amplitude", min=1e-9),
    parameter("pole_pairs", "1", 2.0, "Pairs of poles p", min=1.0),
    parameter("inertia", "kg.m2", 5.9e-6, "Inertia of the shaft J", min=1e-12),
    parameter("viscous_friction", "N.m.s/rad", 1e-4, "Viscous friction of the shaft f", min=0.0),
)
"""Defaults: the 100 W, 28 V motor of Annex C."""

TRACTION_200_KW: Mapping[str, float] = {
    "stator_resistance": 0.03,
    "inductance_d": 1.5e-3,
    "inductance_q": 1.5e-3,
    "rotor_flux": 0.85,
    "pole_pairs": 4.0,
    "inertia": 3.0,
    "viscous_friction": 0.02,
}
"""A motor of about 200 kW at 1500 rpm with 1500 V direct voltage; all numbers are ours."""


def rotor_voltages(frame: str, u: Any, angle: Array) -> tuple[Array, Array]:
    """Voltages of the inputs along d and q [V].

    Args:
        frame: of the inputs, ``rotor`` or ``stator``. u: inputs with ``voltage_<axis>`` [V].
        angle: electrical angle of the rotor [rad].

    Returns:
        Voltage along d and along q [V].
    """
    first, second = (getattr(u, f"voltage_{axis}") for axis in AXES[frame])
    return (first, second) if frame == "rotor" else to_rotor(first, second, angle)


def electromagnetic_torque(current_d: Array, current_q: Array, p: Any) -> Array:
    """Torque of the motor ``C_em = 3/2 p ((L_d - L_q) i_d i_q + phi i_q)`` [N.m].

    Args:
        current_d: along d [A]. current_q: along q [A]. p: parameters, with the names of `MOTOR_PARAMETERS`.

    Returns:
        Torque [N.m].

    Source: Allaoui 2024, (4.29).
    """
    saliency = p.inductance_d - p.inductance_q
    return 1.5 * p.pole_pairs * (saliency * current_d + p.rotor_flux) * current_q


def motor_rates(
    state: tuple[Array, Array, Array, Array], voltage_d: Array, voltage_q: Array, load_torque: Array, p: Any
) -> tuple[Array, Array, Array, Array]:
    """Derivatives of currents, speed and angle.

    Args:
        state: currents along d and q [A], speed of the shaft [rad/s], electrical angle [rad].
        voltage_d: along d [V]. voltage_q: along q [V]. load_torque: against the rotation [N.m].
        p: parameters, with the names of `MOTOR_PARAMETERS`.

    Returns:
        Derivatives [A/s, A/s, rad/s2, rad/s].

    Source: Allaoui 2024, (4.31); with the sign and the pole pairs of (4.27) and (4.31), not those of "3.40".
    """
    current_d, current_q, speed, _ = state
    electrical = p.pole_pairs * speed
    flux_d, flux_q = p.inductance_d * current_d + p.rotor_flux, p.inductance_q * current_q
    torque = electromagnetic_torque(current_d, current_q, p)
    return (
        (voltage_d - p.stator_resistance * current_d + electrical * flux_q) / p.inductance_d,
        (voltage_q - p.stator_resistance * current_q - electrical * flux_d) / p.inductance_q,
        (torque - load_torque - p.viscous_friction * speed) / p.inertia,
        electrical,
    )


def euler_step(
    state: tuple[Array, Array, Array, Array],
    voltage_d: Array,
    voltage_q: Array,
    load_torque: Array,
    period: Array,
    p: Any,
) -> tuple[Array, Array, Array, Array]:
    """Currents, speed and angle one period later, by the explicit Euler rule.

    Args:
        state: currents along d and q [A], speed of the shaft [rad/s], electrical angle [rad].
        voltage_d: along d [V]. voltage_q: along q [V]. load_torque: against the rotation [N.m].
        period: T_s [s]. p: parameters, with the names of `MOTOR_PARAMETERS`.

    Returns:
        The state one period later, in the same units.

    Source: Allaoui 2024, "3.40" (4.40); its fourth row is printed without the pole pairs of (4.31).
    """
    rates = motor_rates(state, voltage_d, voltage_q, load_torque, p)
    first, second, third, fourth = (value + period * rate for value, rate in zip(state, rates, strict=True))
    return first, second, third, fourth


def sampling_event(name: str) -> PeriodicEvent:
    """The event at which a motor is sampled, with the standard normal numbers of one sample.

    Args:
        name: of the event.

    Returns:
        The event, of period `sample_period`.
    """
    process = tuple(
        standard_normal(f"{state}_noise", f"Standard normal number of the {state}") for state in STATE_NAMES
    )
    measurement = tuple(standard_normal(f"measurement_noise_{i}", f"Standard normal number, axis {i}") for i in (1, 2))
    return PeriodicEvent(name, "sample_period", None, (*process, *measurement), "The motor is sampled")


def process_noise(u: Any, p: Any) -> tuple[Array, Array, Array, Array]:
    """What one sample adds to the state, in the units of the state.

    Args:
        u: inputs with the noises of `sampling_event`. p: parameters with `process_variance`.

    Returns:
        Added to the current along d [A] and q [A], the speed [rad/s] and the angle [rad].
    """
    numbers = (u.current_d_noise, u.current_q_noise, u.speed_noise, u.angle_noise)
    first, second, third, fourth = (np.sqrt(p.process_variance[i]) * number for i, number in enumerate(numbers))
    return first, second, third, fourth

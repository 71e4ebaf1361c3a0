"""Field-oriented control of a synchronous motor: PI of the speed, PI of both currents, decoupling, limits."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter
from plant_models.railway.traction.motor_equations import AXES, FRAMES, MOTOR_PARAMETERS, TRACTION_200_KW, Frame
from plant_models.railway.traction.transforms import to_rotor, to_stator

Reference = Literal["speed", "torque"]


class FieldOrientedControl(HybridSystem):
    """Control with ``i_d* = 0``: a PI of the speed asks for ``i_q*``, PIs of both currents for voltages.

    At each `control_period`, with ``e = w* - w``: ``i_q* = kp e + I`` within `current_limit`;
    ``v_d = kc (0 - i_d) + I_d - p w L_q i_q``, ``v_q = kc (i_q* - i_q) + I_q + p w (L_d i_d + phi)``, the vector
    shortened to `voltage_limit`. What a limit cuts off is taken back from the integral. Gains follow from two
    bandwidths: ``kc = wc L``, ``ki = wc R`` (pole and zero cancel), ``kp = ws J / K_t``, ``ki = kp ws / 5``.

    Speed and angle come from sensors, or from an observer: then the drive is sensorless. The voltages are put out in
    both frames; those of the stator frame by the angle of the control instant.

    Args:
        frame: of the measured currents: ``rotor`` (d, q), or ``stator`` (alpha, beta), turned by the angle.
        reference: what is asked for: the ``speed``; or the ``torque``, where somebody else controls the speed.

    Raises:
        ValueError: an option is unknown.

    Source: Allaoui 2024, section IV.2.3.8 and Fig. 4.15; no gains, limits and references are printed, all are ours.
    """

    name = "field_oriented_control"
    description = "Field-oriented control of a synchronous motor, speed and currents"
    source = "Allaoui 2024, section IV.2.3.8, Fig. 4.15; gains and limits are ours"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    states = (
        memory("speed_integral", "A", 0.0, "Integral of the speed control"),
        *(memory(f"integral_{axis}", "V", 0.0, f"Integral of the current control along {axis}") for axis in "dq"),
        *(memory(f"held_voltage_{axis}", "V", 0.0, f"Voltage of this period along {axis}") for axis in "dq"),
        memory("held_angle", "rad", 0.0, "Electrical angle at the control instant"),
        memory("held_reference", "A", 0.0, "Current asked for along q"),
    )
    outputs = (
        *(discrete_output(f"voltage_{axis}", "V", f"Voltage along {axis}") for axis in ("d", "q", "alpha", "beta")),
        discrete_output("current_reference", "A", "Current asked for along q"),
    )
    parameters = (
        parameter("control_period", "s", 1e-4, "Control period", min=1e-7),
        parameter("current_bandwidth", "rad/s", 2.0 * float(np.pi) * 300.0, "Bandwidth wc of the currents", min=1e-3),
        parameter("speed_bandwidth", "rad/s", 2.0 * float(np.pi) * 60.0, "Bandwidth ws of the speed", min=1e-6),
        parameter("current_limit", "A", 8.0, "Largest current along q", min=0.0),
        parameter("voltage_limit", "V", 28.0 / float(np.sqrt(3.0)), "Longest voltage vector", min=1e-9),
        *(s for s in MOTOR_PARAMETERS if s.name != "viscous_friction"),
    )
    events = (PeriodicEvent("control", "control_period", description="Speed and current control"),)
    presets = {
        "drive_100w": {},
        "traction_200kw": {
            **{name: value for name, value in TRACTION_200_KW.items() if name != "viscous_friction"},
            "speed_bandwidth": 30.0,
            "current_limit": 350.0,
            "voltage_limit": 1500.0 / float(np.sqrt(3.0)),
        },
    }
    default_preset = "drive_100w"
    option_choices = {
        "frame": FRAMES,
        "reference": ("speed", "torque"),
    }

    def __init__(self, *, frame: Frame = "rotor", reference: Reference = "speed") -> None:
        require_chosen(self.name, self.option_choices, frame=frame, reference=reference)
        self.frame, self.reference = frame, reference
        speed = input_signal("speed_reference", "rad/s", 0.0, "Speed asked for", display_unit="rpm")
        torque = input_signal("torque_reference", "N.m", 0.0, "Torque asked for")
        self.inputs = (
            speed if reference == "speed" else torque,
            input_signal("speed", "rad/s", 0.0, "Speed of the shaft, measured or estimated", display_unit="rpm"),
            input_signal("angle", "rad", 0.0, "Electrical angle, measured or estimated"),
            *(input_signal(f"current_{axis}", "A", 0.0, f"Current along {axis}") for axis in AXES[frame]),
        )
        super().__init__(frame=frame, reference=reference)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Voltages of the coming period from the signals of this instant."""
        first, second = (getattr(u, f"current_{axis}") for axis in AXES[self.frame])
        current_d, current_q = (first, second) if self.frame == "rotor" else to_rotor(first, second, u.angle)
        reference, speed_integral = self._asked_current(x, u, p)
        electrical, rate = p.pole_pairs * u.speed, p.current_bandwidth
        errors = (-current_d, reference - current_q)
        inductances = (p.inductance_d, p.inductance_q)
        wanted_d = rate * p.inductance_d * errors[0] + x.integral_d - electrical * p.inductance_q * current_q
        flux_d = p.inductance_d * current_d + p.rotor_flux
        wanted_q = rate * p.inductance_q * errors[1] + x.integral_q + electrical * flux_d
        length = np.sqrt(wanted_d * wanted_d + wanted_q * wanted_q)
        share = np.minimum(1.0, p.voltage_limit / np.maximum(length, p.voltage_limit))
        voltages = (share * wanted_d, share * wanted_q)
        integrals = [
            integral + p.control_period * p.stator_resistance * (rate * e + (limited - wanted) / inductance)
            for integral, e, limited, wanted, inductance in zip(
                (x.integral_d, x.integral_q), errors, voltages, (wanted_d, wanted_q), inductances, strict=True
            )
        ]
        return {
            "speed_integral": speed_integral,
            "integral_d": integrals[0],
            "integral_q": integrals[1],
            "held_voltage_d": voltages[0],
            "held_voltage_q": voltages[1],
            "held_angle": u.angle,
            "held_reference": reference,
        }

    def _asked_current(self, x: Any, u: Any, p: Any) -> tuple[Array, Array]:
        """The current along q that the torque or the speed asks for [A], and the integral of the speed [A]."""
        torque_constant = 1.5 * p.pole_pairs * p.rotor_flux
        if self.reference == "torque":
            return _limited(u.torque_reference / torque_constant, p.current_limit), 0.0
        push = p.speed_bandwidth * p.inertia / torque_constant * (u.speed_reference - u.speed)
        reference = _limited(push + x.speed_integral, p.current_limit)
        # Integrals go back by what a limit cuts off, with the time constant of their own PI.
        cut = reference - push - x.speed_integral
        return reference, x.speed_integral + p.control_period * p.speed_bandwidth / 5.0 * (push + cut)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        alpha, beta = to_stator(x.held_voltage_d, x.held_voltage_q, x.held_angle)
        return {
            "voltage_d": x.held_voltage_d,
            "voltage_q": x.held_voltage_q,
            "voltage_alpha": alpha,
            "voltage_beta": beta,
            "current_reference": x.held_reference,
        }


def _limited(asked: Array, limit: Array) -> Array:
    """Within plus and minus the limit."""
    return np.minimum(np.maximum(asked, -limit), limit)

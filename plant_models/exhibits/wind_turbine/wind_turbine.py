"""The wind turbine: rotor, drive train, pitch actuators, converter, and two sensors for each measurement.

Declares the hybrid system; aerodynamics and drive train are formulas in the files beside this one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.exhibits.wind_turbine.drive_train import DriveTrain
from plant_models.exhibits.wind_turbine.rotor import Rotor
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.signal import (
    discrete_output,
    input_signal,
    memory,
    output_signal,
    parameter,
    standard_normal,
    state,
    warning_output,
)

BLADES = 3

_MEASURED = (
    ("wind", "m/s", None, "wind speed"),
    ("rotor_speed", "rad/s", 2, "rotor speed, by two sensors"),
    ("generator_speed", "rad/s", 2, "generator speed, by two sensors"),
    ("torque", "N.m", None, "generator torque"),
    ("power", "W", None, "generator power"),
    ("pitch", "deg", 6, "pitch of blades 1, 1, 2, 2, 3, 3, by two sensors each"),
)
_DRIVE = DriveTrain()
_ROTOR = Rotor()


class WindTurbine(HybridSystem):
    """Wind turbine of 4.8 MW with three blades, sampled sensors and the places where its faults act.

    Drive train: see `DriveTrain`. Rotor: see `Rotor`, with **Heier's formula as a stand-in** for the table of the power
    coefficient. Pitch actuators: ``wn^2 / (s^2 + 2 zeta wn s + wn^2)``, one a blade. Converter: ``1 / (1 + tau s)``,
    then `torque_offset` is added. Each measurement is taken at each `sample_period` with normal noise and held; rotor
    speed, generator speed and each pitch have two sensors.

    Faults come from outside: `torque_offset`, `efficiency`, `pitch_frequency` and `pitch_damping` are inputs, which
    have their nominal values where nothing is connected; what happens to a reading happens behind the sensor (block
    `signal_fault`).

    Presets: `repaired` (default); `as_published`, the matrix of the drive train as printed, which is unstable: the
    output `drive_train_unstable` says so, and the run warns; `without_noise`.

    Source: Omar 2012, sections 7.2 and 7.3, (7.3.1) to (7.3.5); numbers that the thesis leaves out from the benchmark
    of Odgaard, Stoustrup, Kinnaert 2009 as its script has them.
    """

    name = "wind_turbine"
    description = "Wind turbine of the benchmark on fault detection, with two sensors for each speed and pitch"
    source = "Omar 2012, (7.3.1)-(7.3.5); Odgaard, Stoustrup, Kinnaert 2009; power coefficient: Heier, stand-in"
    internal_step = 1e-2  # the shaft swings with 28 rad/s; with this step its damping is 0.6 % too strong
    bounded_parameters = "all"
    states = (
        state("rotor_turning", "rad/s", 1.1, "Speed of the rotor"),
        state("generator_turning", "rad/s", 104.5, "Speed of the generator"),
        state("shaft_torsion", "rad", 6.5e-4, "Torsion of the shaft"),
        state("converter_torque", "N.m", 13300.0, "Torque of the converter, without its offset"),
        state("blade_pitch", "deg", 0.0, "Pitch of each blade", size=BLADES),
        state("blade_pitch_rate", "deg/s", 0.0, "Rate of the pitch of each blade", size=BLADES),
        *(
            memory(f"held_{name}", unit, 0.0, f"Last reading of the {text}", size=n)
            for name, unit, n, text in _MEASURED
        ),
    )
    inputs = (
        input_signal("wind_speed", "m/s", 9.0, "Speed of the wind at the hub", display_unit="km/h"),
        input_signal("torque_reference", "N.m", 0.0, "Torque asked of the generator"),
        input_signal("pitch_reference", "deg", 0.0, "Pitch asked of the three blades"),
        input_signal("torque_offset", "N.m", 0.0, "Fault of the converter: added to its torque", optional=True),
        input_signal("efficiency", "1", 0.97, "Efficiency of the drive train; less in a fault", optional=True),
        input_signal(
            "pitch_frequency", "rad/s", 11.11, "Natural frequency of each pitch actuator", size=BLADES, optional=True
        ),
        input_signal("pitch_damping", "1", 0.6, "Damping ratio of each pitch actuator", size=BLADES, optional=True),
    )
    outputs = (
        output_signal("rotor_speed", "rad/s", "Speed of the rotor"),
        output_signal("generator_speed", "rad/s", "Speed of the generator"),
        output_signal("torsion", "rad", "Torsion of the shaft"),
        output_signal("rotor_torque", "N.m", "Torque of the wind on the rotor"),
        output_signal("generator_torque", "N.m", "Torque of the generator"),
        output_signal("generator_power", "W", "Power of the generator"),
        output_signal("pitch", "deg", "Pitch of each blade", size=BLADES),
        *(
            discrete_output(
                f"measured_{name}",
                unit,
                f"Reading of the {text}",
                size=n,
                display_unit="km/h" if unit == "m/s" else None,
            )
            for name, unit, n, text in _MEASURED
        ),
        warning_output(
            "drive_train_unstable",
            "1 while the matrix of the drive train has an eigenvalue in the right half-plane",
            "the matrix of the drive train is unstable: the thesis prints it so (preset as_published), and no "
            "drive train of that kind exists; take the preset repaired",
            ("drive_train_unstable",),
            variability="continuous",
        ),
    )
    parameters = (
        parameter("sample_period", "s", 0.01, "Time between two readings", min=1e-6),
        parameter("rotor_radius", "m", _ROTOR.radius, "Radius of the rotor R", min=1e-3),
        parameter("air_density", "kg/m3", _ROTOR.air_density, "Density of the air", min=0.0),
        parameter("largest_coefficient", "1", _ROTOR.largest_coefficient, "Largest power coefficient", min=0.0),
        parameter("rotor_inertia", "kg.m2", _DRIVE.rotor_inertia, "Inertia of the rotor Jr", min=1e-3),
        parameter("generator_inertia", "kg.m2", _DRIVE.generator_inertia, "Inertia of the generator Jg", min=1e-3),
        parameter("gear_ratio", "1", _DRIVE.gear_ratio, "Ratio of the gear Ng", min=1e-3),
        parameter("shaft_stiffness", "N.m/rad", _DRIVE.shaft_stiffness, "Stiffness of the shaft Kdt", min=0.0),
        parameter("shaft_damping", "N.m.s/rad", _DRIVE.shaft_damping, "Damping of the shaft Bdt", min=0.0),
        parameter("rotor_friction", "N.m.s/rad", _DRIVE.rotor_friction, "Friction of the rotor Br", min=0.0),
        parameter(
            "generator_friction", "N.m.s/rad", _DRIVE.generator_friction, "Friction of the generator Bg", min=0.0
        ),
        parameter("printed_drive_train", "1", 0.0, "1 for the matrix as printed, which is unstable", min=0.0, max=1.0),
        parameter("converter_time", "s", 0.02, "Time constant of the converter", min=1e-6),
        parameter("generator_efficiency", "1", 0.98, "Efficiency of the generator", min=0.0, max=1.0),
        parameter("wind_bias", "m/s", 1.5, "Mean error of the measured wind speed", display_unit="km/h"),
        parameter("wind_noise", "m/s", 0.5, "Standard deviation of the measured wind", min=0.0, display_unit="km/h"),
        parameter("rotor_speed_noise", "rad/s", 0.0251, "Standard deviation of the measured rotor speed", min=0.0),
        parameter("generator_speed_noise", "rad/s", 0.05, "Standard deviation of the generator speed", min=0.0),
        parameter("torque_noise", "N.m", 90.0, "Standard deviation of the measured torque", min=0.0),
        parameter("power_noise", "W", 1e3, "Standard deviation of the measured power", min=0.0),
        parameter("pitch_noise", "deg", 0.2, "Standard deviation of each measured pitch", min=0.0),
    )
    events = (
        PeriodicEvent(
            "sampling",
            "sample_period",
            noises=tuple(
                standard_normal(f"{name}_normal", "Standard normal numbers", size=n or 1) for name, _, n, _ in _MEASURED
            ),
            description="The sensors are read",
        ),
    )
    presets = {
        "repaired": {},
        "as_published": {"printed_drive_train": 1.0},
        "without_noise": {
            "wind_bias": 0.0,
            **{f"{name}_noise": 0.0 for name, *_ in _MEASURED},
        },
    }
    default_preset = "repaired"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        turning = (x.rotor_turning, x.generator_turning, x.shaft_torsion)
        rotor_torque = _rotor(p).torque(u.wind_speed, x.rotor_turning, x.blade_pitch)
        turned = _drive_train(u, p).rates(turning, rotor_torque, x.converter_torque + u.torque_offset)
        blades = zip(x.blade_pitch, x.blade_pitch_rate, u.pitch_frequency, u.pitch_damping, strict=True)
        bent = (wn * wn * (u.pitch_reference - pitch) - 2.0 * zeta * wn * rate for pitch, rate, wn, zeta in blades)
        return {
            "rotor_turning": turned[0],
            "generator_turning": turned[1],
            "shaft_torsion": turned[2],
            "converter_torque": (u.torque_reference - x.converter_torque) / p.converter_time,
            "blade_pitch": x.blade_pitch_rate,
            "blade_pitch_rate": vector(*bent),
        }

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The sensors are read: new held readings."""
        torque, rotor, speed = x.converter_torque + u.torque_offset, x.rotor_turning, x.generator_turning
        pitches = (
            pitch + p.pitch_noise * u.pitch_normal[2 * i + j] for i, pitch in enumerate(x.blade_pitch) for j in range(2)
        )
        return {
            "held_wind": u.wind_speed + p.wind_bias + p.wind_noise * u.wind_normal[0],
            "held_rotor_speed": vector(*(rotor + p.rotor_speed_noise * n for n in u.rotor_speed_normal)),
            "held_generator_speed": vector(*(speed + p.generator_speed_noise * n for n in u.generator_speed_normal)),
            "held_torque": torque + p.torque_noise * u.torque_normal[0],
            "held_power": p.generator_efficiency * speed * torque + p.power_noise * u.power_normal[0],
            "held_pitch": vector(*pitches),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        torque = x.converter_torque + u.torque_offset
        stable = [np.where(value > 0.0, 1.0, 0.0) for value in _drive_train(u, p).hurwitz()]
        return {
            "rotor_speed": x.rotor_turning,
            "generator_speed": x.generator_turning,
            "torsion": x.shaft_torsion,
            "rotor_torque": _rotor(p).torque(u.wind_speed, x.rotor_turning, x.blade_pitch),
            "generator_torque": torque,
            "generator_power": p.generator_efficiency * x.generator_turning * torque,
            "pitch": x.blade_pitch,
            **{f"measured_{name}": getattr(x, f"held_{name}") for name, *_ in _MEASURED},
            "drive_train_unstable": 1.0 - stable[0] * stable[1] * stable[2],
        }


def _rotor(p: Any) -> Rotor:
    return Rotor(p.rotor_radius, p.air_density, p.largest_coefficient)


def _drive_train(u: Any, p: Any) -> DriveTrain:
    return DriveTrain(
        p.rotor_inertia,
        p.generator_inertia,
        p.gear_ratio,
        p.shaft_stiffness,
        p.shaft_damping,
        p.rotor_friction,
        p.generator_friction,
        u.efficiency,
        p.printed_drive_train,
    )

"""The permanent-magnet synchronous motor in the rotor frame, as it flows and in Euler steps. The equations stand in
`motor_equations`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, Signal, input_signal, memory, output_signal, state
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Variability
from plant_models.railway.traction.motor_equations import (
    AXES,
    FRAMES,
    LOAD_TORQUE,
    MOTOR_PARAMETERS,
    NOISE_PARAMETERS,
    PUBLISHED_NOISE,
    STATE_OUTPUTS,
    TORQUE,
    TRACTION_200_KW,
    Frame,
    electromagnetic_torque,
    euler_step,
    motor_rates,
    process_noise,
    rotor_voltages,
    sampling_event,
)
from plant_models.railway.traction.transforms import to_stator

Noise = Literal["none", "sampled"]
State = tuple[Array, Array, Array, Array]
MOVING = ("rotor_current_d", "rotor_current_q", "shaft_speed", "electrical_angle")


class SynchronousMotor(HybridSystem):
    """Motor with currents, speed and angle as states: ``di_d = (v_d - R i_d + p w L_q i_q) / L_d``, ``di_q = (v_q - R
    i_q - p w (L_d i_d + phi)) / L_q``, ``J dw = C_em - C_r - f w``, ``dtheta = p w``.

    The angle is the electrical one. Measured currents are those of the frame.

    Args:
        frame: of voltages and measured currents: ``rotor`` (d, q), or ``stator`` (alpha, beta), in which a real
            inverter and real sensors work. A voltage held in the stator frame turns against the rotor meanwhile.
        noise: ``none``; or ``sampled``: every `sample_period` the currents are measured with noise and held, and noise
            of `process_variance` is added to the state.

    Raises:
        ValueError: an option is unknown.

    Source: Allaoui 2024, (4.27)-(4.38), Annex C; process noise as additions at the samples is ours, and so are all
    numbers of the preset `traction_200kw`.
    """

    name = "synchronous_motor"
    description = "Permanent-magnet synchronous motor in the rotor frame, continuous"
    source = "Allaoui 2024, (4.27)-(4.38), Annex C"
    internal_step = 1e-4
    bounded_parameters = "all"
    state_signal: ClassVar[Callable[..., Signal]] = staticmethod(state)
    _outputs_are: ClassVar[Variability] = "continuous"
    parameters: tuple[Signal, ...] = MOTOR_PARAMETERS
    presets = {"exact": {}, "traction_200kw": TRACTION_200_KW}
    default_preset = "exact"
    option_choices = {"frame": FRAMES, "noise": ("none", "sampled")}

    def __init__(self, *, frame: Frame = "rotor", noise: Noise = "none") -> None:
        chosen = {"frame": frame, "noise": noise}
        require_chosen(self.name, SynchronousMotor.option_choices, **chosen)
        self.frame, self.sampled = frame, noise == "sampled"
        if self.sampled:
            self.parameters = (*MOTOR_PARAMETERS, *NOISE_PARAMETERS)
            self.events = self.events or (sampling_event("sampling"),)
        self.states = (
            self.state_signal("rotor_current_d", "A", 0.0, "Current along d"),
            self.state_signal("rotor_current_q", "A", 0.0, "Current along q"),
            self.state_signal("shaft_speed", "rad/s", 0.0, "Speed of the shaft"),
            self.state_signal("electrical_angle", "rad", 0.0, "Electrical angle of the rotor"),
            *(_measured_memory(frame) if self.sampled else ()),
        )
        self.inputs = _motor_inputs(frame)
        self.outputs = tuple(replace(signal, variability=self._outputs_are) for signal in _motor_outputs(frame))
        super().__init__(**{option: value for option, value in chosen.items() if option in self.option_choices})

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        voltages = rotor_voltages(self.frame, u, x.electrical_angle)
        return dict(zip(MOVING, motor_rates(self._moving(x), *voltages, u.load_torque, p), strict=True))

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sample: noise enters the state, the currents are measured."""
        return self._disturbed(self._moving(x), x.sampled, u, p)

    def _disturbed(self, state: State, sampled: Array, u: Any, p: Any) -> dict[str, Array]:
        """State with the noise of a sample, which the first one has not, and the currents measured then."""
        first, second, third, fourth = (
            value + sampled * noise for value, noise in zip(state, process_noise(u, p), strict=True)
        )
        after = (first, second, third, fourth)
        names = (*MOVING, *(f"held_current_{axis}" for axis in AXES[self.frame]), "sampled")
        return dict(zip(names, (*after, *_measured_currents(self.frame, after, u, p), 1.0), strict=True))

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        current_d, current_q, speed, angle = self._moving(x)
        now = (current_d, current_q) if self.frame == "rotor" else to_stator(current_d, current_q, angle)
        held = [getattr(x, f"held_current_{axis}") for axis in AXES[self.frame]] if self.sampled else now
        return {
            "current_d": current_d,
            "current_q": current_q,
            "speed": speed,
            "angle": angle,
            "torque": electromagnetic_torque(current_d, current_q, p),
            **{f"measured_current_{axis}": value for axis, value in zip(AXES[self.frame], held, strict=True)},
        }

    @staticmethod
    def _moving(x: Any) -> State:
        """Currents along d and q [A], speed [rad/s] and angle [rad]."""
        return x.rotor_current_d, x.rotor_current_q, x.shaft_speed, x.electrical_angle


class SynchronousMotorEuler(SynchronousMotor):
    """Motor in discrete time: ``x(k+1) = x(k) + T_s f(x(k), v(k), C_r(k)) + w(k)``, ``y(k) = (i_d, i_q) + v(k)``.

    The update occurs at ``start + k sample_period``, k = 1, 2, ..., with the voltages held since; the state stands in
    between. White noise of `process_variance` is added to the state per step, and of `measurement_variance` to the
    measured currents. Set a variance to zero to take its noise out: 1e-3 on the angle is a random walk of 3.2 rad in a
    second, which no drive has.

    Signals and parameters are those of `synchronous_motor`. Presets: `as_published` (default): variances 1e-3 and 0.1;
    `exact`: none; `quiet`, `very_quiet`, `faint`: noise in which the sensorless drive of `motor_ekf_stator` holds, the
    last one at 100 rpm too.

    Args:
        frame: of voltages and measured currents: ``rotor`` (d, q) or ``stator`` (alpha, beta).

    Raises:
        ValueError: the frame is unknown.

    Source: Allaoui 2024, "3.39"-"3.41" (4.39-4.41), section III.3; the quiet presets are ours.
    """

    name = "synchronous_motor_euler"
    description = "Permanent-magnet synchronous motor in discrete time, with noise"
    source = 'Allaoui 2024, "3.39"-"3.41" (4.39-4.41), section III.3'
    internal_step = 1e-2  # nothing flows
    state_signal: ClassVar[Callable[..., Signal]] = staticmethod(memory)
    _outputs_are = "discrete"  # they follow from what is held between updates
    events = (sampling_event("update"),)
    presets = {
        "as_published": PUBLISHED_NOISE,
        "exact": {},
        "quiet": {"process_variance": (1e-4, 1e-4, 1e-4, 0.0), "measurement_variance": 1e-2},
        "very_quiet": {"process_variance": (1e-5, 1e-5, 1e-5, 0.0), "measurement_variance": 1e-3},
        "faint": {"process_variance": (1e-7, 1e-7, 1e-7, 0.0), "measurement_variance": 1e-4},
    }
    default_preset = "as_published"
    option_choices = {"frame": FRAMES}

    def __init__(self, *, frame: Frame = "rotor") -> None:
        super().__init__(frame=frame, noise="sampled")

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Nothing flows."""
        return {}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """State and measured currents after a period; at the start they are measured only."""
        voltages = rotor_voltages(self.frame, u, x.electrical_angle)
        moved = euler_step(self._moving(x), *voltages, u.load_torque, x.sampled * p.sample_period, p)
        return self._disturbed(moved, x.sampled, u, p)


def _measured_memory(frame: str) -> tuple[Signal, ...]:
    """Memory of the last measured currents, and whether there was a sample."""
    return (
        *(memory(f"held_current_{axis}", "A", 0.0, f"Last sampled current along {axis}") for axis in AXES[frame]),
        memory("sampled", "1", 0.0, "1 after the first sample"),
    )


def _measured_currents(frame: str, state: tuple[Array, Array, Array, Array], u: Any, p: Any) -> tuple[Array, Array]:
    """The currents as they are measured, with noise."""
    current_d, current_q, _, angle = state
    first, second = (current_d, current_q) if frame == "rotor" else to_stator(current_d, current_q, angle)
    return (
        first + np.sqrt(p.measurement_variance[0]) * u.measurement_noise_1,
        second + np.sqrt(p.measurement_variance[1]) * u.measurement_noise_2,
    )


def _motor_inputs(frame: str) -> tuple[Signal, ...]:
    """Inputs of a motor: voltages of both axes and the torque of the load."""
    return (
        *(input_signal(f"voltage_{axis}", "V", 0.0, f"Voltage along {axis}") for axis in AXES[frame]),
        LOAD_TORQUE,
    )


def _motor_outputs(frame: str) -> tuple[Signal, ...]:
    """Outputs of a motor: state, torque and measured currents."""
    return (
        *STATE_OUTPUTS,
        TORQUE,
        *(output_signal(f"measured_current_{axis}", "A", f"Measured current along {axis}") for axis in AXES[frame]),
    )

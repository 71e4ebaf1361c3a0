"""The permanent-magnet synchronous motor as it flows, in the rotor frame. The equations stand in `motor_equations`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

from plant_models.hybrid import HybridSystem, Signal, state, vector
from plant_models.hybrid.requirements import within_bounds
from plant_models.hybrid.system import Array
from plant_models.railway.traction.motor_equations import (
    AXES,
    FRAMES,
    MOTOR_PARAMETERS,
    TRACTION_200_KW,
    Frame,
    electromagnetic_torque,
    motor_inputs,
    motor_outputs,
    motor_rates,
    rotor_voltages,
)
from plant_models.railway.traction.sampled_currents import (
    NOISE_PARAMETERS,
    measured_currents,
    measured_memory,
    process_noise,
    sampling_event,
)
from plant_models.railway.traction.transforms import to_stator

Noise = Literal["none", "sampled"]


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
    state_signal: ClassVar[Callable[..., Signal]] = staticmethod(state)
    parameters: tuple[Signal, ...] = MOTOR_PARAMETERS
    presets: Mapping[str, Mapping[str, Any]] = {"exact": {}, "traction_200kw": TRACTION_200_KW}
    default_preset = "exact"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {"frame": FRAMES, "noise": ("none", "sampled")}

    def __init__(self, *, frame: Frame = "rotor", noise: Noise = "none") -> None:
        chosen = {"frame": frame, "noise": noise}
        for option, value in chosen.items():
            if value not in SynchronousMotor.option_choices[option]:
                known = ", ".join(SynchronousMotor.option_choices[option])
                raise ValueError(f"Unknown {option} {value!r}; choose one of: {known}.")
        self.frame, self.sampled = frame, noise == "sampled"
        if self.sampled:
            self.parameters = (*MOTOR_PARAMETERS, *NOISE_PARAMETERS)
            self.events = self.events or (sampling_event("sampling"),)
        self.states = (
            self.state_signal("rotor_current_d", "A", 0.0, "Current along d"),
            self.state_signal("rotor_current_q", "A", 0.0, "Current along q"),
            self.state_signal("shaft_speed", "rad/s", 0.0, "Speed of the shaft"),
            self.state_signal("electrical_angle", "rad", 0.0, "Electrical angle of the rotor"),
            *(measured_memory(frame) if self.sampled else ()),
        )
        self.inputs, self.outputs = motor_inputs(frame), motor_outputs(frame)
        super().__init__(**{option: value for option, value in chosen.items() if option in self.option_choices})

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Derivatives of currents, speed and angle, shape (4,) or (4, members)."""
        voltages = rotor_voltages(self.frame, u, x[3])
        return vector(*motor_rates((x[0], x[1], x[2], x[3]), *voltages, u.load_torque, p))

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """A sample: noise enters the state (not at the first one), the currents are measured; shape (7,)."""
        before = (x[0], x[1], x[2], x[3])
        first, second, third, fourth = (
            value + x[6] * noise for value, noise in zip(before, process_noise(u, p), strict=True)
        )
        after = (first, second, third, fourth)
        return vector(*after, *measured_currents(self.frame, after, u, p), 1.0)

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """State, torque and the measured currents."""
        first, second = AXES[self.frame]
        now = (x[0], x[1]) if self.frame == "rotor" else to_stator(x[0], x[1], x[3])
        measured = (x[4], x[5]) if self.sampled else now
        return {
            "current_d": x[0],
            "current_q": x[1],
            "speed": x[2],
            "angle": x[3],
            "torque": electromagnetic_torque(x[0], x[1], p),
            f"measured_current_{first}": measured[0],
            f"measured_current_{second}": measured[1],
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds."""
        return within_bounds(self.parameters, p)

"""The permanent-magnet synchronous motor in discrete time, with noise: the Euler form of `synchronous_motor`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from plant_models.hybrid import Array, Signal, memory
from plant_models.railway.traction.motor_equations import FRAMES, Frame, euler_step, rotor_voltages
from plant_models.railway.traction.sampled_currents import PUBLISHED_NOISE, sampling_event
from plant_models.railway.traction.synchronous_motor import SynchronousMotor


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

"""Oscillators of two states: braked far from the centre, with a hyperbolic tangent, time-varying, of Van der Pol, and
the pendulum. They know only the hybrid foundation.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, HybridSystem, discrete_output, input_signal, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen


class Pendulum(HybridSystem):
    """Damped pendulum: ``d angle = rate``, ``d rate = -a sin(angle) - d rate + torque`` [ours].

    In the normal form of Bouchama 2024, (1.10): a chain of integrators with the rest in the last equation, globally
    Lipschitz. The thesis prints no plant for its chapter 1; this is the smallest one with all the properties that
    chapter asks for. It starts at 1 rad at rest, while its observers start at 0.

    Presets: `swinging` (default), `small` (0.05 rad, where the linear observers are right), `rest`.
    """

    name = "pendulum"
    description = "Damped pendulum driven by a torque"
    source = "ours, in the normal form of Bouchama 2024, (1.10)"
    internal_step = 5e-3
    states = (
        state("pendulum_angle", "rad", 1.0, "Angle from the lower rest"),
        state("pendulum_rate", "rad/s", 0.0, "Angular speed"),
    )
    inputs = (input_signal("torque", "rad/s2", 0.0, "Torque over the moment of inertia"),)
    outputs = (
        output_signal("angle", "rad", "Angle from the lower rest"),
        output_signal("rate", "rad/s", "Angular speed"),
    )
    parameters = (
        parameter("stiffness", "1/s2", 1.0, "Gravity over length, g / l", min=0.0),
        parameter("damping", "1/s", 0.2, "Damping over the moment of inertia", min=0.0),
    )
    presets = {
        "swinging": {},
        "small": {"pendulum_angle": 0.05},
        "rest": {"pendulum_angle": 0.0},
    }
    default_preset = "swinging"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        turning = -p.stiffness * np.sin(x.pendulum_angle) - p.damping * x.pendulum_rate + u.torque
        return {"pendulum_angle": x.pendulum_rate, "pendulum_rate": turning}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Angle [rad] and rate [rad/s]."""
        return {"angle": x.pendulum_angle, "rate": x.pendulum_rate}


LARGEST, LARGEST_SHIFT = 10.0, 1.0


class VanDerPol(HybridSystem):
    """Oscillator ``dx1 = p1 x2``, ``dx2 = -9 x1 + p2 (1 - (x1 + p3)^2) x2``, ``y = x1``: Omar 2012, (2.5.1).

    p1 lies in [1, 2], p2 in [1.5, 3], p3 in [0, 0.1]. The inputs are added to the parameters, so that a fault changes
    one of them at any time; the sums are kept within 0 to 10 and, of p3, within -1 to 1: beyond, the oscillator leaves
    every bound or becomes too stiff for its step. The thesis prints no start: (1, 0) is ours; after 20 s the limit
    cycle is reached.

    Presets: `nominal` (default), `quick` with p1 = 2, `stiff` with p2 = 3, `shifted` with p3 = 0.1.
    """

    name = "van_der_pol"
    description = "Van der Pol oscillator with three parameters that may change"
    source = "Omar 2012, (2.5.1)"
    internal_step = 5e-3
    states = (
        state("oscillation", "1", 1.0, "State x1, which is measured"),
        state("oscillation_rate", "1", 0.0, "State x2, derivative of x1 over p1"),
    )
    inputs = (
        input_signal("p1_change", "1/s", 0.0, "Added to p1", optional=True),
        input_signal("p2_change", "1/s", 0.0, "Added to p2", optional=True),
        input_signal("p3_change", "1", 0.0, "Added to p3", optional=True),
    )
    outputs = (
        output_signal("measured", "1", "Measured y = x1"),
        output_signal("x2", "1", "State x2"),
    )
    parameters = (
        parameter("p1", "1/s", 1.5, "Rate of x1 by x2", min=0.0, max=LARGEST),
        parameter("p2", "1/s", 2.25, "Strength of the damping that changes its sign", min=0.0, max=LARGEST),
        parameter("p3", "1", 0.0, "Shift of the damping", min=-LARGEST_SHIFT, max=LARGEST_SHIFT),
        parameter("stiffness", "1/s", 9.0, "Rate of x2 by x1", min=0.0, max=100.0),
    )
    presets = {
        "nominal": {},
        "quick": {"p1": 2.0},
        "stiff": {"p2": 3.0},
        "shifted": {"p3": 0.1},
    }
    default_preset = "nominal"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        p1, p2 = np.clip(p.p1 + u.p1_change, 0.0, LARGEST), np.clip(p.p2 + u.p2_change, 0.0, LARGEST)
        shifted = x.oscillation + np.clip(p.p3 + u.p3_change, -LARGEST_SHIFT, LARGEST_SHIFT)
        damped = p2 * (1.0 - shifted * shifted) * x.oscillation_rate
        return {"oscillation": p1 * x.oscillation_rate, "oscillation_rate": -p.stiffness * x.oscillation + damped}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"measured": x.oscillation, "x2": x.oscillation_rate}


DRIVE = 10.0  # size of the printed drive sin t


class TimeVaryingOscillator(HybridSystem):
    """Oscillator ``dx1 = x2 + sin(w1 t) rho1``, ``dx2 = -x1 + g(t) rho2 + (2 + tanh t) u``, ``y = x1``: Hann 2014,
    (4.64).

    ``g = cos(w1 t + phase) / (1 + fading t^2)``; driven by the printed ``u = 10 sin t``, plus the input `drive`. The
    drive is in resonance, so that the state grows: |x1| reaches 639 at 45 s.

    Presets: `as_published`, where the second regressor fades, so that persistent excitation (assumption 4.4 of the
    thesis) fails. It would fail without fading too, for both regressors show in the output in phase, one 20 times as
    large as the other. `lasting`, ``g = sin(w1 t)`` [ours], excites both constants.
    """

    name = "time_varying_oscillator"
    description = "Time-varying oscillator with two unknown constants"
    source = "Hann 2014, (4.64)"
    states = (state("state_1", "1", 20.0, "First state"), state("state_2", "1", -40.0, "Second state"))
    inputs = (input_signal("drive", "1", 0.0, "Added to the printed drive", optional=True),)
    outputs = (
        output_signal("x1", "1", "First state, which is measured"),
        output_signal("x2", "1", "Second state"),
    )
    parameters = (
        parameter("rho1", "1", 10.0, "First constant, unknown to observers"),
        parameter("rho2", "1", 20.0, "Second constant, unknown to observers"),
        parameter("pulsation", "rad/s", 20.0, "Pulsation w1 of the regressors"),
        parameter("phase", "rad", 0.0, "Phase of the second regressor"),
        parameter("fading", "1/s2", 1.0, "Fading of the second regressor", min=0.0),
    )
    presets = {"as_published": {}, "lasting": {"fading": 0.0, "phase": -0.5 * np.pi}}
    default_preset = "as_published"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        first, second = np.sin(p.pulsation * t), np.cos(p.pulsation * t + p.phase) / (1.0 + p.fading * t * t)
        driven = (2.0 + np.tanh(t)) * (DRIVE * np.sin(t) + u.drive)
        return {"state_1": x.state_2 + first * p.rho1, "state_2": -x.state_1 + second * p.rho2 + driven}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.state_1, "x2": x.state_2}


Reading = Literal["minus", "as_published", "product"]


class TanhSystem(HybridSystem):
    """Oscillator ``dx1 = x2``, ``dx2 = -0.1 x1 - tanh(x1) x2``, x1 is measured: Hann 2014, (3.110).

    Printed is ``+ tanh(x1) x2``, and printed so the plant leaves every bound from its own start (5, 3): x1 is 2e4 after
    10 s. With the minus it stays on a closed orbit, ``|x1| <= 6.9``, and gives the published tables; so does
    ``tanh(x1 x2)``, ``|x1| <= 20.6``. Neither reading is in the thesis.

    Args:
        reading: ``minus``; ``as_published``, for runs of 3 s at most; ``product``, which is ``+ tanh(x1 x2)``.
    """

    name = "tanh_system"
    description = "Second-order plant with tanh(x1) x2"
    source = "Hann 2014, (3.110)"
    internal_step = 5e-3
    states = (state("first", "1", 5.0, "State x1"), state("second", "1/s", 3.0, "State x2, derivative of x1"))
    outputs = (output_signal("x1", "1", "State x1"), output_signal("x2", "1/s", "State x2"))
    parameters = (
        parameter("stiffness", "1/s2", 0.1, "Factor of x1", min=0.0),
        parameter("tanh_gain", "1/s", 1.0, "Factor of the term with tanh", min=0.0),
    )
    presets = {"large": {}, "small": {"first": 0.05, "second": 0.0}}
    default_preset = "large"
    option_choices = {"reading": ("minus", "as_published", "product")}

    def __init__(self, reading: Reading = "minus") -> None:
        require_chosen(self.name, self.option_choices, reading=reading)
        self.reading = reading
        super().__init__(reading=reading)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        braked = p.tanh_gain * tanh_term(x.first, x.second, self.reading)
        return {"first": x.second, "second": -p.stiffness * x.first + braked}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.first, "x2": x.second}


Variant = Literal["mixed", "speed", "root"]
STIFFNESS = 9.0  # printed factor of x1
BRAKING = {"mixed": 5.0, "speed": 5.0, "root": 7.5}  # printed factors of |x1|^2


class BrakedOscillator(NoisyPlant):
    """Oscillator ``dx1 = p1 x2``, ``dx2 = -9 x1 + p2 (1 - 5 |x1|^2) x2``: Omar 2012, (4.6.1) to (4.6.11).

    The thesis prints neither p1 nor p2. The default ``p1 = 1, p2 = 0.1`` [ours] keeps the limit cycle within the
    printed set ``[-1, 1] x [-3, 3]``, and the state within it follows from the output and its rate alone. Presets:
    `fits_set` (default); `chapter_2`, ``p1 = 1.5, p2 = 2.25`` of the thesis' other oscillator, which leaves the set and
    in which two states have one signature; `noisy`, the default with measurement noise of 0.03, 1 % of the largest
    output.

    Args:
        variant: ``mixed`` measures ``0.2 sin(x1) + x2``, (4.6.2); ``speed`` measures x2, (4.6.9); ``root`` has
            ``dx2 = -9 x1 + p2 (1 - 7.5 |x1|^2) sqrt(|x2|)`` and measures x1, (4.6.10) and (4.6.11).
    """

    name = "braked_oscillator"
    description = "Oscillator that is braked far from its centre"
    source = "Omar 2012, (4.6.1)-(4.6.11), Fig. 4.19"
    internal_step = 1.25e-3
    moving = (state("state_1", "1", -0.7, "First state"), state("state_2", "1/s", 1.5, "Second state"))
    plain_outputs = (
        output_signal("x1", "1", "First state"),
        output_signal("x2", "1/s", "Second state"),
        output_signal("y", "1/s", "Output without noise, now"),
    )
    presets = {
        "fits_set": {},
        "chapter_2": {"rate_factor": 1.5, "braking": 2.25},
        "noisy": {"measurement_noise": 0.03},
    }
    default_preset = "fits_set"
    option_choices = {"variant": ("mixed", "speed", "root")}

    def __init__(self, variant: Variant = "mixed") -> None:
        require_chosen(self.name, self.option_choices, variant=variant)
        self.variant: Variant = variant
        self.declare(
            (discrete_output("measured_y", "1/s", "Measured output"),),
            (
                parameter("rate_factor", "1", 1.0, "Factor p1 of x2 in the rate of x1"),
                parameter("braking", "1/s", 0.1, "Factor p2 of the braking term"),
            ),
            period=5e-3,
        )
        super().__init__(variant=variant)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        first, second = x.state_1, x.state_2
        driven = np.sqrt(np.abs(second)) if self.variant == "root" else second
        braked = p.braking * (1.0 - BRAKING[self.variant] * first * first) * driven
        return {"state_1": p.rate_factor * second, "state_2": -STIFFNESS * first + braked}

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        mixed = 0.2 * np.sin(x.state_1) + x.state_2
        return ({"mixed": mixed, "speed": x.state_2, "root": x.state_1}[self.variant],)

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        return {"x1": x.state_1, "x2": x.state_2, "y": self.measured(x, p)[0]}


def tanh_term(first: Array, second: Array, reading: Reading) -> Array:
    """The term with tanh, of one of the readings, without its factor.

    Args:
        first, second: states x1 [1] and x2 [1/s]. reading: see `TanhSystem`.
    """
    if reading == "product":
        return np.tanh(first * second)
    return (-1.0 if reading == "minus" else 1.0) * np.tanh(first) * second

"""Second-order oscillator, two unknown constants behind time-varying regressors. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state

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
    internal_step = 1e-3
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

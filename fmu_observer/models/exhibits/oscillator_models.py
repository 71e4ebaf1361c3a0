"""Models of the second-order time-varying oscillator with two unknown constants. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.state_affine import StateAffineModel
from plant_models.hybrid import Array, input_signal, state, vector

_PULSATION = 20.0  # [rad/s], w1
_DRIVE = 10.0  # size of the printed drive, u = 10 sin t


def time_varying_oscillator(excitation: str = "fading") -> StateAffineModel:
    """``dx1 = x2 + sin(w1 t) rho1``, ``dx2 = -x1 + g(t) rho2 + (2 + tanh t) u``, ``y = x1``: Hann 2014, (4.64).

    Args:
        excitation: ``fading``, ``g = cos(w1 t) / (1 + t^2)`` as printed, which does not excite for long; or
            ``lasting``, ``g = sin(w1 t)`` [ours]; cos would show in the output in phase with the first, so that the two
            could not be distinguished.
    """
    return StateAffineModel(
        name="time_varying_oscillator" if excitation == "fading" else "excited_oscillator",
        description=f"Time-varying oscillator with two unknown constants, {excitation} excitation of the second",
        source="Hann 2014, (4.64)" + ("" if excitation == "fading" else ", excitation ours"),
        states=(state("x1", "1", 0.0, "First state"), state("x2", "1", 0.0, "Second state")),
        inputs=(input_signal("drive", "1", 0.0, "Added to the known drive 10 sin t"),),
        measurements=(input_signal("x1", "1", 0.0, "First state"),),
        unknowns=(
            state("rho1", "1", 0.0, "First unknown constant"),
            state("rho2", "1", 0.0, "Second unknown constant"),
        ),
        drift=lambda _t, _u: np.array([[0.0, 1.0], [-1.0, 0.0]]),
        drive=lambda t, u: vector(0.0, (2.0 + np.tanh(t)) * (_DRIVE * np.sin(t) + u[0])),
        regressor=_fading if excitation == "fading" else _lasting,
        C=np.array([[1.0, 0.0]]),
        example=(20.0, -40.0, 10.0, 20.0),
    )


def _fading(t: Array, _u: Array) -> Array:
    return _diagonal(np.sin(_PULSATION * t), np.cos(_PULSATION * t) / (1.0 + t * t))


def _lasting(t: Array, _u: Array) -> Array:
    return _diagonal(np.sin(_PULSATION * t), np.sin(_PULSATION * t))


def _diagonal(first: Array, second: Array) -> Array:
    return np.vstack([np.hstack([first, 0.0]), np.hstack([0.0, second])])

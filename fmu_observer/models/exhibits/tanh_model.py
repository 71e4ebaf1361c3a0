"""The second-order plant with a hyperbolic tangent as its observers see it: x1 at samples. Data only."""

from __future__ import annotations

from functools import partial

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.exhibits.oscillators import Reading, tanh_term
from plant_models.hybrid import Array, input_signal, state, vector

_STIFFNESS = 0.1  # [1/s2]
_LARGEST_SECOND = 3.2  # of x2, on the orbit through (5, 3)


def tanh_system(reading: Reading = "minus") -> ObserverModel:
    """``dx1 = x2``, ``dx2 = -0.1 x1 - tanh(x1) x2``, x1 is measured: Hann 2014, (3.110).

    The thesis asks for a globally Lipschitz remainder; the slope ``sech^2(x1) x2`` is none. Slopes and Lipschitz
    constant here are those of ``|x2| <= 3.2``, which is the orbit from the printed start (5, 3); the other readings
    have none.

    Args:
        reading: which term with tanh, see the plant of this name.
    """
    slopes = tuple(
        np.array([[0.0, 0.0], [-_STIFFNESS + steep, across]])
        for steep in (-_LARGEST_SECOND, _LARGEST_SECOND)
        for across in (-1.0, 1.0)
    )
    return ObserverModel(
        name="tanh_system" if reading == "minus" else f"tanh_system_{reading}",
        description="Second-order plant with tanh(x1) x2, x1 measured",
        source="Hann 2014, (3.110)",
        states=(state("x1", "1", 0.0, "State x1"), state("x2", "1/s", 0.0, "State x2, derivative of x1")),
        inputs=(),
        measurements=(input_signal("x1", "1", 0.0, "Measured x1"),),
        A=shift_matrix(2),
        B=np.zeros((2, 0)),
        C=np.array([[1.0, 0.0]]),
        phi=partial(_remainder, reading),
        slopes=slopes if reading == "minus" else (),
        sample_period=0.15,
    )


def _remainder(reading: Reading, x: Array, _u: Array) -> Array:
    first, second = x
    return vector(0.0, -_STIFFNESS * first + tanh_term(first, second, reading))

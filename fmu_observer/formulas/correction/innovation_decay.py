"""How much of a sampled innovation still acts a while after its sample, in closed form. A pure function."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array, Signal, parameter, state

_NOTHING = 1e-300  # in place of zero, of which a power has no derivative by its exponent
ELAPSED = state("elapsed", "s", 0.0, "Time since the last sample")


def decay_parameters(rate: float, exponent: float) -> tuple[Signal, Signal]:
    """The parameters `decay_rate` and `decay_exponent` of `innovation_left`.

    Args:
        rate: default [1/s]. exponent: default [1].
    """
    return (
        parameter("decay_rate", "1/s", rate, "Decay eta of the innovation; zero holds it until the next", min=0.0),
        parameter("decay_exponent", "1", exponent, "Exponent a of the decay, 1 for an exponential", min=0.0, max=1.0),
    )


def innovation_left(elapsed: Array, rate: Array, exponent: Array) -> Array:
    """phi of ``phi' = -eta phi^a``, ``phi = 1`` at the sample: Hann 2014, (3.72b).

    ``exp(-eta s)`` for a = 1, else ``max(0, 1 - (1 - a) eta s)^(1/(1 - a))``, which ends at ``s = 1/((1 - a) eta)``. An
    integrator would go below zero there, where phi^a is no number.

    Args:
        elapsed: time s since the sample [s]. rate: eta [1/s], zero for an innovation that is held. exponent: a, from 0
            to 1.
    """
    ending = np.where(exponent < 1.0, 1.0 - exponent, 1.0)
    linear = np.maximum(1.0 - ending * rate * elapsed, _NOTHING)
    return np.where(exponent < 1.0, linear ** (1.0 / ending), np.exp(-rate * elapsed))

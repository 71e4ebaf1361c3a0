"""Corrections by a sampled innovation: the gain that decays after a sample, and how much of the innovation still acts,
in closed form. Pure functions.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array, Signal, parameter, state

# K = inv(P) C' with P + A'P + P A = C'C, A the shift matrix: Bouchama 2024, (3.29) with A for Abar
HIGH_GAIN_K = (2.0, 1.0)


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


def correction(theta: Array, K: Array, innovation: Array) -> tuple[Array, Array]:
    """Correction ``theta inv(Delta) K eta`` of a second-order observer: Bouchama 2024, (1.47), (3.26).

    Args:
        theta: gain [1/s]. K: shape (2,). innovation: decaying innovation eta, unit of the measured state.

    Returns:
        The two terms to subtract from the derivatives: ``theta K1 eta`` and ``theta^2 K2 eta``.
    """
    return theta * K[0] * innovation, theta * theta * K[1] * innovation


def innovation_decay(theta: Array, K: Array, innovation: Array) -> Array:
    """Derivative of the decaying innovation, ``-theta K1 eta``: Bouchama 2024, (1.47) with K^1 in the exponent."""
    return -theta * K[0] * innovation

"""The high-gain continuous-discrete correction with its gain decaying since the last sample. Pure functions.

The gain ``exp(-theta K1 (t - t_k))`` times the innovation at ``t_k`` is one scalar state: it decays at the rate theta
K1 and is reset at every sample. Written so, the observer is identical to the output predictor, and no time stamp is
stored.
"""

from __future__ import annotations

from plant_models.hybrid import Array

# K = inv(P) C' with P + A'P + P A = C'C, A the shift matrix: Bouchama 2024, (3.29) with A for Abar
HIGH_GAIN_K = (2.0, 1.0)


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

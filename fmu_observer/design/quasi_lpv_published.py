"""The two printed designs of the quasi-LPV unknown-input observer, and the vertices they were made for. Data and NumPy.

Aguiar Cota 2019, sections 3.3.4 and 5.3.1. Loads nothing that is heavy: observers take their presets from here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.design.extended_disturbance import extended_matrices


@dataclass(frozen=True)
class QuasiLpvDesign:
    """A printed design, per unit mass.

    Attributes:
        section: of the thesis. davis_a: w0 [m/s2]. davis_b: w1 [1/s]. davis_c: w2 [1/m], of the observer's model.
        low, high: speeds of the vertices [m/s].
        gain_low, gain_high: effective gains K_1 and K_2 of the state [v, d, d'], subtracted from nothing: ``dxh = ... +
            K (y - yh)``; units 1/s, 1/s2, 1/s3.
        residual_gain: M of ``r = M (y - yh)``. threshold: of |r| in that section, as far as one is printed for it.
        disturbance: D, where the unknown input enters the error, shape (3,). alpha: bound of K' P K.
        attenuation: printed lambda. sensitivity: printed gamma.
    """

    section: str
    davis_a: float
    davis_b: float
    davis_c: float
    low: float
    high: float
    gain_low: tuple[float, float, float]
    gain_high: tuple[float, float, float]
    residual_gain: float
    threshold: float
    disturbance: tuple[float, float, float]
    alpha: float
    attenuation: float
    sensitivity: float

    @property
    def vertices(self) -> np.ndarray:
        """``A_1`` at the low and ``A_2`` at the high speed, shape (2, 3, 3), of (3.36)."""
        return quasi_lpv_vertices(self.davis_b, self.davis_c, self.low, self.high)

    @property
    def gains(self) -> np.ndarray:
        """``K_1`` and ``K_2``, shape (2, 3, 1)."""
        return np.array([self.gain_low, self.gain_high])[:, :, None]

    @property
    def errors(self) -> np.ndarray:
        """``A_i - K_i C``, shape (2, 3, 3)."""
        return np.asarray(self.vertices - self.gains @ SEEN)


SEEN = np.array([[1.0, 0.0, 0.0]])
"""C of (3.36): the speed is measured."""


def quasi_lpv_vertices(davis_b: float, davis_c: float, low: float, high: float) -> np.ndarray:
    """``A(z) = [[-w1 - w2 z, -1, 0], [0, 0, 1], [0, 0, 0]]`` at the two ends of the speed range, shape (2, 3, 3).

    Aguiar Cota 2019, (3.35)-(3.43): state [v, d_R, d_R'], the resisting disturbance enters with a minus sign.

    Args:
        davis_b: w1 [1/s]. davis_c: w2 [1/m]. low, high: speeds of the vertices [m/s].
    """
    return np.stack(
        [extended_matrices(np.array([[-davis_b - davis_c * z]]), -np.eye(1), np.eye(1), 2)[0] for z in (low, high)]
    )


SECTION_3_3_4 = QuasiLpvDesign(
    section="3.3.4",
    davis_a=0.016,
    davis_b=0.0024,
    davis_c=-0.000192,
    low=0.0,
    high=50.0,
    gain_low=(1.15, -1.216, -0.405),
    gain_high=(1.16, -1.215, -0.404),
    residual_gain=2.3,
    threshold=0.9,
    disturbance=(0.01, 0.0, 0.0),
    alpha=1.0,
    attenuation=0.031,
    sensitivity=1.58,
)
"""Simulation of 3.3.4: the train of set B, the observer's coefficients 20 % below."""

SECTION_5_3_1 = QuasiLpvDesign(
    section="5.3.1",
    davis_a=0.46,
    davis_b=5.7e-3,
    davis_c=-2.4e-4,
    low=0.0,
    high=50.0,
    gain_low=(2.41, -1.34, -0.22),
    gain_high=(2.41, -1.33, -0.22),
    residual_gain=3.36,
    threshold=0.65,
    disturbance=(1.0, 0.0, 0.0),
    alpha=0.2,
    attenuation=0.1,
    sensitivity=2.32,
)
"""Validation of chapter 5, set D; the threshold is that of high speed with the electric brake."""

PUBLISHED = {"section_3_3_4": SECTION_3_3_4, "section_5_3_1": SECTION_5_3_1}
"""Both by name."""

"""Cubic Hermite interpolation of a position over a step, and its crossings, without branching on values.

Plain NumPy on numbers, batches and traced symbols; knows nothing of trains and balises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

HALVINGS = 6  # bring the bracket to 1/64 of the step
PARABOLAS = 5  # each triples the digits


class HermiteCubic(NamedTuple):
    """``p(s) = p0 + s (slope + s (square + s cubic))`` over a step, with s from 0 to 1.

    Args:
        p0: position at the start [m]. slope, square, cubic: coefficients [m].
    """

    p0: Array
    slope: Array
    square: Array
    cubic: Array

    @classmethod
    def of(cls, h: Array, p0: Array, v0: Array, p1: Array, v1: Array) -> HermiteCubic:
        """From positions [m] and speeds [m/s] at both ends of a step of length `h` [s].

        Args:
            h: length of the step [s]. p0, v0: position [m] and speed [m/s] at its start. p1, v1: at its end.
        """
        rise = p1 - p0
        return cls(p0, h * v0, 3.0 * rise - h * (2.0 * v0 + v1), h * (v0 + v1) - 2.0 * rise)

    def rise(self, s: Array) -> Array:
        """Position minus `p0` [m]."""
        return s * (self.slope + s * (self.square + s * self.cubic))

    def rate(self, s: Array) -> Array:
        """Derivative of the position by s [m]."""
        return self.slope + s * (2.0 * self.square + 3.0 * self.cubic * s)

    def turn(self) -> Array:
        """Where the train turns: s in (0, 1) if it moves one way at the start and the other way at the end, else 1."""
        a, b, c = 3.0 * self.cubic, 2.0 * self.square, self.slope
        root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
        divisor = np.where(c > 0.0, root, -root) - b
        turns = self.slope * self.rate(1.0) < 0.0
        return np.where(turns, np.clip(2.0 * c / np.where(turns, divisor, 1.0), 0.0, 1.0), 1.0)

    def crossing(self, target: Array, direction: Array, low: Array, high: Array) -> Array:
        """Where the position reaches a target: s in ``[low, high]``.

        Bisection first, then steps to the zero of the parabola that touches the cubic (Cauchy's method), clipped to the
        bracket that shrinks with them. Newton's tangents would need 25 steps where a train comes to rest on the target,
        a double zero; the parabola has it at once, and everything under constant acceleration.

        Args:
            target: position [m], reached between the ends of the bracket. direction: 1 where it is reached upwards, -1
                downwards. low, high: the bracket.
        """
        distance = target - self.p0
        s = 0.5 * (low + high)
        for i in range(HALVINGS + PARABOLAS):
            excess = direction * (self.rise(s) - distance)
            high, low = np.where(excess >= 0.0, s, high), np.where(excess >= 0.0, low, s)
            middle = 0.5 * (low + high)
            s = middle if i < HALVINGS else self._improved(s, excess, direction, low, high)
        return s

    def _improved(self, s: Array, excess: Array, direction: Array, low: Array, high: Array) -> Array:
        rate, curvature = direction * self.rate(s), direction * (2.0 * self.square + 6.0 * self.cubic * s)
        divisor = rate + np.sqrt(np.maximum(rate * rate - 2.0 * excess * curvature, 0.0))
        usable = divisor > 0.0  # else the cubic stands here, or runs backwards
        zero = s - 2.0 * excess / np.where(usable, divisor, 1.0)
        return np.where(usable, np.clip(zero, low, high), 0.5 * (low + high))

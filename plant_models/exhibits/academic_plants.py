"""Academic plants of chapter 2: four states with one nonlinear damping, and five. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state


class _DrivenPlant(HybridSystem):
    """The states and the drive that acts are the outputs."""

    inputs = (input_signal("drive", "1", 0.0, "Added to the printed drive", optional=True),)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {f"x{i}": value for i, value in enumerate(x, start=1)} | {"total_drive": self._drive(t, u, p)}

    @staticmethod
    def _drive(t: Array, u: Any, p: Any) -> Array:
        raise NotImplementedError


class NonTriangularisablePlant(_DrivenPlant):
    """Five states with ``a = 1/(1 + x4^2)`` in row 3 and the product ``x1 x2`` in row 4: Bouchama 2024, (2.43)-(2.48).

    The input matrix is the five-vector of the printed vertices, ``[1 0 1 -0.3a -1]'``. Driven by the printed
    ``u = 5 sin(2 pi t)`` times `drive_gain`, plus the input `drive`; the drive that acts is an output, for the
    observer. Starts in zero.
    """

    name = "non_triangularisable_plant"
    description = "Second academic plant of chapter 2: five states, no triangular form"
    source = "Bouchama 2024, section 2.5.2"
    states = tuple(state(f"state_{i}", "1", 0.0, f"State {i}") for i in (1, 2, 3, 4, 5))
    outputs = (
        *(output_signal(f"x{i}", "1", f"State {i}") for i in (1, 2, 3, 4, 5)),
        output_signal("total_drive", "1", "Drive u that acts"),
    )
    parameters = (parameter("drive_gain", "1", 1.0, "Size of the printed drive"),)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        x1, x2, x3, x4, x5 = x
        a = 1.0 / (1.0 + x4 * x4)
        drive = self._drive(t, u, p)
        return {
            "state_1": -x1 + x2 + drive,
            "state_2": -x2 + x3,
            "state_3": -x2 - x3 - a * x5 + drive,
            "state_4": -x1 * x2 - x4 + x5 - 0.3 * a * drive,
            "state_5": -x2 - x3 - x5 - drive,
        }

    @staticmethod
    def _drive(t: Array, u: Any, p: Any) -> Array:
        return p.drive_gain * 5.0 * np.sin(2.0 * np.pi * t) + u.drive


class TriangularisablePlant(_DrivenPlant):
    """Four states whose last is damped by ``3.3 (sin x1 + x2^2)``: Bouchama 2024, (2.40)-(2.41).

    Its error equations can be brought to triangular form, so high-gain observers apply as well. Driven by the printed
    ``u = sin t - sin 7t`` times `drive_gain`, plus the input `drive`; the drive that acts is an output, for the
    observer. It starts at ones.
    """

    name = "triangularisable_plant"
    description = "First academic plant of chapter 2: four states, one nonlinear damping"
    source = "Bouchama 2024, section 2.5.1"
    states = tuple(state(f"state_{i}", "1", 1.0, f"State {i}") for i in (1, 2, 3, 4))
    outputs = (
        *(output_signal(f"x{i}", "1", f"State {i}") for i in (1, 2, 3, 4)),
        output_signal("total_drive", "1", "Drive u that acts"),
    )
    parameters = (
        parameter("drive_gain", "1", 1.0, "Size of the printed drive"),
        parameter("damping_gain", "1", 3.3, "Factor of sin(x1) + x2^2"),
    )

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        x1, x2, x3, x4 = x
        damping = p.damping_gain * (np.sin(x1) + x2 * x2)
        return {
            "state_1": -1.25 * x1 - 48.6 * x2 + x3 + 21.6 * self._drive(t, u, p),
            "state_2": x1 + x4,
            "state_3": x2,
            "state_4": -19.5 * x2 - 19.5 * x3 - damping * x4,
        }

    @staticmethod
    def _drive(t: Array, u: Any, p: Any) -> Array:
        return p.drive_gain * (np.sin(t) - np.sin(7.0 * t)) + u.drive

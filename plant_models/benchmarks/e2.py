"""Second academic plant of chapter 2: five states, no triangular form. Knows only the hybrid foundation."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state, vector
from plant_models.hybrid.system import Array


class NonTriangularisablePlant(HybridSystem):
    """Five states with ``a = 1/(1 + x4^2)`` in row 3 and the product ``x1 x2`` in row 4: Bouchama 2024, (2.43)-(2.48).

    The input matrix is the five-vector of the printed vertices, ``[1 0 1 -0.3a -1]'``. Driven by the printed
    ``u = 5 sin(2 pi t)`` times `drive_gain`, plus the input `drive`; the drive that acts is an output, for the
    observer. Starts in zero.
    """

    name = "non_triangularisable_plant"
    description = "Second academic plant of chapter 2: five states, no triangular form"
    source = "Bouchama 2024, section 2.5.2"
    internal_step = 1e-3
    states = tuple(state(f"state_{i}", "1", 0.0, f"State {i}") for i in (1, 2, 3, 4, 5))
    inputs = (input_signal("drive", "1", 0.0, "Added to the printed drive", optional=True),)
    outputs = (
        *(output_signal(f"x{i}", "1", f"State {i}") for i in (1, 2, 3, 4, 5)),
        output_signal("total_drive", "1", "Drive u that acts"),
    )
    parameters = (parameter("drive_gain", "1", 1.0, "Size of the printed drive"),)

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Derivatives of the five states, shape (5,)."""
        a = 1.0 / (1.0 + x[3] * x[3])
        drive = self._drive(t, u, p)
        return vector(
            -x[0] + x[1] + drive,
            -x[1] + x[2],
            -x[1] - x[2] - a * x[4] + drive,
            -x[0] * x[1] - x[3] + x[4] - 0.3 * a * drive,
            -x[1] - x[2] - x[4] - drive,
        )

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """The states and the drive."""
        return {f"x{i + 1}": x[i] for i in range(5)} | {"total_drive": self._drive(t, u, p)}

    @staticmethod
    def _drive(t: Array, u: Any, p: Any) -> Array:
        return p.drive_gain * 5.0 * np.sin(2.0 * np.pi * t) + u.drive

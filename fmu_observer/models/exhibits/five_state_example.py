"""Second academic example of chapter 2: five states, no triangular form. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from plant_models.hybrid import Array, input_signal, state


def non_triangularisable_example() -> TakagiSugenoModel:
    """Five states, premises ``a = 1/(1 + x4^2)`` in [0, 1] and x1 in [-1, 2]; x4 sampled, x1 continuous.

    Bouchama 2024, (2.43)-(2.48). The input matrix is the five-vector of the vertices, ``[1 0 1 -0.3a -1]'``; (2.43)
    prints four entries. G is kept on row 5 as printed, although the disturbance ``v x2`` enters row 4, so that its
    gains can be compared.
    """
    return sector_nonlinearity(
        premises=(
            Premise("ratio", "1", 0.0, 1.0, _ratio, "1 / (1 + x4^2)"),
            Premise("first", "1", -1.0, 2.0, _first, "x1"),
        ),
        A=lambda f: [
            [-1.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, -1.0, 1.0, 0.0, 0.0],
            [0.0, -1.0, -1.0, 0.0, -f[0]],
            [0.0, -f[1], 0.0, -1.0, 1.0],
            [0.0, -1.0, -1.0, 0.0, -1.0],
        ],
        B=lambda f: [[1.0], [0.0], [1.0], [-0.3 * f[0]], [-1.0]],
        name="non_triangularisable_example",
        description="Five states with two premises, second example of chapter 2",
        source="Bouchama 2024, section 2.5.2",
        states=tuple(state(f"x{i}", "1", 1.0, f"State {i}") for i in (1, 2, 3, 4, 5)),
        inputs=(input_signal("drive", "1", 0.0, "Known input u"),),
        sampled=(input_signal("x4", "1", 0.0, "Sampled output"),),
        continuous=(input_signal("x1", "1", 0.0, "Continuous output"),),
        C_sampled=np.eye(5)[3:4],
        C_continuous=np.eye(5)[:1],
        G=np.eye(5)[:, 4:],
        max_gap=0.4,
    )


def _ratio(x: Array, _u: Array) -> Array:
    _, _, _, x4, _ = x
    return 1.0 / (1.0 + x4 * x4)


def _first(x: Array, _u: Array) -> Array:
    first, *_ = x
    return first

"""Academic examples of chapter 2: four states that can be brought to triangular form, five that cannot. Data only."""

from __future__ import annotations

import numpy as np

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from fmu_observer.models.sector_vertices import sector_nonlinearity
from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel
from plant_models.hybrid import Array, input_signal, state, vector

_LARGEST_PREMISE = 5.0  # sum of the printed bounds, 1 of sin(y1) and 4 of y2^2
_STATES = tuple(state(f"x{i}", "1", 0.0, f"State {i}") for i in (1, 2, 3, 4))
_INPUTS = (input_signal("drive", "1", 0.0, "Known input u"),)
_FIRST = input_signal("x1", "1", 0.0, "First output")
_SECOND = input_signal("x2", "1", 0.0, "Second output")
_SOURCE = "Bouchama 2024, section 2.5.1"


def triangularisable_example() -> TakagiSugenoModel:
    """``dx4 = -19.5 x2 - 19.5 x3 - 3.3 (sin x1 + x2^2) x4`` behind three linear rows, x1 sampled, x2 continuous.

    Bouchama 2024, section 2.5.1. The premise ``sin(y1) + y2^2`` has the printed bounds -5 and 5; the print uses -4 and
    4 for y2^2, which cannot be negative, and its gains belong to these vertices.
    """
    return sector_nonlinearity(
        premises=(Premise("damping", "1", -_LARGEST_PREMISE, _LARGEST_PREMISE, _damping, "sin(x1) + x2^2"),),
        A=lambda f: [
            [-1.25, -48.6, 1.0, 0.0],
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, -19.5, -19.5, -3.3 * f[0]],
        ],
        B=lambda _f: [[21.6], [0.0], [0.0], [0.0]],
        name="triangularisable_example",
        description="Four states with one premise, first example of chapter 2",
        source=_SOURCE,
        states=_STATES,
        inputs=_INPUTS,
        sampled=(_FIRST,),
        continuous=(_SECOND,),
        C_sampled=np.eye(4)[:1],
        C_continuous=np.eye(4)[1:2],
        G=np.eye(4)[:, 3:],
        max_gap=0.2,
        scaling=(1.0, 1.0, 0.3, 1.0 / 60.0),
    )


def triangularisable_chain() -> ObserverModel:
    """The same plant as a chain of two blocks of two, both outputs sampled: Bouchama 2024, (2.42).

    ``dx = A x + g(x) + B u`` with A the block shift; x3 in row 1 and x4 in row 2 come from it.
    """
    return ObserverModel(
        name="triangularisable_chain",
        description="First example of chapter 2 as a chain of two blocks",
        source="Bouchama 2024, (2.42)",
        states=_STATES,
        inputs=_INPUTS,
        measurements=(_FIRST, _SECOND),
        A=shift_matrix(2, 2),
        B=np.array([[21.6], [0.0], [0.0], [0.0]]),
        C=np.eye(4)[:2],
        phi=_remainder,
        sample_period=0.2,
    )


def _damping(x: Array, _u: Array) -> Array:
    x1, x2, *_ = x
    return np.sin(x1) + x2 * x2


def _remainder(x: Array, _u: Array) -> Array:
    x1, x2, x3, x4 = x
    damping = 3.3 * _damping(x, _u)
    return vector(-1.25 * x1 - 48.6 * x2, 1.0 * x1, 1.0 * x2, -19.5 * x2 - 19.5 * x3 - damping * x4)


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

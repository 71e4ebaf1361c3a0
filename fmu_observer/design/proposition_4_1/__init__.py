"""Proposition 4-1: gains of an observer with a held measurement, and the matrices that its bounds rest on, by linear
matrix inequalities. Solving needs the extra `lmi`.
"""

from fmu_observer.design.proposition_4_1.proposition_design import (
    InfeasibleBounds,
    Proposition41Design,
    design_proposition_4_1,
)
from fmu_observer.design.proposition_4_1.proposition_inequalities import Proposition41Problem, train_vertices
from fmu_observer.design.proposition_4_1.sharpest import BoundMatrix, bound_matrix

__all__ = [
    "BoundMatrix",
    "InfeasibleBounds",
    "Proposition41Design",
    "Proposition41Problem",
    "bound_matrix",
    "design_proposition_4_1",
    "train_vertices",
]

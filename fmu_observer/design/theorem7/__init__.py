"""Theorem 7: gains of Takagi-Sugeno observers by linear matrix inequalities. Solving needs the extra `lmi`."""

from fmu_observer.design.theorem7.theorem7_design import (
    InfeasibleDesign,
    Theorem7Design,
    design_theorem7,
    largest_eta,
    largest_gap,
    search_eta,
)

__all__ = [
    "InfeasibleDesign",
    "Theorem7Design",
    "design_theorem7",
    "largest_eta",
    "largest_gap",
    "search_eta",
]

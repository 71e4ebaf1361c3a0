"""Bounds of the error of an observer whose measurement is held between samples: formulas, largest gaps, the
exact worst case.
"""

from fmu_observer.certificates.bounds.bounded_gaps import largest_gap
from fmu_observer.certificates.bounds.error_bounds import ErrorBounds
from fmu_observer.certificates.bounds.formulas import (
    cdo_bound,
    comparison_bound,
    dmo_bound,
    improved_cdo_bound,
    improved_dmo_bound,
    printed_cdo_bound,
)
from fmu_observer.certificates.bounds.worst_case import WorstCase, worst_case

__all__ = [
    "ErrorBounds",
    "WorstCase",
    "cdo_bound",
    "comparison_bound",
    "dmo_bound",
    "improved_cdo_bound",
    "improved_dmo_bound",
    "largest_gap",
    "printed_cdo_bound",
    "worst_case",
]

"""Bounds of the error of an observer whose measurement is held between samples: formulas, growth, largest gaps, the
exact worst case.
"""

from fmu_observer.certificates.bounds.bounded_gaps import growth_over_missing_samples, largest_gap
from fmu_observer.certificates.bounds.error_bounds import BoundRow, ErrorBounds, bound_data, bound_text
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
    "BoundRow",
    "ErrorBounds",
    "WorstCase",
    "bound_data",
    "bound_text",
    "cdo_bound",
    "comparison_bound",
    "dmo_bound",
    "growth_over_missing_samples",
    "improved_cdo_bound",
    "improved_dmo_bound",
    "largest_gap",
    "printed_cdo_bound",
    "worst_case",
]

"""Certificates: exact stability checks of sampled observers, recomputed in NumPy and never taken from a solver's status."""

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.certificate import Certificate
from fmu_observer.certificates.quadratic import QuadraticForm, common_quadratic_form, decrease
from fmu_observer.certificates.sample_products import TwoRateError, certify_two_rate_error
from fmu_observer.certificates.sampled_error import SampledError, first_unstable_gap

__all__ = [
    "Certificate",
    "QuadraticForm",
    "SampledError",
    "TwoRateError",
    "certify_sampled_error",
    "certify_two_rate_error",
    "common_quadratic_form",
    "decrease",
    "first_unstable_gap",
]

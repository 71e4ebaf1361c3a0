"""Certificates: exact stability checks of sampled observers, recomputed in NumPy and never taken from a solver's
status.
"""

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.certificate import Certificate
from fmu_observer.certificates.decaying_error import DecayingError, decaying_error
from fmu_observer.certificates.gap_error import GapError, first_unstable_gap
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.polytope import PolytopeStability, polytope_stability
from fmu_observer.certificates.quadratic import QuadraticForm, common_quadratic_form, decrease
from fmu_observer.certificates.riccati_error import RiccatiError
from fmu_observer.certificates.sample_products import TwoRateError, certify_two_rate_error
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.certificates.small_gain import independent_gap_limit, with_independent_samples

__all__ = [
    "Certificate",
    "DecayingError",
    "GapError",
    "ImpulsiveError",
    "PolytopeStability",
    "QuadraticForm",
    "RiccatiError",
    "SampledError",
    "TwoRateError",
    "certify_sampled_error",
    "certify_two_rate_error",
    "common_quadratic_form",
    "decaying_error",
    "decrease",
    "first_unstable_gap",
    "independent_gap_limit",
    "polytope_stability",
    "with_independent_samples",
    "with_switching_noted",
]

"""Residual generators that stand disturbances and show faults, by linear matrix inequalities. Solving needs the extra
`lmi`.

Aguiar Cota 2019, (3.44)-(3.58), Algorithm 3-2, repaired: a decay rate in the first step, M fixed, the inequality of the
second step with its signs.
"""

from fmu_observer.design.robust_residual.fault_sensitivity import ResidualSensitivity, common_bands, proven_sensitivity
from fmu_observer.design.robust_residual.problem import ResidualProblem
from fmu_observer.design.robust_residual.residual_design import (
    InfeasibleResidualDesign,
    RobustResidualDesign,
    design_robust_residual,
    gain_size,
    proven_attenuation,
)

__all__ = [
    "InfeasibleResidualDesign",
    "ResidualProblem",
    "ResidualSensitivity",
    "RobustResidualDesign",
    "common_bands",
    "design_robust_residual",
    "gain_size",
    "proven_attenuation",
    "proven_sensitivity",
]

"""The stability of a polytope of errors as the condition of an observer. A few words around numbers."""

from __future__ import annotations

from fmu_observer.certificates import PolytopeStability
from fmu_observer.condition import Condition

STATEMENT = "one P > 0 makes A_i' P + P A_i + 2 decay P < 0 for the error A_i - K_i C at every vertex (decay > 0)"


def polytope_condition(found: PolytopeStability, source: str) -> Condition:
    """What a Lyapunov function proves of the errors at the vertices, as a condition.

    Args:
        found: of `polytope_stability`. source: equation or theorem.

    Returns:
        With ``abscissa`` [1/s], and where it holds ``decay`` [1/s] and ``overshoot`` [1].
    """
    values = {"abscissa": found.abscissa}
    if found.holds:
        values |= {"decay": found.decay, "overshoot": found.overshoot}
    return Condition(found.holds, values, STATEMENT, source)

"""Settings of the iteration of loops."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class IterationSettings:
    """How loops are iterated within a communication step.

    Args:
        method: ``fixed-point``, ``aitken`` or ``newton``.
        max_iterations: sweeps in one step, after which the run fails.
        relative_tolerance, absolute_tolerance: a fed-back value has settled when one more sweep moves it by no more
            than ``absolute + relative * |value|``; the absolute one is in the value's own unit.
        relaxation: of ``fixed-point``, and the first one of ``aitken``.
    """

    method: str = "newton"
    max_iterations: int = 50
    relative_tolerance: float = 1e-9
    absolute_tolerance: float = 1e-12
    relaxation: float = 1.0

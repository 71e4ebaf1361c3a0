"""Partial inversion with an unknown rate: the gas-phase reaction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.observers.parameter_values import Value
from fmu_observer.observers.signature.signature_observer import Inverted, SignatureObserver
from fmu_observer.signatures.inversion import (
    Found,
    best_candidate,
    corrected_inverse,
    interpolated,
    monotone_inverse,
    require_monotone,
)
from fmu_observer.signatures.pencil import NextScaling
from plant_models.benchmarks.gas_phase_reaction import GasPhaseReaction
from plant_models.hybrid import memory, output_signal, parameter
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.system import Array

ORDER, POINTS = 2, 9  # printed N; N_O = 11
LARGEST = 3.0  # printed set [0, 3]^2
RATES = (0.10, 0.35)  # printed range of b [1/s]


class _Model(NamedTuple):
    """Parameters of the equations, with candidates in place of the rate."""

    rate: Array
    sample_period: Array


class ReactionSignature(SignatureObserver):
    """Reduced signature observer of `gas_phase_reaction`, the rate b unknown: Omar 2012, section 4.8, (4.8.1)-(4.8.6).

    For each candidate of b, ``r1 = min xi`` gives x1 and ``r2 = min eta`` then gives x2; the candidate whose output
    fits the window best is taken, and the residuals are interpolated between neighbours. Two unknowns less remain for
    the search. With N = 2 all points lie on a line, and eta is the weight of the second vertex (see `polygon`).

    Repaired. 1. The table is built once, at the middle of the range, in ``sqrt(-r1 / b)``, which is nearly
    proportional to x1 for every b; the thesis tabulates r1. 2. Five nodes an axis are too few for linear interpolation:
    J_r then has its minimum up to 0.16 1/s away from b. Each look-up is corrected `corrections` times by the model;
    with six the minimum stands at b. 3. ``literal`` scaling: with ``norm`` r1 depends on x2 as much as on x1.

    With samples each 0.01 s the problem is so ill-conditioned that noise of 1e-3 on y moves x1 by 1.3; samples each
    0.1 s (preset `wide_samples` of the plant) are needed with noise.

    Args:
        candidates: of the rate, evenly over [0.10, 0.35] 1/s; the printed search has steps of 0.025, which is 11.
        corrections: of each look-up. nodes: of the table, an axis. next_scaling: see above.

    Raises:
        ValueError: an option is no whole number or out of bounds, or the table cannot be inverted.
    """

    name = "reaction_signature"
    description = "Signature observer of the gas-phase reaction, its rate unknown"
    source = "Omar 2012, (4.8.1)-(4.8.6)"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "candidates": range(3, 12),
        "corrections": range(7),
        "nodes": range(4, 14),
        "next_scaling": ("literal", "norm"),
    }

    def __init__(
        self, candidates: int = 6, corrections: int = 4, nodes: int = 5, next_scaling: NextScaling = "literal"
    ) -> None:
        require_whole(self.name, 3, 11, candidates=candidates)
        require_whole(self.name, 0, 6, corrections=corrections)
        require_whole(self.name, 4, 13, nodes=nodes)
        self.corrections = corrections
        self.rates = np.linspace(*RATES, candidates)
        self.nodes = np.linspace(0.0, LARGEST, nodes)
        middle = float(np.mean(RATES))
        self.scaling = next_scaling
        table = self.built(1e-2, 1e-2)
        self.declare(
            GasPhaseReaction(),
            ORDER + POINTS,
            next_scaling,
            gain=0.2,
            eps=1e-2,
            own_parameters=(
                parameter(
                    "table", "1", tuple(table), "sqrt(-r1 / b) over x1, then r2 over x1 and x2", size=len(table)
                ),
            ),
            own_memory=(
                memory("estimated_rate", "1/s", middle, "Estimate: rate of the reaction"),
                memory("looked_up_rate", "1/s", middle, "Of the signature: rate of the reaction"),
            ),
            own_outputs=(
                output_signal("rate", "1/s", "Estimate: rate of the reaction", variability="discrete"),
                output_signal("rate_look_up", "1/s", "Of the window alone: rate", variability="discrete"),
            ),
            known=("rate",),
        )
        super().__init__(candidates=candidates, corrections=corrections, nodes=nodes, next_scaling=next_scaling)

    @cached_property
    def _equations(self) -> GasPhaseReaction:
        return GasPhaseReaction()

"""Directional derivatives of a block: how its outputs and derivatives change with time, inputs, states and parameters,
exactly.

One evaluation of the traced tangent with the whole seed vector, as in the exported FMU.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from math import isfinite

import numpy as np
from fmpy.model_description import ModelVariable

from fmu_observer.block.block_variables import BlockError
from fmu_observer.description import VariableTable, exposed_inputs, referenced
from plant_models.hybrid import HybridSystem, Runtime, TracedSystem, traced_once, width
from plant_models.hybrid.casadi_package import demand_casadi


class BlockSensitivity:
    """Exact directional derivatives of one system.

    Args:
        system: the hybrid system.
        variables: all variables of its description, in their order.
    """

    def __init__(self, system: HybridSystem, variables: Sequence[ModelVariable]) -> None:
        self.system, self.variables = system, variables
        self._table = VariableTable.of(system)

    def directional(
        self, runtime: Runtime, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float]
    ) -> list[float]:
        """For every unknown the sum of its partial derivatives by the knowns, each times its seed; dry friction is held
        as it is.

        Args:
            runtime: where they are taken.
            unknowns: value references of real outputs and of derivatives.
            knowns: value references of time, real inputs, states and parameters.
            seed: one number for each known.

        Returns:
            One number for each unknown.

        Raises:
            BlockError: the system cannot be traced, a variable is none of these, the seed has another length, or the
            equations
                have no finite derivative here.
        """
        demand_casadi()
        if not self.system.traceable:
            raise BlockError(f"{self.system.name} cannot be traced, so it has no directional derivatives.")
        if len(seed) != len(knowns):
            raise BlockError(f"{len(knowns)} knowns but {len(seed)} seeds; all variables are scalars.")
        rows = [self._row(reference) for reference in unknowns]
        seeds = self._seeds(runtime, zip(knowns, seed, strict=True))
        values = [float(value) for value in self._tangent(runtime, seeds)[rows]]
        for reference, value in zip(unknowns, values, strict=True):
            if not isfinite(value):
                raise BlockError(
                    f"the directional derivative of {self._variable(reference).name} is not a finite number here."
                )
        return values

    # -- internals --------------------------------------------------------------------------------------------------

    @cached_property
    def _traced(self) -> TracedSystem:
        return traced_once(self.system)

    def _seeds(self, runtime: Runtime, pairs: Iterable[tuple[int, float]]) -> list[np.ndarray]:
        """Of time, x, u and p, from pairs of a known's value reference and its seed."""
        seeds = [np.zeros(1), *(np.zeros(len(values)) for values in (runtime.x, runtime.u, runtime.p))]
        for reference, value in pairs:
            group, index = self._place(reference)
            seeds[group][index] += value
        return seeds

    def _tangent(self, runtime: Runtime, seeds: Sequence[np.ndarray]) -> np.ndarray:
        now = (runtime.t, runtime.x, runtime.u, runtime.p)
        tangent = self._traced.tangent(*now, self.system.held_vector(*now), *seeds)
        return np.asarray(tangent, dtype=float).reshape(-1)

    def _row(self, reference: int) -> int:
        """Position in the result of the tangent: outputs, then derivatives."""
        table, variable = self._table, self._variable(reference)
        if table.outputs <= reference < table.states and variable.type in {"Real", "Float64"}:
            return reference - table.outputs
        if table.derivatives <= reference < table.indicators:
            return width(self.system.outputs) + reference - table.derivatives
        raise BlockError(_refusal(variable, "unknown", "a real output or the derivative of a state"))

    def _place(self, reference: int) -> tuple[int, int]:
        """Group (time, x, u, p) and position of a known."""
        table, variable = self._table, self._variable(reference)
        for group, first, count in (
            (0, table.time, 1),
            (1, table.states, self.system.state_count),
            (2, table.inputs, width(exposed_inputs(self.system))),
            (3, table.parameters, width(self.system.parameter_signals)),
        ):
            if first <= reference < first + count:
                return group, reference - first
        raise BlockError(_refusal(variable, "known", "time, a real input, a state or a parameter"))

    def _variable(self, reference: int) -> ModelVariable:
        if not self._table.time <= reference < self._table.end:
            raise BlockError(
                f"there is no variable with value reference {reference}; the last one is {self._table.end - 1}."
            )
        return referenced(self.variables, reference)[0]


def _refusal(variable: ModelVariable, kind: str, expected: str) -> str:
    name = f"{variable.name} (value reference {variable.valueReference})"
    return f"{name} is no {kind} of a directional derivative; expected {expected}."

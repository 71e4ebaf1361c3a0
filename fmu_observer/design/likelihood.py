"""Exact gradients of what a filter accumulates over a recording, by the traced equations of the filter itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant_models.hybrid import HybridSystem, PeriodicEvent, scalar_names
from plant_models.hybrid.casadi_package import ca
from plant_models.hybrid.tracing import TracedSystem

Array = NDArray[np.float64]
LIKELIHOOD = "innovation_likelihood"


class AccumulatedOutput:
    """An output at the end of a recording, and its exact gradient by parameters: reverse differentiation through all
    samples.

    The system is sampled: nothing flows between the instants of its one periodic event. Meant for the logarithm of the
    innovation likelihood, whose maximum is what `likelihood_gradient` searches.

    Args:
        system: a filter. inputs: at the samples, in the order of its scalar inputs, shape (k, inputs).
        names: scalar parameters by which it is differentiated, such as ``process_covariance[1]``.
        output: name of the output. parameters: other values than the defaults, by scalar name.

    Raises:
        ValueError: the system flows or has other events; an output, input or parameter does not exist.
        TracingError: an equation of it cannot be traced.
    """

    def __init__(
        self,
        system: HybridSystem,
        inputs: ArrayLike,
        names: Sequence[str],
        *,
        output: str = LIKELIHOOD,
        parameters: Mapping[str, float] | None = None,
    ) -> None:
        periodic = [event for event in system.events if isinstance(event, PeriodicEvent)]
        if system.continuous_count or len(periodic) != 1 or len(system.events) != 1:
            raise ValueError(
                f"{system.name}: expected a filter that is sampled by one periodic event and flows nowhere."
            )
        known, outputs = scalar_names(system.parameter_signals), scalar_names(system.outputs)
        for name in (*names, *(parameters or {})):
            if name not in known:
                raise ValueError(f"{system.name} has no parameter {name!r}; known: {', '.join(known)}.")
        if output not in outputs:
            raise ValueError(f"{system.name} has no output {output!r}; known: {', '.join(outputs)}.")
        rows = np.asarray(inputs, float)
        if rows.ndim != 2 or rows.shape[1] != len(system.start_inputs()):
            raise ValueError(
                f"{system.name}: expected inputs of shape (k, {len(system.start_inputs())}), got {rows.shape}."
            )
        values = np.asarray(system.start_parameters(), float)
        for name, value in (parameters or {}).items():
            values[known.index(name)] = value
        self._function = self._differentiated(
            system, periodic[0].name, rows, values, [known.index(name) for name in names], outputs.index(output)
        )

    def __call__(self, values: ArrayLike) -> tuple[float, Array]:
        """The output at the end, and its gradient, shape (d,).

        Args:
            values: of the parameters, shape (d,).
        """
        value, gradient = self._function(np.asarray(values, float))
        return float(value), np.asarray(gradient, float).ravel()

    @staticmethod
    def _differentiated(
        system: HybridSystem, event: str, rows: Array, values: Array, places: Sequence[int], output: int
    ) -> Any:
        traced = TracedSystem(system)
        u, p, d = ca.SX.sym("u", rows.shape[1]), ca.SX.sym("p", len(values)), len(places)
        x, searched = ca.SX.sym("x", system.state_count), ca.SX.sym("q", d)
        every = ca.SX(values)
        for place, symbol in zip(places, ca.vertsplit(searched), strict=True):
            every[place] = symbol
        moved = traced.jump(event)(0.0, x, u, every)
        step = ca.Function("sample", [x, u, searched], [moved], {"cse": True})
        last = ca.Function("last", [x, u, p], [traced.output(0.0, x, u, p)[output]])
        symbols = ca.MX.sym("q", d)
        whole = step.mapaccum("samples", len(rows))
        start = ca.DM(np.asarray(system.start_state(), float))
        states = whole(start, ca.DM(rows.T), ca.repmat(symbols, 1, len(rows)))
        reached = last(states[:, -1], ca.DM(rows[-1]), ca.DM(values))
        return ca.Function("accumulated", [symbols], [reached, ca.gradient(reached, symbols)])

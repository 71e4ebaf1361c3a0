"""Partial inversion with an unknown rate: the gas-phase reaction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fmu_observer.formulas.signatures.inversion import (
    Found,
    best_candidate,
    corrected_inverse,
    interpolated,
    monotone_inverse,
    require_monotone,
)
from fmu_observer.formulas.signatures.pencil import NextScaling
from fmu_observer.observers.generic.signature.signature_observer import TABLE_ERROR, InvertedWindow, SignatureObserver
from fmu_observer.observers.parameter_values import Value
from plant_models.exhibits.gas_phase_reaction import GasPhaseReaction
from plant_models.hybrid import Array, discrete_output, memory, parameter, vector
from plant_models.hybrid.option import require_whole
from plant_models.hybrid.scan import enclosed, scan

ORDER, POINTS = 2, 9  # printed N; N_O = 11
LARGEST = 3.0  # printed set [0, 3]^2
RATES = (0.10, 0.35)  # printed range of b [1/s]
EPS, _WIDE_PERIOD = 1e-2, 0.1


class ReactionSignature(SignatureObserver):
    """Reduced signature observer of `gas_phase_reaction`, the rate b unknown: Omar 2012, section 4.8, (4.8.1)-(4.8.6).

    For each candidate of b, ``r1 = min xi`` gives x1 and ``r2 = min eta`` then gives x2; the candidate whose output
    fits the window best is taken, and the residuals are interpolated between neighbours. Two unknowns less remain for
    the search. With N = 2 all points lie on a line, and eta is the weight of the second vertex (see `polygon`).

    Repaired. 1. The table is built once, at the middle of the range, in ``sqrt(-r1 / b)``, which is nearly
    proportional to x1 for every b; the thesis tabulates r1. 2. Five nodes an axis are too few for linear interpolation:
    J_r then has its minimum up to 0.16 1/s away from b. Each look-up is corrected `corrections` times by the model;
    with six the minimum stands at b. 3. ``literal`` scaling: with ``norm`` r1 depends on x2 as much as on x1.

    With samples each 0.01 s (preset `as_published`) the problem is so ill-conditioned that noise of 1e-3 on y moves x1
    by 1.3 even by least squares; with 0.1 s (preset `wide_samples`, its table included) by 0.02. The properties are
    smallest values of nine points, which noise moves one way: with noise the rate ends at the border of its range. Use
    a moving-horizon observer there.

    Args:
        candidates: of the rate, evenly over [0.10, 0.35] 1/s; the printed search has steps of 0.025, which is 11.
        corrections: of each look-up. nodes: of the table, an axis. next_scaling: see above.

    Raises:
        ValueError: an option is no whole number or out of bounds, or the table cannot be inverted.
    """

    name = "reaction_signature"
    description = "Signature observer of the gas-phase reaction, its rate unknown"
    source = "Omar 2012, (4.8.1)-(4.8.6)"
    default_preset = "as_published"
    option_choices = {
        "candidates": range(3, 12),
        "corrections": range(7),
        "nodes": range(4, 14),
        "next_scaling": ("literal", "norm"),
    }

    def __init__(
        self, candidates: int = 6, corrections: int = 3, nodes: int = 5, next_scaling: NextScaling = "literal"
    ) -> None:
        require_whole(self.name, 3, 11, candidates=candidates)
        require_whole(self.name, 0, 6, corrections=corrections)
        require_whole(self.name, 4, 13, nodes=nodes)
        self.corrections = corrections
        self.rates = np.linspace(*RATES, candidates)
        self.nodes = np.linspace(0.0, LARGEST, nodes)
        middle = float(np.mean(RATES))
        self.plant, self.scaling = GasPhaseReaction(), next_scaling
        table = self._built(1e-2, EPS)
        self.declare(
            self.plant,
            ORDER + POINTS,
            next_scaling,
            gain=0.2,
            eps=EPS,
            own_parameters=(
                parameter("table", "1", tuple(table), "sqrt(-r1 / b) over x1, then r2 over x1 and x2", size=len(table)),
            ),
            own_memory=(
                memory("estimated_rate", "1/s", middle, "Estimate: rate of the reaction"),
                memory("looked_up_rate", "1/s", middle, "Of the signature: rate of the reaction"),
            ),
            own_outputs=(
                discrete_output("rate", "1/s", "Estimate: rate of the reaction"),
                discrete_output("rate_look_up", "1/s", "Of the window alone: rate"),
            ),
            known=("rate",),
        )
        wide = {"sample_period": _WIDE_PERIOD, "table": tuple(self._built(_WIDE_PERIOD, EPS))}
        self.presets = {"as_published": {}, "wide_samples": wide}
        super().__init__(candidates=candidates, corrections=corrections, nodes=nodes, next_scaling=next_scaling)

    def properties(self, state: Array, rate: Array, period: Array, eps: Array) -> tuple[Array, Array]:
        """``sqrt(-r1 / b)`` and r2 of the window that begins with a state, shape (2, ...), and the window, shape
        (N_O, ...), by the exact solution.

        Args:
            state: shape (2, ...). rate: b [1/s], shape (...). period: tau [s]. eps: regularisation.
        """
        total = state[0] + 2.0 * state[1]
        firsts = [state[0] / (1.0 + 2.0 * k * period * rate * state[0]) for k in range(ORDER + POINTS)]
        window = np.stack([0.5 * (first + total) for first in firsts])
        return self._read(window, rate, eps), window

    def tabulated(
        self, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> dict[str, np.ndarray]:
        """The table for other parameters, to be set together with them.

        Args:
            parameters: values by name; sampling period and regularisation matter. preset: to start from.

        Raises:
            ValueError: a parameter is unknown, or the table cannot be inverted; the message names the quantity and
                where.
        """
        p = self.model_values(parameters, preset)
        return {"table": self._built(float(p.sample_period), float(p.regularisation))}

    def table_errors(self, p: Any) -> dict[str, Array]:
        """At the largest x1, with all x2."""
        count, rate = len(self.nodes), float(np.mean(RATES))
        states = np.stack([np.full(count, LARGEST), self.nodes])
        made = self.properties(states, rate, p.sample_period, p.regularisation)[0]
        first, second = p.table[:count], p.table[count:]
        sizes = [TABLE_ERROR * np.maximum(np.max(part) - np.min(part), 1e-300) for part in (first, second)]
        offs = [np.abs(second[count * (count - 1) + j] - made[1][j]) / sizes[1] for j in range(count)]
        offs.append(np.abs(first[count - 1] - np.sum(made[0]) / count) / sizes[0])
        return {"table": np.max(np.stack(offs))}

    def inverted(self, past: Sequence[Array], x: Any, p: Any) -> InvertedWindow:
        """The state for each candidate of the rate, and the candidate that fits the window best."""
        states, residuals = self.search(past[0], p)
        best = best_candidate(self.rates, residuals)
        chosen = [
            interpolated(self.rates, values, best.values)
            for values in (states.values[0], states.values[1], np.minimum(states.outside, 1e3))
        ]
        smoothed = (x.estimated_rate + p.gain * best.values) / (1.0 + p.gain)
        return InvertedWindow(np.stack(chosen[:2]), np.maximum(chosen[2], best.outside), (smoothed, best.values))

    def search(self, window: Array, p: Any) -> tuple[Found, Array]:
        """State at the oldest sample, were each candidate the rate, shape (2, c), and the residuals that it leaves, of
        which J_r is the sum of squares, shape (N_O, c).

        Args:
            window: samples of y, shape (N_O,).
        """

        def candidate(_carry: Any, row: Any, shared: Any) -> Any:
            samples, table, (period, eps), rate = shared[0], shared[1], (shared[2][0], shared[2][1]), row[0][0]
            target = self._read(samples, rate, eps)

            def again(state: Array) -> Array:
                return self.properties(state, rate, period, eps)[0]

            found = corrected_inverse(
                lambda r: self._looked_up(r, table), again, target, self.corrections, 0.0, LARGEST
            )
            left = samples - self.properties(found.values, rate, period, eps)[1]
            return (), (np.hstack([found.values, np.stack([found.outside]), left]),)

        def search(*shared: Array) -> tuple[Array, ...]:
            results = scan(candidate, (), [(np.array([rate]),) for rate in self.rates], shared)[1]
            return tuple(result[0] for result in results)

        columns = np.stack(enclosed(search, window, p.table, vector(p.sample_period, p.regularisation)), axis=1)
        return Found(columns[:2], columns[2]), columns[3:]

    def model_parameters(self, own: Sequence[Array], p: Any) -> Any:
        """The rate as estimated."""
        return self._model(own[0], p.sample_period)

    # -- internals --------------------------------------------------------------------------------------------------

    def _read(self, window: Array, rate: Array, eps: Array) -> Array:
        points = self.points(window, ORDER, eps)
        lowest = np.minimum(np.min(points[0], axis=0), 0.0)
        return np.stack([np.sqrt(-lowest / rate), np.min(points[1], axis=0)])

    def _looked_up(self, properties: Array, table: Array) -> Found:
        count = len(self.nodes)
        first = monotone_inverse(self.nodes, table[:count], properties[0])
        rows = np.reshape(table[count:], (count, count))
        column = interpolated(self.nodes, [rows[i] for i in range(count)], first.values)
        second = monotone_inverse(self.nodes, column, properties[1])
        return Found(np.stack([first.values, second.values]), np.maximum(first.outside, second.outside))

    def _built(self, period: float, eps: float) -> np.ndarray:
        grid = np.stack(np.meshgrid(self.nodes, self.nodes, indexing="ij"))
        rate = float(np.mean(RATES))
        properties = self.properties(grid, rate, period, eps)[0]
        own = properties[0].mean(axis=1)
        require_monotone("x1", self.nodes, own, f"at rate {rate:g}")
        require_monotone(
            "x2", self.nodes, properties[1].T[:, 1:], f"at rate {rate:g}, with x1 of {self.nodes[1]:g} to {LARGEST:g}"
        )
        return np.concatenate([own, properties[1].ravel()])

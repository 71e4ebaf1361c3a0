"""Full inversion of signatures of one point: the braked oscillator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fmu_observer.formulas.signatures.inversion import soft_inverse
from fmu_observer.formulas.signatures.pencil import NextScaling
from fmu_observer.observers.generic.signature.signature_observer import TABLE_ERROR, InvertedWindow, SignatureObserver
from fmu_observer.observers.parameter_values import Value
from plant_models.exhibits.oscillators import BrakedOscillator, Variant
from plant_models.hybrid import Array, parameter
from plant_models.hybrid.option import require_chosen, require_whole

ORDER, POINTS = 2, 1  # printed N; N_O = 3
SET = (1.0, 3.0)  # printed: |x1|, |x2| at most
EPS = {"norm": 10.0, "literal": 0.1}
SHARPNESS = 200.0


class OscillatorSignature(SignatureObserver):
    """Full signature observer of `braked_oscillator`: Omar 2012, section 4.6.1, (4.6.1)-(4.6.8).

    The signature of three samples is one point. The table holds the points of a grid of states; for each grid value of
    x1 they make a curve over x2, and the estimate of x1 is the mean of the grid values weighted by
    ``exp(-mu distance)`` (4.6.5), likewise for x2. Axes are scaled to [0, 1].

    With N = 2 the second coordinate is the weight of the second vertex (see `polygon`): exact arithmetic leaves no
    ordinate, and the thesis read rounding errors of 1e-17. eps and mu are not printed; here eps =
    0.1 with ``literal`` scaling and 10 with ``norm``, mu = 200 [ours], none is validated. Polygonal lines replace
    splines.

    The table belongs to the parameters it was built with: set what `tabulated` returns together with others. Presets,
    each with its table: `fits_set` (default) and `chapter_2`, as those of the plant; in the second one two states may
    have one signature, and the error of x1 is five times as large.

    Args:
        nodes: grid values an axis, printed 7 and 13. next_scaling: ``literal`` (default) gives both states, ``norm`` x1
            alone. variant: of the plant.

    Raises:
        ValueError: an option is no whole number or out of bounds, or unknown.
    """

    name = "oscillator_signature"
    description = "Signature observer of the braked oscillator"
    source = "Omar 2012, (4.6.1)-(4.6.8)"
    default_preset = "fits_set"
    presets = {"fits_set": {}}
    option_choices = {
        "nodes": range(4, 22),
        "next_scaling": ("literal", "norm"),
        "variant": ("mixed", "speed", "root"),
    }

    def __init__(self, nodes: int = 7, next_scaling: NextScaling = "literal", variant: Variant = "mixed") -> None:
        require_whole(self.name, 4, 21, nodes=nodes)
        require_chosen(self.name, self.option_choices, next_scaling=next_scaling)
        self.nodes = [np.linspace(-size, size, nodes) for size in SET]
        eps = EPS[next_scaling]
        self.declare(
            BrakedOscillator(variant),
            ORDER + POINTS,
            next_scaling,
            gain=0.1,
            eps=eps,
            own_parameters=(
                parameter("sharpness", "1", SHARPNESS, "Sharpness mu of the weights", min=1e-3),
                parameter(
                    "table", "1", (0.0,) * (2 * nodes**2), "Points of the grid, both coordinates", size=2 * nodes**2
                ),
            ),
        )
        super().__init__(nodes=nodes, next_scaling=next_scaling, variant=variant)
        self._fill_table(self.tabulated()["table"])
        other = {"rate_factor": 1.5, "braking": 2.25}
        self.presets = {"fits_set": {}, "chapter_2": other | {"table": tuple(self.tabulated(other)["table"])}}

    def tabulated(
        self, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> dict[str, np.ndarray]:
        """The table for other parameters, to be set together with them.

        Args:
            parameters: values by name; those of the plant, sampling period and regularisation matter. preset: to start
                from.

        Raises:
            ValueError: a parameter is unknown, not finite or of another size.
        """
        grid = np.stack(np.meshgrid(*self.nodes, indexing="ij"))
        return {"table": np.stack(self._points_of(grid, self.model_values(parameters, preset))).ravel()}

    def table_errors(self, p: Any) -> dict[str, Array]:
        """At nine nodes: corners, middles of sides, and the middle."""
        count = len(self.nodes[0])
        some = np.array([0, count // 2, count - 1])
        grid = np.stack(np.meshgrid(*(nodes[some] for nodes in self.nodes), indexing="ij"))
        places = [int(i) * count + int(j) for i in some for j in some]
        offs: list[Array] = []
        for k, made in enumerate(self._points_of(np.reshape(grid, (2, len(places))), p)):
            stated = p.table[k * count**2 : (k + 1) * count**2]
            size = TABLE_ERROR * np.maximum(np.max(stated) - np.min(stated), 1e-300)
            offs += [np.abs(stated[i] - made[n]) / size for n, i in enumerate(places)]
        return {"table": np.max(np.stack(offs))}

    def _points_of(self, states: np.ndarray, p: Any) -> tuple[Array, Array]:
        """Both coordinates of the signatures of windows that begin with these states, shape (...) each."""
        window = np.stack(
            [self.plant.measured(self.plant.named(x), p)[0] for x in self.moved(states, ORDER + POINTS - 1, p)]
        )
        points = self.points(window, ORDER, p.regularisation)
        return points[0][0], points[1][0]

    def inverted(self, past: Sequence[Array], x: Any, p: Any) -> InvertedWindow:
        """Both states by (4.6.5)."""
        count = len(self.nodes[0])
        xi, eta = (np.reshape(p.table[i * count**2 : (i + 1) * count**2], (count, count)) for i in range(2))
        point = self.points(past[0], ORDER, p.regularisation)
        scaled, places = [], []
        for values, read in zip((xi, eta), point, strict=True):
            low = np.min(values)
            size = np.max(values) - low
            scaled.append((values - low) / size)
            places.append((read[0] - low) / size)
        place = np.stack(places)
        state = np.stack(
            [
                soft_inverse(self.nodes[0], scaled, place, p.sharpness),
                soft_inverse(self.nodes[1], [values.T for values in scaled], place, p.sharpness),
            ]
        )
        beyond = np.maximum(np.max(-place), np.max(place - 1.0)) * (count - 1)
        return InvertedWindow(state, np.maximum(beyond, 0.0))

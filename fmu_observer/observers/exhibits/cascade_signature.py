"""Full inversion with envelopes: the cascade of three states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.signatures.envelope import Envelope, best_envelope
from fmu_observer.formulas.signatures.inversion import curve_distances, interpolated, nearest_two, place_on_curve
from fmu_observer.formulas.signatures.pencil import NextScaling, pencil_point
from fmu_observer.observers.generic.signature.signature_observer import InvertedWindow, SignatureObserver
from plant_models.exhibits.three_state_cascade import ThreeStateCascade
from plant_models.hybrid import Array
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.scan import enclosed, scan

_NO_LINE = 1e9
"""Distance along a line that misses the envelope; finite, so that it traces."""


ORDER, POINTS = 67, 34  # printed N and M; N_O = 101
SIZE = 3.0  # printed set [-3, 3]^3
EPS = {"literal": 1.0, "norm": 1e-3}
SLABS, DIRECTIONS, ANGLES = 15, 12, 19
_OTHER_SIDE = 1e6
"""Added to the distance of a class of the other sign, which (4.6.14) does not examine."""
LEAST = 1e-6
"""Added to each distance: a point in two envelopes lies in the middle of their classes."""


class _CascadeTables(NamedTuple):
    """What the signatures of a grid of states are known by.

    Attributes:
        middles: median points, a pair of arrays for each value of x2, shape (x1, x3) each. chords: from the first to
            the last point, for each x2 and x1, shape (2, x3). envelopes: of each value of x2, see `_envelope_numbers`.
        signatures: all, shape (2, M, x1, x2, x3).
    """

    middles: list[tuple[np.ndarray, np.ndarray]]
    chords: list[list[np.ndarray]]
    envelopes: np.ndarray
    signatures: np.ndarray


class CascadeSignature(SignatureObserver):
    """Full signature observer of `three_state_cascade`: Omar 2012, section 4.6.2, (4.6.12)-(4.6.15).

    1. x2: distances of the median point of the signature to the envelopes of the classes of equal x2; those whose sign
    is not that of its abscissa are left out, and the two nearest are weighted by the distance of the other (4.6.14). 2.
    x1: the same with distances to the lines of median points that share x1 (4.6.15), at the x2 found. 3. x3: the place
    on the curve of chords over x3, at x1 and x2 found.

    Ours: lines are polygonal and interpolated between the classes of x2. x3 comes of the chord from the first to the
    last point; the thesis takes its slope, which is monotone in 19 of 49 pairs (x1, x2) only. ``literal`` scaling with
    eps = 1 is the default: with ``norm``, which has the sign rule too, the errors are two to six times as large.

    The tables are part of the equations, and hold for the printed plant with samples each 0.001 s. x3 leaves the set of
    the tables after 0.46 s of the printed run; the look-up then ends at its border, and the estimate goes astray.

    Args:
        nodes: grid values an axis, printed 7. next_scaling: see above.

    Raises:
        ValueError: an option is no whole number or out of bounds, or unknown.
    """

    name = "cascade_signature"
    description = "Signature observer of the cascade of three states, by envelopes"
    source = "Omar 2012, (4.6.12)-(4.6.15)"
    option_choices = {"nodes": range(4, 14), "next_scaling": ("literal", "norm")}

    def __init__(self, nodes: int = 7, next_scaling: NextScaling = "literal") -> None:
        require_whole(self.name, 4, 13, nodes=nodes)
        require_chosen(self.name, self.option_choices, next_scaling=next_scaling)
        self.nodes = np.linspace(-SIZE, SIZE, nodes)
        plant = ThreeStateCascade()
        known = [
            s.name for s in plant.parameters if s.name not in ("process_noise", "measurement_noise", "sample_period")
        ]
        self.declare(plant, ORDER + POINTS, next_scaling, gain=0.1, eps=EPS[next_scaling], known=known)
        self.parameters = tuple(s for s in self.parameters if s.name != "regularisation")
        values = plant.unpack_parameters(plant.start_parameters())
        self._constants = (float(values.nonlinearity), float(values.ramp))
        self._period = float(values.sample_period)
        self.tables = self._built()
        super().__init__(nodes=nodes, next_scaling=next_scaling)

    def signatures(self, states: np.ndarray) -> np.ndarray:
        """Signatures of windows that begin with these states, shape (2, M, ...).

        Args:
            states: shape (3, ...).
        """
        model = self._model(*self._constants, self._period)
        window = np.stack(
            [self.plant.measured(self.plant.named(x), model)[0] for x in self.moved(states, self.window - 1, model)]
        )
        return np.stack(self.points(window, ORDER, EPS[self.scaling]))

    def requirements(self, p: Any) -> dict[str, Array]:
        """Samples come at the period of the tables, which are part of the equations."""
        text = f"sample_period must be {self._period:g} s: the tables are made of samples over that time"
        equal = np.where(np.abs(p.sample_period - self._period) <= 1e-9, 1.0, 0.0)
        return super().requirements(p) | {text: equal}

    def model_parameters(self, own: Sequence[Array], p: Any) -> Any:
        """The printed constants."""
        return self._model(*self._constants, p.sample_period)

    def inverted(self, past: Sequence[Array], x: Any, p: Any) -> InvertedWindow:
        """x2 by envelopes, then x1 by median lines, then x3 by chords."""
        first, *middle, last, distances = self._read(past[0])
        point, chord, nodes = 0.5 * (middle[0] + middle[1]), last - first, self.nodes
        wrong = np.where(nodes * point[0] < 0.0, _OTHER_SIDE, 0.0)
        second = nearest_two([distances[i] + LEAST + wrong[i] for i in range(len(nodes))], nodes)
        lines, chords = self._at(second)
        to_lines = curve_distances(lines, point)
        first_state = nearest_two([to_lines[i] + 1e-12 for i in range(len(nodes))], nodes)
        third = place_on_curve(nodes, np.stack([interpolated(nodes, chords[k], first_state) for k in range(2)]), chord)
        ends = np.where(np.abs(third) > SIZE - LEAST, 1.0, 0.0)  # the chord lies at or beyond an end of its curve
        outside = np.maximum(ends, np.where(np.min(distances) > 1.0, 1.0, 0.0))
        return InvertedWindow(np.stack([first_state, second, third]), outside)

    # -- internals --------------------------------------------------------------------------------------------------

    def _read(self, window: Array) -> tuple[Array, ...]:
        """First, both middle, and last points of the signature, and the distances to the classes."""
        eps, slopes = EPS[self.scaling], _line_slopes(DIRECTIONS)
        rows = [(np.asarray(numbers), slope) for numbers in self.tables.envelopes for slope in slopes]
        starts = (0, POINTS // 2 - 1, POINTS // 2, POINTS - 1)

        def distance(_carry: Any, row: Any, shared: Any) -> Any:
            return (), (np.stack([class_distance(shared[0], row[0], row[1])]),)

        def read(samples: Array) -> tuple[Array, ...]:
            points = [pencil_point(samples[i : i + ORDER], samples[i + ORDER], eps, self.scaling) for i in starts]
            return (*points, *(d[0] for d in scan(distance, (), rows, (0.5 * (points[1] + points[2]),))[1]))

        found = enclosed(read, window)
        lines = [np.hstack(found[4 + i * DIRECTIONS : 4 + (i + 1) * DIRECTIONS]) for i in range(len(self.nodes))]
        return (*found[:4], np.stack([np.min(values) for values in lines]))

    def _at(self, second: Array) -> tuple[list[Array], list[list[Array]]]:
        """Median lines, a pair of shape (x1, x3), and chords, a pair of lists over x1, at a value of x2."""
        count, nodes = len(self.nodes), self.nodes
        rows = [
            np.concatenate([*(values.ravel() for values in middle), np.stack(chords, axis=1).ravel()])
            for middle, chords in zip(self.tables.middles, self.tables.chords, strict=True)
        ]

        def weighted(place: Array) -> tuple[Array, ...]:
            return (interpolated(nodes, rows, place),)

        found = enclosed(weighted, np.stack([second]))[0]
        parts = [np.reshape(found[k * count**2 : (k + 1) * count**2], (count, count)) for k in range(4)]
        return parts[:2], [[part[i] for i in range(count)] for part in parts[2:]]

    def _built(self) -> _CascadeTables:
        signatures = self.signatures(np.stack(np.meshgrid(self.nodes, self.nodes, self.nodes, indexing="ij")))
        middles = signatures[:, POINTS // 2 - 1 : POINTS // 2 + 1].mean(axis=1)
        chords = signatures[:, -1] - signatures[:, 0]
        count, angles = range(len(self.nodes)), np.linspace(0.0, np.pi, ANGLES)
        return _CascadeTables(
            [(middles[0, :, j], middles[1, :, j]) for j in count],
            [[chords[:, i, j] for i in count] for j in count],
            np.array(
                [_envelope_numbers(best_envelope(signatures[:, :, :, j].reshape(2, -1), SLABS, angles)) for j in count]
            ),
            signatures,
        )


def _envelope_numbers(envelope: Envelope) -> np.ndarray:
    """An envelope as one row: cosine and sine of its angle, edges, lower and upper bounds; shape (3 q + 3,)."""
    turn = [np.cos(envelope.angle), np.sin(envelope.angle)]
    return np.concatenate([turn, envelope.edges, envelope.lower, envelope.upper])


def class_distance(point: Array, numbers: Array, slope: Array) -> Array:
    """Distance of a point to an envelope along a line, the smallest of which over several lines is (4.5.18): Omar 2012,
    (4.5.15)-(4.5.16).

    Args:
        point: shape (2,). numbers: see `_envelope_numbers`. slope: cosine and sine of the line's direction in the
            envelope's frame, neither of them 0, shape (2,); see `_line_slopes`.

    Returns:
        A number [1]; 0 in the envelope, `_NO_LINE` where the line misses it.
    """
    slabs = (len(numbers) - 3) // 3
    x = numbers[0] * point[0] - numbers[1] * point[1]
    y = numbers[1] * point[0] + numbers[0] * point[1]
    across = (numbers[2 : slabs + 3] - x) / slope[0]
    lower, upper = ((numbers[k * slabs + 3 : (k + 1) * slabs + 3] - y) / slope[1] for k in (1, 2))
    begin = np.maximum(np.minimum(across[:-1], across[1:]), np.minimum(lower, upper))
    end = np.minimum(np.maximum(across[:-1], across[1:]), np.maximum(lower, upper))
    whole = np.sum(np.maximum(end - begin, 0.0))
    nearest = np.min(np.where(end >= begin, np.maximum(np.maximum(begin, -end), 0.0), _NO_LINE))
    share = np.where(whole > 0.0, nearest / np.where(whole > 0.0, whole, 1.0), _NO_LINE)
    return np.where(nearest > 0.0, np.minimum(share, _NO_LINE), 0.0)


def _line_slopes(directions: int) -> np.ndarray:
    """Slopes of lines for `class_distance`, half a step beside the axes so that none is parallel to an edge, shape
    (directions, 2).
    """
    angles = (np.arange(directions) + 0.5) * np.pi / directions
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)

"""A synthetic electric sense: a probe of two electrodes turns at a place in a tank, and its current tells of the walls.

Ours: the measurements of the thesis are not printed. Two point electrodes of opposite current, and the first images of
them in four insulating walls; the record is what the walls add to the voltage between them, over one turn.
"""

from __future__ import annotations

import numpy as np

HALF, ARM = 0.5, 0.05  # [m]: half of the square tank's side, half of the distance between the electrodes
SPACING, COLUMNS = 0.07, 6  # [m]: between neighbouring places
SAMPLES, STARTS = 72, 10
NOISE = 0.01  # standard deviation, as a share of the largest record of the noise-free training
TRAINED = {1: (1,), 3: (1, 2, 3), 5: (1, 3, 5), 6: (1, 3, 5, 6)}  # places of a column, from the axis of symmetry on
HELD_OUT = {2: (1, 2), 4: (1, 2, 3, 4), 5: (2, 4), 6: (2, 4)}


def places(layout: dict[int, tuple[int, ...]]) -> np.ndarray:
    """Positions of the layout, shape (2, n) [m]: column i has places 1 to i, in the triangle ``0 <= y <= x``."""
    return SPACING * np.array([(i - 1, j - 1) for i, rows in layout.items() for j in rows], dtype=float).T


def records(positions: np.ndarray, seed: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Records of one turn from each of `STARTS` angles at each position.

    Args:
        positions: shape (2, n) [m]. seed: of noise and start angles; None for no noise and angles evenly from 0 on.

    Returns:
        Records, shape (SAMPLES, n STARTS) [1/m], and their positions, shape (2, n STARTS).
    """
    rng = np.random.default_rng(seed)
    each = np.repeat(positions, STARTS, axis=1)
    begin = 2.0 * np.pi * (np.tile(np.arange(STARTS) / STARTS, positions.shape[1]))
    begin = begin if seed is None else rng.uniform(0.0, 2.0 * np.pi, begin.shape)
    angles = begin + 2.0 * np.pi * np.arange(SAMPLES)[:, None] / SAMPLES
    arm = ARM * np.stack([np.cos(angles), np.sin(angles)])
    ends = (each[:, None] + arm, each[:, None] - arm)
    found = np.zeros(angles.shape)
    for axis in (0, 1):
        for wall in (-HALF, HALF):
            for i, at in enumerate(ends):
                for j, source in enumerate(ends):
                    image = source.copy()
                    image[axis] = 2.0 * wall - image[axis]
                    found += (1.0 if i == j else -1.0) / np.hypot(*(at - image))
    size = NOISE * np.abs(found).max() if seed is not None else 0.0
    return found + size * rng.standard_normal(found.shape), each

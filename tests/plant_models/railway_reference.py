"""Reference solution for the tests: SciPy's Radau on the same equations, cut where dry friction changes its mind.

Between two cuts the signs of the states with friction are fixed, so the equations are smooth and Radau at tight
tolerance is the truth to its tolerance. A state that reaches zero is put there exactly and continues under the
set-valued law.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from plant_models.hybrid import HybridSystem
from plant_models.hybrid.integration import effective_flow

RTOL, ATOL = 1e-10, 1e-12
LARGEST_STEP = 0.25  # [s]; a longer one could jump over a zero


def solve(
    system: HybridSystem, x0: np.ndarray, p: np.ndarray, phases: list[tuple[float, float]], at: np.ndarray
) -> np.ndarray:
    """States at the times `at` [s], shape (len(at), n), for inputs held over phases ``(end [s], input)`` from time
    zero.
    """
    x, t = np.array(x0, dtype=float), 0.0
    rows = np.full((len(at), len(x)), np.nan)
    rows[np.isclose(at, 0.0)] = x
    for end, value in phases:
        u = np.array([value])
        while t < end:
            t, x = _smooth_piece(system, t, end, x, u, p, at, rows)
    return rows


def _smooth_piece(system, t, end, x, u, p, at, rows):
    indices = system.friction_indices()
    sign = np.sign(x[indices])

    def flow(time, state):
        # An input or a zone that changes at `end` must not be seen by a stage that stands exactly there.
        return effective_flow(system, min(time, end - 1e-12), state, u, p, sign)

    events = [_zero_of(i) for i, s in zip(indices, sign, strict=True) if s != 0.0]
    found = solve_ivp(
        flow,
        (t, end),
        x,
        method="Radau",
        rtol=RTOL,
        atol=ATOL,
        events=events or None,
        dense_output=True,
        max_step=LARGEST_STEP,
    )
    assert found.success, found.message
    inside = (at > t) & (at <= found.t[-1])
    if inside.any():
        rows[inside] = found.sol(at[inside]).T
    x = found.y[:, -1].copy()
    moving = [i for i, s in zip(indices, sign, strict=True) if s != 0.0]
    for i, times in zip(moving, found.t_events or [], strict=False):
        if len(times):
            x[i] = 0.0
    return float(found.t[-1]), x


def _zero_of(index):
    def value(_t, state):
        return state[index]

    value.terminal = True
    return value

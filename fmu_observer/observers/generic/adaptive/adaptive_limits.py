"""Runs of an adaptive observer beside its own model: the true motion with constants that it does not know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_observer.certificates.limit_search import LimitSearch
from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.observers.model_search import solved_motion

STOP = 35.0  # [s]; the error counts from 28 s on
ALLOWED = 0.1  # error of state and first constant that may be left, in the units of the example
LOW, HIGH = 0.02, 0.5  # [s]


def adaptive_search(observer: Any, settings: Mapping[str, float]) -> LimitSearch:
    """Periods at which the observer finds states and its first constant; inputs are zero.

    Args:
        observer: an `AdaptiveObserver`. settings: parameters by scalar name.
    """
    model: StateAffineModel = observer.model
    believed = [float(s.start_values[0]) for s in (*model.states, *model.unknowns)]
    start = np.array(model.example or [value + 1.0 for value in believed])
    n, u = model.order, np.zeros(len(model.inputs))
    flow = lambda t, x: model.flow(t, x, start[n:], u)  # noqa: E731
    motion = solved_motion(flow, start[:n], STOP, rtol=1e-10, atol=1e-9, max_step=0.1)

    def truth(t: np.ndarray) -> Mapping[str, np.ndarray]:
        named = {s.name: row for s, row in zip(model.states, motion(t), strict=True)}
        return named | {model.unknowns[0].name: np.full(np.shape(t), start[n])}

    first = float(np.linalg.norm(start[: n + 1] - np.array(believed[: n + 1])))
    return LimitSearch(
        system=observer,
        varied="period",
        low=LOW,
        high=HIGH,
        event=model.event,
        payload=lambda t: {s.name: row for s, row in zip(model.measurements, model.C @ motion(t), strict=True)},
        inputs=lambda t: {s.name: np.zeros(np.shape(t)) for s in model.inputs},
        truth=truth,
        settings=settings,
        stop=STOP,
        left=ALLOWED / first,
    )

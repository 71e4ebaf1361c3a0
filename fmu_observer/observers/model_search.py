"""Runs of an observer beside its own model, to find a limit: the true motion, its measurements, and the inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.limit_search import LimitSearch, Varied
from fmu_observer.observers.model_observer import ModelObserver

WRONG_START = 0.5  # of every estimate, in its own unit
_DRIVE_SIZE, _DRIVE_FREQUENCY = 0.1, 1.0  # [1], [rad/s] of all inputs; Hann 2014, section 2.5


def model_search(
    observer: ModelObserver,
    varied: Varied,
    low: float,
    high: float,
    settings: Mapping[str, float],
    *,
    delayed: bool = False,
    **further: Any,
) -> LimitSearch:
    """Runs in which the plant is the model, from its starts, and all estimates start 0.5 beside them; all inputs are
    ``0.1 sin t`` in their units.

    Args:
        observer: at the event of its model. varied, low, high, further: as for `LimitSearch`. settings: parameters by
            scalar name. delayed: whether the outputs ``delayed_...`` are compared, with the truth a delay ago.
    """
    model, known = observer.model, np.ones(len(observer.model.inputs))
    start, stop = model.start, float(further.get("stop", LimitSearch.stop))
    motion = solved_motion(lambda t, x: model.flow(x, known * _drive(t)), start, stop, rtol=1e-9, atol=1e-11)
    names = [f"delayed_{s.name}" if delayed else s.name for s in model.states]
    starts = {s.name: v + WRONG_START for s, v in zip(observer.states[: model.order], start, strict=True)}
    return LimitSearch(
        system=observer,
        varied=varied,
        low=low,
        high=high,
        event=model.event,
        payload=lambda t: {s.name: row for s, row in zip(model.measurements, model.C @ motion(t), strict=True)},
        inputs=lambda t: {s.name: _drive(t) for s in model.inputs},
        truth=lambda t: dict(zip(names, motion(t), strict=True)),
        settings={**settings, **starts},
        delayed_truth=delayed,
        **further,
    )


def solved_motion(
    flow: Callable[[float, np.ndarray], Any], start: np.ndarray, stop: float, **options: float
) -> Callable[[np.ndarray], np.ndarray]:
    """States of a motion by instants, solved by DOP853 when they are first asked for.

    Args:
        flow: derivative by time and state. start: state at time 0, shape (n,). stop: its end [s]. options: of
            `scipy.integrate.solve_ivp`: tolerances and the longest step.
    """

    @cache
    def solution() -> Any:
        rates = lambda t, x: np.asarray(flow(t, x), dtype=float)  # noqa: E731
        return scipy.integrate.solve_ivp(rates, (0.0, stop), start, "DOP853", dense_output=True, **options).sol

    return lambda t: np.asarray(solution()(t))


def _drive(t: np.ndarray | float) -> np.ndarray:
    return _DRIVE_SIZE * np.sin(_DRIVE_FREQUENCY * np.asarray(t))

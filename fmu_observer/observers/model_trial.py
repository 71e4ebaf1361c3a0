"""Trials of an observer beside its own model: the true motion, what is measured of it, and the inputs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import scipy

from fmu_observer.certificates.observer_limits import Trial, Varied
from fmu_observer.observers.model_observer import ModelObserver

WRONG_START = 0.5  # of every estimate, in its own unit
DRIVE_SIZE, DRIVE_FREQUENCY = 0.1, 1.0  # [1], [rad/s] of all inputs; Hann 2014, section 2.5


def model_trial(
    observer: ModelObserver,
    varied: Varied,
    low: float,
    high: float,
    settings: Mapping[str, float],
    *,
    delayed: bool = False,
    **further: Any,
) -> Trial:
    """A trial in which the plant is the model, from its starts, and all estimates start 0.5 beside them.

    All inputs are ``0.1 sin t`` in their units. The motion is solved by DOP853 to 1e-9.

    Args:
        observer: told of its measurements at the event of its model. varied, low, high: see `Trial`.
        settings: parameters by scalar name. delayed: whether the outputs ``delayed_...`` are looked at, with the truth
            a delay ago. further: as for `Trial`, such as `nodes`, `period`, `stop`.
    """
    model = observer.model
    start = model.start
    stop = float(further.get("stop", Trial.stop))

    def drive(t: np.ndarray) -> np.ndarray:
        return DRIVE_SIZE * np.sin(DRIVE_FREQUENCY * np.asarray(t))

    @cache
    def motion() -> Any:
        known = np.ones(len(model.inputs))
        flow = lambda t, x: np.asarray(model.flow(x, known * drive(t)), dtype=float)  # noqa: E731
        return scipy.integrate.solve_ivp(
            flow, (0.0, stop), start, "DOP853", rtol=1e-9, atol=1e-11, dense_output=True
        ).sol

    names = [f"delayed_{s.name}" if delayed else s.name for s in model.states]
    starts = {s.name: v + WRONG_START for s, v in zip(observer.states[: model.order], start, strict=True)}
    return Trial(
        system=observer,
        varied=varied,
        low=low,
        high=high,
        event=model.event,
        payload=lambda t: {s.name: row for s, row in zip(model.measurements, model.C @ motion()(t), strict=True)},
        inputs=lambda t: {s.name: drive(t) for s in model.inputs},
        truth=lambda t: dict(zip(names, motion()(t), strict=True)),
        settings={**settings, **starts},
        delayed_truth=delayed,
        **further,
    )

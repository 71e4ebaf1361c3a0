"""Search of a limit by runs of an observer beside its own model, at many periods or delays: what is to be run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from plant_models.hybrid import HybridSystem

Varied = Literal["period", "delay"]
_Motion = Callable[[np.ndarray], Mapping[str, np.ndarray]]


@dataclass(frozen=True, eq=False)
class LimitSearch:
    """Runs of an observer beside its own model, without noise, at many values of what is varied.

    Packets are measured at ``0, period, 2 period, ...`` and arrive `delay` later; where there are several nodes they
    send in turn, one each period.

    Attributes:
        system: the observer. varied: what is varied. low, high: range in which the limit is sought [s].
        period: between two packets [s], where it is not varied. delay: of the packets [s], where it is not varied.
        settings: parameters and starts by name, those of the preset included.
        delay_parameter: parameter by which the observer knows the delay; empty where it has none.
        event: by which packets are reported. nodes: that send in turn; 0 for all measurements at once.
        node_events: event of each node, where each has its own; `event` is not used then.
        payload: of packets by name, by the instants of their measurement, shape (k,).
        inputs: of the observer by name, by instants, shape (k,). truth: outputs by name, by instants, shape (k,).
        delayed_truth: whether the outputs are compared with the truth a delay ago.
        stop: end of a run [s]. left: part of the first error (a norm) that may be left over the last fifth [1].
    """

    system: HybridSystem
    varied: Varied
    low: float
    high: float
    event: str
    payload: _Motion
    inputs: _Motion
    truth: _Motion
    period: float = 0.1
    delay: float = 0.0
    settings: Mapping[str, float] = field(default_factory=dict)
    delay_parameter: str = ""
    nodes: int = 0
    node_events: tuple[str, ...] = ()
    delayed_truth: bool = False
    stop: float = 60.0
    left: float = 0.02

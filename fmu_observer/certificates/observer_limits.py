"""Limits: how long a gap and a delay an observer survives, as printed bounds, exact tests and trials to be run.

Values. An observer that has limits answers ``limits(parameters, preset)`` with a tuple of `Limit`. What a trial
leads to is found by simulation, where there is a simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Literal

import numpy as np

from plant_models.hybrid import HybridSystem

Varied = Literal["period", "delay"]
Motion = Callable[[np.ndarray], Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class PrintedBound:
    """A sufficient bound of a thesis.

    Attributes:
        value: of the bound, in the unit of its limit. statement: what it says, in symbols. source: thesis and equation.
    """

    value: float
    statement: str
    source: str


@dataclass(frozen=True, eq=False)
class Trial:
    """A run of an observer beside its own model, without noise, to be tried at many values of what is varied.

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
    payload: Motion
    inputs: Motion
    truth: Motion
    period: float = 0.1
    delay: float = 0.0
    settings: Mapping[str, float] = field(default_factory=dict)
    delay_parameter: str = ""
    nodes: int = 0
    node_events: tuple[str, ...] = ()
    delayed_truth: bool = False
    stop: float = 60.0
    left: float = 0.02


@dataclass(frozen=True, eq=False)
class Limit:
    """One limit of an observer.

    Attributes:
        quantity: what is limited, in words. unit: of all values.
        printed: bounds of a thesis. exact: first value at which the error equations are unstable, None where no exact
            test is known, inf where none was found. exact_test: what that test judges, in words.
        searched_to: how far that test searched, inf where what it says holds without end. tried: shortest value that it
            tried, for an `exact` of 0; 0 where there is none at which the error equations are stable.
        trial: to find the practical limit by, None for none.
    """

    quantity: str
    unit: str = "s"
    printed: tuple[PrintedBound, ...] = ()
    exact: float | None = None
    exact_test: str = ""
    searched_to: float = inf
    tried: float = 0.0
    trial: Trial | None = None

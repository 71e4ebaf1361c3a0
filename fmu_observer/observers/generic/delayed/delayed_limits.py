"""How long between two packets, and how late, the delayed-state observer bears: printed, exact and by runs.

Bounds come from `certificates.printed_bounds.network_bounds`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any, Protocol, Self, cast

import numpy as np

from fmu_observer.certificates.finding import Finding, as_printed, limit_found, to_simulate
from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.limit_search import LimitSearch, Varied
from fmu_observer.certificates.printed_bounds.network_bounds import NetworkBounds, exact_predictor_delay
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.model_observer import ModelObserver
from fmu_observer.observers.model_search import WRONG_START, model_search

_MOST_PLACES = 60  # of a run
_LONGEST_INTERVAL = 100.0  # [s] to which the exact limit of the packets is searched
_LONGEST_SEARCH = 2.0  # [s] of runs, each predictor its own share
_THEOREM = "Hann 2014, (2.17)"


class _DelayedObserver(Protocol):
    """What is asked of an observer of late measurements, see `DelayedStateObserver`."""

    model: ObserverModel
    predictors: int
    memory_places: int

    @property
    def turns(self) -> tuple[tuple[int, ...], ...]:
        """Measurements of each node, from 0: the turns of a round."""

    @property
    def total_places(self) -> int:
        """Longest delay in memory periods."""

    @property
    def prediction_starts(self) -> tuple[float, ...]:
        """Starts of the predictions, predictor by predictor."""

    @property
    def node_events(self) -> tuple[str, ...]:
        """Event of each node in the order of `turns`."""

    def linearised_drift(self) -> np.ndarray:
        """Jacobian of the model at its start, shape (n, n)."""

    def turned_error(self, drift: np.ndarray, p: Any, turns: Sequence[Sequence[int]]) -> ImpulsiveError:
        """Error from packet to packet; drift of shape (n, n), p as in `HybridSystem.flow`, turns of a round."""

    def remembering(self, memory_places: int) -> Self:
        """The same observer with memory_places of memory."""


def packet_findings(
    observer: _DelayedObserver, p: Any, named: Mapping[str, Any], bounds: NetworkBounds
) -> Iterator[Finding]:
    """Longest interval of the packets: (2.17), the spectral radius over a period of the protocol, runs.

    Args:
        observer: to evaluate. p: its parameters, as in `HybridSystem.flow`. named: the same by name. bounds: of Theorem
            2.1.
    """
    what = "interval of the packets" + (", one node each" if _nodes(observer) else "")
    text = f"gamma = {bounds.gain:.3g}, N = {bounds.cycle}, L = {bounds.lipschitz:.3g} 1/s"
    yield as_printed(what, bounds.longest_interval, f"tau_MATI < 1/(gamma |H| N L), {text}", _THEOREM)
    strict = (
        f"gamma |H| N L tau exp(sigma N tau) < 1, the factor left out of (2.17) kept, sigma = {bounds.decay:.3g} 1/s"
    )
    yield as_printed(what, bounds.strict_interval, strict, "proof of (2.45)")
    interval = _interval(observer, p)
    test = "spectral radius over a period of the protocol, model linearised at its start"
    yield limit_found(what, interval, _LONGEST_INTERVAL, test)
    if interval > 0.0:
        high, delay = min(2.0 * interval, _LONGEST_SEARCH), min(float(p.delay), 0.05)
        yield to_simulate(_search(observer, "period", high, named, delayed=True, delay=delay), what)


def delay_findings(
    observer: _DelayedObserver, p: Any, named: Mapping[str, Any], bounds: NetworkBounds
) -> Iterator[Finding]:
    """Longest delay of an observer with predictors: (2.17) and (2.59), the roots of the linearised model, runs.

    Args:
        observer, p, named, bounds: as of `packet_findings`.
    """
    count = observer.predictors
    what = f"delay, {count} predictor{'s' if count > 1 else ''}"
    text = (
        f"(L/sigma) (exp(sigma tau_MAD{'' if count == 1 else f' / {count}'}) - 1) < 1, L = {bounds.lipschitz:.3g} 1/s, "
        f"sigma = {bounds.decay:.3g} 1/s"
    )
    yield as_printed(what, bounds.longest_delay, text, _THEOREM if count == 1 else "Hann 2014, (2.59)")
    exact = exact_predictor_delay(observer.linearised_drift(), count)
    test = "roots of s = l (1 - exp(-s tau)), l the eigenvalues of the model linearised at its start"
    yield limit_found(what, exact, inf, test)
    period = min(observer.model.sample_period, 0.5 * _interval(observer, p))
    if period > 0.0:
        yield to_simulate(_delay_search(observer, p, named, exact, period), what)


def _delay_search(
    observer: _DelayedObserver, p: Any, named: Mapping[str, Any], exact: float, period: float
) -> LimitSearch:
    """Runs with packets at a period [s], the memory stretched to hold the longest delay tried."""
    longest = min(1.5 * exact, _LONGEST_SEARCH * observer.predictors)
    places = int(np.ceil(longest / (observer.predictors * float(p.memory_period)) - 1e-9))
    tried = observer.remembering(min(max(places, observer.memory_places), _MOST_PLACES))
    stretched = {
        **named,
        "memory_period": max(float(p.memory_period), longest / tried.total_places),
        **{f"prediction[{i + 1}]": v + WRONG_START for i, v in enumerate(tried.prediction_starts)},
    }
    return _search(tried, "delay", longest, stretched, period=period)


def _interval(observer: _DelayedObserver, p: Any) -> float:
    """First interval between packets at which the error grows from round to round [s]."""
    return first_unstable_gap(
        [observer.turned_error(observer.linearised_drift(), p, observer.turns)], _LONGEST_INTERVAL
    )


def _search(
    observer: _DelayedObserver, what: Varied, high: float, named: Mapping[str, Any], **settings: Any
) -> LimitSearch:
    settings |= {"nodes": _nodes(observer), "node_events": observer.node_events}
    return model_search(
        cast(ModelObserver, observer), what, high / 50.0, high, named, delay_parameter="delay", **settings
    )


def _nodes(observer: _DelayedObserver) -> int:
    return len(observer.turns) if len(observer.turns) > 1 else 0

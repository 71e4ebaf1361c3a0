"""How long between two packets, and how late, the delayed-state observer survives: printed, exact and by trials.

Bounds come from `certificates.printed_bounds.network_bounds`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, Self, cast

import numpy as np

from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.observer_limits import Limit, PrintedBound, Trial, Varied
from fmu_observer.certificates.printed_bounds.network_bounds import NetworkBounds, exact_predictor_delay
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.model_observer import ModelObserver
from fmu_observer.observers.model_trial import WRONG_START, model_trial

_MOST_PLACES = 60  # of a trial
_LONGEST_INTERVAL = 100.0  # [s] to which the exact limit of the packets is looked for
_LONGEST_TRIAL = 2.0  # [s] of trials, each predictor its own share
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


def packet_limit(observer: _DelayedObserver, p: Any, named: Mapping[str, Any], bounds: NetworkBounds) -> Limit:
    """Longest interval of the packets: (2.17), the spectral radius over a period of the protocol, trials.

    Args:
        observer: to judge. p: its parameters, as in `HybridSystem.flow`. named: the same by name. bounds: of Theorem
            2.1.
    """
    text = f"gamma = {bounds.gain:.3g}, N = {bounds.cycle}, L = {bounds.lipschitz:.3g} 1/s"
    interval = _interval(observer, p)
    high, trial = min(2.0 * interval, _LONGEST_TRIAL), None
    if interval > 0.0:
        trial = _trial(observer, "period", high, named, delayed=True, delay=min(float(p.delay), 0.05))
    return Limit(
        "interval of the packets" + (", one node each" if _nodes(observer) else ""),
        printed=(
            PrintedBound(bounds.longest_interval, f"tau_MATI < 1/(gamma |H| N L), {text}", _THEOREM),
            PrintedBound(
                bounds.strict_interval,
                f"gamma |H| N L tau exp(sigma N tau) < 1, the factor left out of (2.17) kept, sigma = "
                f"{bounds.decay:.3g} 1/s",
                "proof of (2.45)",
            ),
        ),
        exact=interval,
        searched_to=_LONGEST_INTERVAL,
        exact_test="spectral radius over a period of the protocol, model linearised at its start",
        trial=trial,
    )


def delay_limit(observer: _DelayedObserver, p: Any, named: Mapping[str, Any], bounds: NetworkBounds) -> Limit:
    """Longest delay of an observer with predictors: (2.17) and (2.59), the roots of the linearised model, trials.

    Args:
        observer: to judge. p: its parameters, as in `HybridSystem.flow`. named: the same by name. bounds: of Theorem
            2.1.
    """
    exact = exact_predictor_delay(observer.linearised_drift(), observer.predictors)
    longest = min(1.5 * exact, _LONGEST_TRIAL * observer.predictors)
    places = int(np.ceil(longest / (observer.predictors * float(p.memory_period)) - 1e-9))
    tried = observer.remembering(min(max(places, observer.memory_places), _MOST_PLACES))
    stretched = {
        **named,
        "memory_period": max(float(p.memory_period), longest / tried.total_places),
        **{f"prediction[{i + 1}]": v + WRONG_START for i, v in enumerate(tried.prediction_starts)},
    }
    period = min(observer.model.sample_period, 0.5 * _interval(observer, p))
    share = "" if observer.predictors == 1 else f" / {observer.predictors}"
    return Limit(
        f"delay, {observer.predictors} predictor{'s' if observer.predictors > 1 else ''}",
        printed=(
            PrintedBound(
                bounds.longest_delay,
                f"(L/sigma) (exp(sigma tau_MAD{share}) - 1) < 1, L = {bounds.lipschitz:.3g} 1/s, sigma = "
                f"{bounds.decay:.3g} 1/s",
                _THEOREM if observer.predictors == 1 else "Hann 2014, (2.59)",
            ),
        ),
        exact=exact,
        exact_test="roots of s = l (1 - exp(-s tau)), l the eigenvalues of the model linearised at its start",
        trial=_trial(tried, "delay", longest, stretched, period=period) if period > 0.0 else None,
    )


def _interval(observer: _DelayedObserver, p: Any) -> float:
    """First interval between packets at which the error grows from round to round [s]."""
    return first_unstable_gap(
        [observer.turned_error(observer.linearised_drift(), p, observer.turns)], _LONGEST_INTERVAL
    )


def _trial(observer: _DelayedObserver, what: Varied, high: float, named: Mapping[str, Any], **settings: Any) -> Trial:
    settings |= {"nodes": _nodes(observer), "node_events": observer.node_events}
    return model_trial(
        cast(ModelObserver, observer), what, high / 50.0, high, named, delay_parameter="delay", **settings
    )


def _nodes(observer: _DelayedObserver) -> int:
    return len(observer.turns) if len(observer.turns) > 1 else 0

"""Chance of a network: when its nodes send, how long packets take, which are lost or come twice.

All of it depends on the settings and the number of the transmission only: whatever is saved, restored or done again,
the same numbers come out. Standard library and the counter-based noise.
"""

from __future__ import annotations

from functools import partial
from math import sqrt

from cosim.network.settings import NetworkSettings
from plant_models.hybrid.noise import Purpose, standard_normal, uniform_pair
from plant_models.railway.network.protocols import loss_threshold

LOSS, INSTANT, DELAY, _SECOND_DELAY = range(4)
"""Numbers of the noise signals; the first is that of the block `network_protocol`."""


class Chance:
    """Draws for one network.

    Args:
        settings: of the network. start: of the run [s].
    """

    def __init__(self, settings: NetworkSettings, start: float) -> None:
        self._settings, self._start = settings, start
        self._threshold = float(loss_threshold(settings.loss_fraction))
        self._uniforms = partial(uniform_pair, settings.seed, purpose=Purpose.NETWORK)
        self._normal = partial(standard_normal, settings.seed, purpose=Purpose.NETWORK)
        self._lost: list[bool] = []
        self._drift: list[float] = []

    def instant(self, k: int) -> float:
        """When transmission `k` is [s], k = 0, 1, 2, ..."""
        settings = self._settings
        late = settings.jitter * self._uniforms(INSTANT, k)[0] if settings.jitter > 0.0 else 0.0
        return self._start + settings.offset + k * settings.period + late

    def lost(self, k: int) -> bool:
        """Whether the packet of transmission `k` is lost.

        In bursts: a chain of two states (Gilbert 1960), of which `loss_burst` is the mean length of the bad one and
        `loss_fraction` its share.
        """
        settings = self._settings
        if settings.loss_fraction <= 0.0:
            return False
        if settings.loss_burst is None:
            return self._normal(LOSS, k) < self._threshold
        share, stay = settings.loss_fraction, 1.0 - 1.0 / settings.loss_burst
        begin = (1.0 - stay) * share / (1.0 - share) if share < 1.0 else 1.0
        while len(self._lost) <= k:
            bad = self._lost[-1] if self._lost else None
            limit = share if bad is None else stay if bad else begin
            self._lost.append(self._uniforms(LOSS, len(self._lost))[0] < limit)
        return self._lost[k]

    def is_doubled(self, k: int) -> bool:
        """Whether the packet of transmission `k` arrives twice."""
        fraction = self._settings.duplicate_fraction
        return fraction > 0.0 and self._uniforms(INSTANT, k)[1] < fraction

    def delay(self, k: int, *, second: bool = False) -> float:
        """How long after its measurement the packet of transmission `k` is delivered [s].

        Args:
            second: whether its duplicate is meant, which takes a way of its own.
        """
        return max(self._way(k, second=second), self._settings.equalise)

    def _way(self, k: int, *, second: bool) -> float:
        """How long it is on its way [s]."""
        settings, signal = self._settings, _SECOND_DELAY if second else DELAY
        if settings.delay_model == "recorded":
            return settings.delays[(k + second) % len(settings.delays)]
        if settings.delay_model == "uniform":
            return settings.delay + settings.delay_spread * self._uniforms(signal, k)[0]
        if settings.delay_model == "correlated":
            return max(settings.delay + settings.delay_spread * self._drifted(k), 0.0)
        return settings.delay

    def _drifted(self, k: int) -> float:
        """A stationary first-order autoregression of unit variance, ``x_k = a x_{k-1} + sqrt(1 - a^2) n_k``."""
        a = self._settings.delay_correlation
        while len(self._drift) <= k:
            n = self._normal(DELAY, len(self._drift))
            self._drift.append(a * self._drift[-1] + sqrt(1.0 - a * a) * n if self._drift else n)
        return self._drift[k]

"""The particle filter as a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fmu_observer.filtering.particles import effective_size, innovation_square, moments, resampled, reweighted
from fmu_observer.models import ObserverModel
from fmu_observer.observers.discrete.member_filter import DEFAULT, MOST, MemberFilter
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import memory, output_signal, parameter
from plant_models.hybrid.system import Array


class ParticleFilter(MemberFilter):
    """Bootstrap particle filter: members with weights, so that beliefs may have several peaks.

    Each particle's weight is multiplied by the likelihood of the measurement. Where the effective sample size falls
    below `resampling_threshold` times the members, they are resampled systematically, without drawing. Estimate and
    deviation are the mean and the spread of the weighted particles. With few members and small measurement noise all
    weight falls on one particle: `effective_members` tells.

    Args:
        model: a model or the name of one in `MODELS`.
        members: how many particles, 2 to 50.

    Raises:
        ValueError: the model is unknown, a mode of it does not decay and is not measured, or so many members are not
            possible.
    """

    name = "particle_filter"
    description = "Particle filter, periodic measurements"
    source = "Gordon, Salmond, Smith, IEE Proceedings F 140 (1993) 107"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "model": ("pendulum", "linear_pendulum", "freight_train", "cart_pendulum"),
        "members": range(2, MOST + 1),
    }

    def __init__(self, model: str | ObserverModel = "pendulum", members: int = DEFAULT) -> None:
        self.gain_parameters = (
            parameter(
                "resampling_threshold", "1", 0.5, "Effective share of members below which they are resampled", max=1.0
            ),
        )
        self.more_memory = (
            memory("weights", "1", 1.0 / members, "Weights of the members", size=members),
            memory("effective", "1", float(members), "Effective sample size at the last sample"),
        )
        self.more_outputs = (
            output_signal("effective_members", "1", "Effective sample size before resampling", variability="discrete"),
        )
        super().__init__(model, members)

    def corrected(self, members: Array, more: Sequence[Array], u: Any, p: Any) -> Sequence[Array]:
        """Estimate, NIS, variances, particles, weights and effective sample size after the measurement."""
        q, n, count = len(self.model.measurements), self.model.order, self.members
        RN, y, seen = as_matrix(p.measurement_covariance, q, q), self.measured(u), self._seen(members)
        before = more[:count]
        weights = reweighted(before, seen, y, RN)
        found, size = moments(members, weights), effective_size(weights)
        poor = size < p.resampling_threshold * count
        variances = np.stack([found.covariance[i, i] for i in range(n)])
        return (
            found.mean,
            innovation_square(seen, before, y, RN),
            variances,
            np.where(poor, resampled(members, weights), members),
            np.where(poor, np.full(count, 1.0 / count), weights),
            np.reshape(size, (1,)),
        )

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """Estimates, their standard deviations, NIS and the effective sample size."""
        return super().output(t, x, u, p) | {"effective_members": x[x.shape[0] - 2]}

"""The particle filter as a system."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.formulas.filtering.particles import effective_size, innovation_square, moments, resampled, reweighted
from fmu_observer.models.traced_system_model import Source
from fmu_observer.observers.generic.discrete.member_filter import DEFAULT, CorrectedMembers, MemberFilter, Sample
from plant_models.hybrid import Array, discrete_output, memory, parameter


class ParticleFilter(MemberFilter):
    """Bootstrap particle filter: members with weights, so that beliefs may have several peaks.

    Each particle's weight is multiplied by the likelihood of the measurement. Where the effective sample size falls
    below `resampling_threshold` times the members, they are resampled systematically, without drawing. Estimate and
    deviation are the mean and the spread of the weighted particles. With few members and small measurement noise all
    weight falls on one particle: `effective_members` shows.

    Options and signals are those of `MemberFilter`. Defaults [ours]: QN of white noise of density 0.01 in every state,
    RN = 1e-4, particles drawn with the covariance I.

    Args:
        model: see `MemberFilter`. members: how many particles, 2 to 50. options: those of `MemberFilter`.
    """

    name = "particle_filter"
    description = "Particle filter, periodic measurements"
    source = "Gordon, Salmond, Smith, IEE Proceedings F 140 (1993) 107"
    own_parameters = (
        parameter(
            "resampling_threshold",
            "1",
            0.5,
            "Effective share of members below which they are resampled",
            min=0.0,
            max=1.0,
        ),
    )
    own_outputs = (discrete_output("effective_members", "1", "Effective sample size before resampling"),)

    def __init__(self, model: Source = "pendulum", members: int = DEFAULT, **options: Any) -> None:
        self.own_memory = (
            memory("weights", "1", 1.0 / max(members, 1), "Weights of the members", size=max(members, 1)),
            memory("effective", "1", float(members), "Effective sample size at the last sample"),
        )
        super().__init__(model, members, **options)

    def corrected(self, members: Array, x: Any, sample: Sample, u: Any, p: Any) -> CorrectedMembers:
        n, count, some = self.model.order, self.members, sample.count > 0.5
        before, (y, seen, RN) = x.weights, sample[:3]
        weights = np.where(some, reweighted(before, seen, y, RN), before)
        found, size = moments(members, weights), effective_size(weights)
        poor = np.where(some, size, float(count)) < p.resampling_threshold * count
        variances = np.stack([found.covariance[i, i] for i in range(n)])
        weights_after = np.where(poor, np.full(count, 1.0 / count), weights)
        return CorrectedMembers(
            found.mean,
            innovation_square(seen, before, y, RN),
            variances,
            np.where(poor, resampled(members, weights), members),
            {"weights": weights_after, "effective": size},
        )

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().output(t, x, u, p) | {"effective_members": x.effective}

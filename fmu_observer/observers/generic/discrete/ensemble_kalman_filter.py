"""The ensemble Kalman filter as a system."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.formulas.filtering.particles import correct_members, mean_of, variances_of
from fmu_observer.observers.generic.discrete.member_filter import CorrectedMembers, MemberFilter, Sample
from plant_models.hybrid import Array, parameter


class EnsembleKalmanFilter(MemberFilter):
    """Ensemble Kalman filter with perturbed measurements; needs no Jacobian.

    Its estimate is the mean of the members, its covariance theirs, so both carry a sampling error of
    ``1 / sqrt(2 members)`` of their size; `inflation` moves members apart before each correction, against the spread
    that small ensembles lose.

    Options and signals are those of `MemberFilter`. Defaults [ours]: QN of white noise of density 0.01 in every state,
    RN = 1e-4, members drawn with the covariance I.
    """

    name = "ensemble_kalman_filter"
    description = "Ensemble Kalman filter, periodic measurements"
    source = "Burgers, van Leeuwen, Evensen, Monthly Weather Review 126 (1998) 1719"
    perturbs = True
    own_parameters = (parameter("inflation", "1", 1.0, "Factor of the members' distances from their mean", min=1.0),)

    def spread(self, members: Array, p: Any) -> Array:
        return _inflated(members, p.inflation)

    def corrected(self, members: Array, x: Any, sample: Sample, u: Any, p: Any) -> CorrectedMembers:
        draws = np.reshape(u.measurement_normal, (len(self.model.measurements), self.members))
        found = correct_members(self.spread(members, p), sample.seen, sample.y, sample.noise, draws)
        after = np.where(sample.count > 0.5, found.members, members)
        return CorrectedMembers(mean_of(after), found.nis, variances_of(after), after)


def _inflated(members: Array, inflation: Array) -> Array:
    """Members moved away from their mean, against the loss of spread in small ensembles."""
    mean = mean_of(members).reshape(members.shape[0], 1)
    return mean + inflation * (members - mean)

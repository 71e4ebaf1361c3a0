"""Filters of many members over an FMU: an ensemble whose states are moved, and particles whose saved states are only
selected. Formulas come from `fmu_observer.formulas.filtering`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.fmu_filter.belief import FmuBelief, FmuFilter, Noises
from cosim.fmu_model.sealed import SealedModel
from fmu_observer.formulas.filtering import particles

Array = NDArray[np.float64]


class EnsembleFilter(FmuFilter):
    """Ensemble Kalman filter: every member is a state of the FMU, moved by the gain of them all.

    Args:
        model: the FMU. noises: of it. count: members. seed: of the numbers drawn.
    """

    def __init__(self, model: SealedModel, noises: Noises, count: int, seed: int) -> None:
        super().__init__(model, noises)
        self._count, self._seed = count, seed

    def begin(self, x: Array, P: Array) -> FmuBelief:
        """Members drawn about the estimate; arguments as for `FmuFilter`."""
        draws = self._draws(0, len(x))
        members = x[:, None] + particles.drawn(P, draws)
        return self._summed(FmuBelief(x, P, points=members))

    def predict(self, belief: FmuBelief, t: float, h: float, u: Array) -> FmuBelief:
        """The belief a step later; arguments as for `FmuFilter`."""
        members, count = _points(belief), belief.count + 1
        draws = self._draws(2 * count, len(u))
        driven = u[:, None] + (particles.drawn(self.noises.inputs, draws) if len(u) else draws)
        moved = self.model.states_after(t, h, members, driven)
        added = particles.drawn(h * self.noises.intensity, self._draws(2 * count + 1, len(belief.x)))
        return self._summed(replace(belief, points=moved + added, count=count))

    def correct(self, belief: FmuBelief, t: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> FmuBelief:
        """The belief after a measurement; arguments as for `FmuFilter`."""
        members, count = _points(belief), belief.count + 1
        chosen = list(seen)
        readings = self.model.outputs_at(t, members, u, chosen)
        found = particles.correct_members(members, readings, y, R, self._draws(2 * count, len(y)))
        return self._summed(replace(belief, points=found.members, nis=float(found.nis), degrees=len(y), count=count))

    def _draws(self, index: int, rows: int) -> Array:
        """Standard normal numbers of one place in the run, whatever was done again in between."""
        return np.random.default_rng([self._seed, index]).standard_normal((rows, self._count))

    def _summed(self, belief: FmuBelief) -> FmuBelief:
        members = _points(belief)
        mean = particles.mean_of(members)
        apart = particles.deviations_of(members, mean)
        return replace(belief, x=mean, P=apart @ apart.T)


class Saved:
    """A saved state of an FMU, released when nobody holds it any more.

    Args:
        instance: whose state it is; it is saved where it stands.
    """

    def __init__(self, instance: Any) -> None:
        self.instance, self.state = instance, instance.save()

    def __del__(self) -> None:
        with suppress(Exception):  # of an instance that has ended, nothing is left
            self.instance.release(self.state)

    def __deepcopy__(self, memo: Any) -> Saved:
        return self  # it never changes


class FmuParticleFilter(FmuFilter):
    """Bootstrap particle filter over saved states: they are weighted and selected, never written.

    What is not known at the start are start values, what is not known later are inputs. It estimates outputs.

    Args:
        model: the FMU, opened without states. noises: of its inputs.
        spreads: standard deviations of start values, by name. starts: their means, by name.
        count: particles. seed: of the numbers drawn.
    """

    def __init__(
        self,
        model: SealedModel,
        noises: Noises,
        spreads: Mapping[str, float],
        starts: Mapping[str, float],
        count: int,
        seed: int,
    ) -> None:
        super().__init__(model, noises)
        self._spreads, self._starts, self._count, self._seed = dict(spreads), dict(starts), count, seed

    def begin(self, x: Array, P: Array) -> FmuBelief:
        """Instances started from drawn values; the arguments are not used."""
        model, states, columns = self.model, [], []
        draws = np.random.default_rng([self._seed, 0]).standard_normal((self._count, len(self._spreads)))
        for row in draws:
            drawn = zip(self._spreads.items(), row, strict=True)
            model.set_parameters({name: self._starts[name] + spread * float(draw) for (name, spread), draw in drawn})
            model.restart(0.0, np.zeros(0), model.start_inputs)
            states.append(Saved(model.instance))
            columns.append(model.read()[1])
        weights = np.full(self._count, 1.0 / self._count)
        return _weighed(FmuBelief(x, P, points=np.array(columns).T, weights=weights, states=tuple(states)))

    def predict(self, belief: FmuBelief, t: float, h: float, u: Array) -> FmuBelief:
        """The belief a step later; arguments as for `FmuFilter`."""
        model, count = self.model, belief.count + 1
        draws = np.random.default_rng([self._seed, count]).standard_normal((len(u), self._count))
        driven = u[:, None] + (particles.drawn(self.noises.inputs, draws) if len(u) else draws)
        states, columns = [], []
        for i, saved in enumerate(belief.states):
            model.called(partial(model.instance.restore, saved.state))
            model.set_inputs(driven[:, i])
            model.advance(t, h)
            states.append(Saved(model.instance))
            columns.append(model.read()[1])
        return _weighed(replace(belief, points=np.array(columns).T, states=tuple(states), count=count))

    def correct(self, belief: FmuBelief, t: float, u: Array, seen: Sequence[int], y: Array, R: Array) -> FmuBelief:
        """The belief after a measurement; arguments as for `FmuFilter`."""
        points, weights, chosen = _points(belief), belief.weights, list(seen)
        assert weights is not None
        nis = float(particles.innovation_square(points[chosen], weights, y, R))
        weights = np.asarray(particles.reweighted(weights, points[chosen], y, R))
        states = belief.states
        if float(particles.effective_size(weights)) < 0.5 * self._count:
            places = particles.resampled(np.arange(self._count, dtype=float)[None, :], weights)[0]
            kept = np.rint(np.asarray(places)).astype(int)
            points, states = points[:, kept], tuple(states[i] for i in kept)
            weights = np.full(self._count, 1.0 / self._count)
        return _weighed(
            replace(
                belief, points=points, weights=weights, states=states, nis=nis, degrees=len(y), count=belief.count + 1
            )
        )

    def outputs(self, belief: FmuBelief, t: float, u: Array) -> Array:
        """Mean outputs of the particles; arguments as for `FmuFilter`."""
        return belief.x


def _weighed(belief: FmuBelief) -> FmuBelief:
    assert belief.weights is not None
    found = particles.moments(_points(belief), belief.weights)
    return replace(belief, x=np.asarray(found.mean), P=np.asarray(found.covariance))


def _points(belief: FmuBelief) -> Array:
    assert belief.points is not None
    return belief.points

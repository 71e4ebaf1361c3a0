"""O2: particle swarm with a global best."""

from __future__ import annotations

from dataclasses import dataclass

from fmu_observer.design.optimisers.optimiser import Array, Optimiser

_START_SPEED = 0.2  # of the range of each parameter, at most [ours]


@dataclass(eq=False, repr=False, kw_only=True)
class ParticleSwarm(Optimiser):
    """Particle swarm, equations (3.4) and (3.5).

    ``V+ = w V + c1 r1 (Pb - X) + c2 r2 (Pg - X)``, ``X+ = X + V+``, with r1 and r2 uniform in [0, 1] for each particle
    and parameter. Not printed, hence [ours]: velocities start uniform in +-0.2 of the range, positions are clipped to
    the bounds. The thesis recommends c1 in [1.5, 2], c2 in [2, 2.5], w in [0.4, 1.4] and uses the defaults here.

    Args:
        population: number of particles. inertia: w. own: c1, pull to the particle's own best. common: c2, pull to the
            best of all.
    """

    name = "particle_swarm"
    description = "Particle swarm, global best"
    source = "Allaoui 2024, (3.4)-(3.5), section III.3.2"

    population: int = 20
    inertia: float = 0.8
    own: float = 1.0
    common: float = 1.5

    def __post_init__(self) -> None:
        super().__post_init__()
        self._positions = self.uniform(self.population)
        reach = _START_SPEED * (self.upper - self.lower)
        self._velocities = self.random.uniform(-reach, reach, self._positions.shape)
        self._own_best = self._positions
        self._own_costs: Array | None = None

    def propose(self) -> Array:
        """Where the particles are next, shape (population, d)."""
        if self._own_costs is None:
            return self._positions
        r1, r2 = self.random.random((2, *self._positions.shape))
        leader = self._own_best[self._own_costs.argmin()]
        self._velocities = (
            self.inertia * self._velocities
            + self.own * r1 * (self._own_best - self._positions)
            + self.common * r2 * (leader - self._positions)
        )
        return self._positions + self._velocities

    def learn(self, candidates: Array, costs: Array, gradients: Array | None) -> None:
        self._positions = candidates
        if self._own_costs is None:
            self._own_best, self._own_costs = candidates.copy(), costs.copy()
            return
        better = costs < self._own_costs
        self._own_best[better], self._own_costs[better] = candidates[better], costs[better]

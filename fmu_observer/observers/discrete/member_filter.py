"""Base of filters that carry members, each of which runs through the model: ensemble and particle filters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_observer.condition import Condition
from fmu_observer.design.discretisation import process_covariance
from fmu_observer.design.riccati import steady_filter
from fmu_observer.filtering.ensemble import drawn
from fmu_observer.models import ObserverModel, find_model
from fmu_observer.models.discretisation import transition, transition_jacobian
from fmu_observer.models.linearisation import linear_part, start_of
from fmu_observer.observability import require_detectable_model
from fmu_observer.observers.model_observer import ModelObserver, as_matrix
from plant_models.hybrid import PeriodicEvent, Signal, input_signal, memory, output_signal, vector
from plant_models.hybrid.system import Array

DENSITY = 1e-2  # of the default process noise in every state [x2/s] [ours]
VARIANCE = 1e-4  # of the default measurement noise [y2] [ours]
MOST = 50  # members: each stands in the generated C once
DEFAULT = 20


class MemberFilter(ModelObserver):
    """Base of filters whose belief is a number of members.

    The contract: a subclass sets `more_memory` and `more_outputs` before ``super().__init__`` and writes `corrected`
    and `told`. At the first sample members are drawn around the start of the estimates; at later ones each runs through
    the model over the period and feels process noise of its own. Noises are of (seed, signal, index), so that block,
    FMU and a run that is done again draw the same.

    Memory: estimates, NIS, their variances, the members column by column, what the subclass adds, and whether a sample
    has come.

    Args:
        model: a model or the name of one in `MODELS`.
        members: how many, 2 to 50.

    Raises:
        ValueError: the model is unknown, a mode of it does not decay and is not measured, or so many members are not
            possible.
    """

    timing = "periodic"
    discrete = True
    internal_step = 0.1  # nothing flows between samples
    more_memory: tuple[Signal, ...] = ()
    more_outputs: tuple[Signal, ...] = ()
    perturbs = False

    def __init__(self, model: str | ObserverModel = "pendulum", members: int = DEFAULT) -> None:
        chosen = find_model(model)
        require_detectable_model(chosen, self.name)
        if not 2 <= members <= MOST:
            raise ValueError(
                f"{self.name}: members = {members!r}; expected 2 to {MOST}, since each stands in the generated C. "
                "Use the functions of fmu_observer.filtering for more."
            )
        self.members = members
        n, q = chosen.order, len(chosen.measurements)
        QN = process_covariance(linear_part(chosen), DENSITY * np.eye(n), chosen.sample_period)
        self.gain_parameters = (
            self.gain_parameter(
                "process_covariance", QN, "Covariance QN of the process noise of one period, row by row"
            ),
            self.gain_parameter(
                "measurement_covariance", VARIANCE * np.eye(q), "Covariance RN of the measurements, row by row"
            ),
            self.gain_parameter("start_covariance", np.eye(n), "Covariance of the first estimate, row by row"),
            *self.gain_parameters,
        )
        self.extra_memory = (
            memory("squared_innovation", "1", 0.0, "Normalised innovation squared of the last sample"),
            memory("variances", "1", (1.0,) * n, "Variances of the estimates, SI units", size=n),
            memory("members", "1", 0.0, "Members, one after the other, SI units", size=n * members),
            *self.more_memory,
            memory("primed", "1", 0.0, "1 after the first sample"),
        )
        self.extra_outputs = (
            *(
                output_signal(
                    f"{s.name}_std",
                    s.unit,
                    f"Standard deviation of the estimate: {s.description}",
                    variability="discrete",
                )
                for s in chosen.states
            ),
            output_signal("nis", "1", "Normalised innovation squared of the last sample", variability="discrete"),
            output_signal("nis_degrees", "1", "Degrees of freedom of nis", variability="discrete"),
            *self.more_outputs,
        )
        super().__init__(chosen, members=members)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    def corrected(self, members: Array, more: Sequence[Array], u: Any, p: Any) -> Sequence[Array]:
        """What a sample makes of the members.

        Args:
            members: predictions, shape (n, M). more: values of `more_memory`. u: inputs. p: parameters.

        Returns:
            Estimate of shape (n,), NIS, variances of shape (n,), members of shape (n, M), and values of `more_memory`,
            one array each.
        """
        raise NotImplementedError

    # -- what follows -----------------------------------------------------------------------------------------------

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """Members drawn at the first sample, or moved over the period, then corrected; shape of the state."""
        n, count, known = self.model.order, self.members, self.known(u)
        first = 2 * n + 1
        before = [x[first + i * n : first + (i + 1) * n] for i in range(count)]
        noise = np.reshape(u.process_normal, (n, count))
        start = x[:n].reshape(n, 1) + drawn(as_matrix(p.start_covariance, n, n), noise)
        moved = np.stack([transition(self.model, member, known, p.sample_period) for member in before], axis=1)
        moved = moved + drawn(as_matrix(p.process_covariance, n, n), noise)
        members = np.where(x[x.shape[0] - 1] > 0.5, moved, start)
        more = x[first + n * count : x.shape[0] - 1]
        estimate, nis, variances, after, *others = self.corrected(members, more, u, p)
        columns = [after[i, j] for j in range(count) for i in range(n)]
        told = [*(estimate[i] for i in range(n)), nis, *(variances[i] for i in range(n))]
        added = [other[i] for other in others for i in range(other.shape[0])]
        return vector(*told, *columns, *added, 1.0 + 0.0 * nis)

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """Estimates, their standard deviations and NIS."""
        n = self.model.order
        spreads = {f"{s.name}_std": np.sqrt(np.maximum(x[n + 1 + i], 0.0)) for i, s in enumerate(self.model.states)}
        degrees = float(len(self.model.measurements)) + 0.0 * x[n]
        return super().output(t, x, u, p) | spreads | {"nis": x[n], "nis_degrees": degrees}

    def condition_of(self, p: Any) -> Condition:
        """Whether the Kalman filter of the model linearised at the start has a steady state; members add sampling
        errors of ``1 / sqrt(members)``.
        """
        n, q, T = self.model.order, len(self.model.measurements), float(p.sample_period)
        QN, RN = (as_matrix(np.asarray(v), k, k) for v, k in ((p.process_covariance, n), (p.measurement_covariance, q)))
        jacobian = transition_jacobian(self.model)
        F = np.asarray(jacobian(start_of(self.model), np.zeros(len(self.model.inputs)), T))
        steady = steady_filter(F, self.model.C, QN, RN)
        return Condition(
            holds=steady is not None,
            values={
                "members": self.members,
                "spectral_radius": np.inf if steady is None else steady.spectral_radius,
            },
            statement="the Riccati equation of the model, linearised at the start, has a stabilising solution",
            source=self.source,
        )

    def _events(self) -> tuple[Any, ...]:
        n, q = self.model.order, len(self.model.measurements)
        sizes = {"process_normal": n} | ({"measurement_normal": q} if self.perturbs else {})
        noises = tuple(
            input_signal(name, "1", 0.0, "Standard normal numbers", variability="discrete", size=size * self.members)
            for name, size in sizes.items()
        )
        return (PeriodicEvent("sampling", "sample_period", noises=noises, description="The measurements are read"),)

    def _seen(self, members: Array) -> Array:
        """What each member measures, shape (q, M)."""
        return np.stack([self.model.measured(members[:, i]) for i in range(self.members)], axis=1)

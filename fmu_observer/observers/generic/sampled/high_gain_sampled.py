"""Base of the high-gain observers at samples: the gain theta and its shape, and the printed bounds they are judged
by.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found, gap_numbers
from fmu_observer.certificates.gap_error import GapError
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.printed_bounds.high_gain_bounds import high_gain_bounds
from fmu_observer.models.known_models import find_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.sampled_observer import SampledObserver, check_chain, per_measurement
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array, Signal, parameter, vector

THETA = 2.0  # [1/s] [ours]; two states: gaps up to 4 / theta = 2 s


class HighGainSampled(SampledObserver):
    """Base of the observers ``dxh = A xh + phi(xh, u) - theta inv(Delta) K eta``, eta one value a measurement.

    ``Delta = diag(I, I/theta, ..., I/theta^(n/q - 1))``, so the i-th block of the correction carries theta^i. The model
    must be in chain form. Default K: all poles of ``A - K C`` at -1, so (2, 1) for two states, as in the thesis, (4, 6,
    4, 1) for four.

    Args:
        model: a chain, or the name of one. options: of the subclass.
    """

    theta_start: ClassVar[float] = THETA

    def __init__(self, model: str | ObserverModel = "pendulum", **options: Any) -> None:
        chosen = find_model(model)
        width = check_chain(chosen, self.name)
        self.gain_parameters = (
            *self.theta_parameters(),
            self.gain_parameter(
                "high_gain", chain_gain(chosen.order // width, width), "Shape K of the gain, row by row"
            ),
        )
        self.declare_sampled_part(chosen)
        super().__init__(chosen, **options)

    def theta_parameters(self) -> tuple[Signal, ...]:
        """What theta is, or follows from."""
        return (parameter("theta", "1/s", self.theta_start, "High gain", min=0.0),)

    def theta_in_force(self, x: Any, p: Any) -> Array:
        """High gain now [1/s]."""
        return p.theta

    def settled_theta(self, p: Any) -> float:
        """High gain that certificates and conditions speak of [1/s]."""
        return float(p.theta)

    def declare_sampled_part(self, model: ObserverModel) -> None:
        """Declare what stands behind the estimates, one value a measurement."""
        self.extra_states = (per_measurement(model, "innovation", "Error at the last sample, as it acts now"),)

    def correction(self, x: Any, eta: Array, p: Any) -> Array:
        """``theta inv(Delta) K eta`` with theta in force, shape (n,)."""
        theta = self.theta_in_force(x, p)
        powers = vector(*(theta ** (level + 1) for level in self.levels()))
        return powers * (as_matrix(p.high_gain, self.model.order, self.outputs_count) @ eta)

    def decay(self, eta: Array, p: Any) -> Array:
        """``theta K_1 eta`` with K_1 the first block of K, shape (q,)."""
        q = self.outputs_count
        return p.theta * (as_matrix(p.high_gain, self.model.order, q)[:q] @ eta)

    def gain_matrices(self, p: Any) -> tuple[np.ndarray, np.ndarray]:
        """``theta inv(Delta) K`` of shape (n, q), and ``theta K_1`` of shape (q, q), as numbers."""
        q = self.outputs_count
        K = as_matrix(np.asarray(p.high_gain, dtype=float), self.model.order, q)
        theta = self.settled_theta(p)
        powers = theta ** (np.asarray(self.levels()) + 1.0)
        return powers[:, None] * K, theta * K[:q]

    def vertex_error(self, drift: np.ndarray, p: Any) -> GapError:
        """``de = drift e - theta inv(Delta) K c``, ``dc = -theta K_1 c``, ``c = C e`` at a sample."""
        gain, decay = self.gain_matrices(p)
        return ImpulsiveError.with_innovation(drift, gain, decay, self.model.C, self.levels())

    def condition_of(self, p: Any) -> Finding:
        """(1.51) and (1.52) with mu = 1: the smallest theta, and the longest gap, against the model's
        `sample_period`.
        """
        model = self.model
        K = as_matrix(np.asarray(p.high_gain, dtype=float), model.order, self.outputs_count)
        bounds = high_gain_bounds(model.A, K, model.C, float(p.theta), model.lipschitz)
        theta, gap = float(p.theta), model.sample_period
        return condition_found(
            holds=theta >= bounds.smallest_theta and gap <= bounds.longest_gap,
            numbers={
                "theta [1/s]": theta,
                "smallest_theta [1/s]": bounds.smallest_theta,
                **gap_numbers(gap, bounds.longest_gap, model.lipschitz),
                "largest_eigenvalue": bounds.largest,
                "smallest_eigenvalue": bounds.smallest,
            },
            statement="theta >= smallest_theta [1/s], gap <= longest_gap [s]; sufficient, very conservative; the "
            "finding about gaps is exact",
            source="Bouchama 2024, (1.51)-(1.52)",
        )


class ExponentialGain(HighGainSampled):
    """High-gain observer at samples, its gain decaying since the last one: Bouchama 2024, (1.47)-(1.52).

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K eta``, ``d eta = -theta K_1 eta``, ``eta = C xh - y`` at a sample.
    The decay is that of the gain ``exp(-theta K_1 (t - t_k))``, with K_1 the first block of K where the thesis prints
    L^1; where several outputs are measured it is a matrix exponential. Written so it costs one more state a
    measurement, reset at samples, and no time stamp is stored. The model must be a chain with its first block measured.
    Default K: all poles of ``A - K C`` at -1, so (2, 1) for two states; default theta 2 1/s [ours].
    """

    name = "exponential_gain"
    description = "High-gain observer at aperiodic samples, gain decaying since the last"
    source = "Bouchama 2024, (1.47)-(1.52)"

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        eta = self.sampled_part(x)
        predicted = self.model.flow(self.estimates(x), self.known(u))
        return self.named_estimates(predicted - self.correction(x, eta, p)) | self.named_part(-self.decay(eta, p))

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew; the estimates stay continuous."""
        return self.named_part(self.innovation(x, u))


def chain_gain(length: int, width: int = 1) -> np.ndarray:
    """K with all poles of ``A - K C`` at -1 for a chain of `length` blocks of `width` states, shape (length * width,
    width).
    """
    return np.kron(np.poly(-np.ones(length))[1:, None], np.eye(width))

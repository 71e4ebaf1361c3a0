"""High-gain observers whose innovation is held from sample to sample, or decays, exponentially or to an end in finite
time.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.decaying_innovation_error import DecayingError, decaying_error
from fmu_observer.certificates.finding import Finding, as_printed, condition_found, gap_numbers
from fmu_observer.certificates.gap_error import GapError
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.printed_bounds.sampled_gain_bounds import DecayBounds, decay_bounds
from fmu_observer.formulas.correction.innovation_decay import ELAPSED, decay_parameters, innovation_left
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from fmu_observer.observers.generic.sampled.sampled_observer import PERIOD, per_measurement
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array, Signal, memory


class HeldInnovation(HighGainSampled):
    """High-gain observer that holds the innovation of the last sample: Bouchama 2024, section 1.3, its reference 76.

    ``dxh = A xh + phi(xh, u) - theta inv(Delta) K eta``, ``eta = C xh(t_k) - y(t_k)`` on ``[t_k, t_k+1)``:
    `exponential_gain` without decay. For gaps that are short against 1/theta it converges faster, but its limit is
    lower:
    with K = (2, 1) and no drag constant gaps must stay below ``1 / theta``, against ``5 / theta``. The model must be a
    chain with its first block measured. Default theta: 1 1/s [ours]..
    """

    name = "held_innovation"
    description = "High-gain observer at aperiodic samples, innovation held"
    source = "Bouchama 2024, section 1.3, reference 76"
    theta_start = 1.0

    def declare_sampled_part(self, model: ObserverModel) -> None:
        self.extra_memory = (per_measurement(model, "innovation", "Error at the last sample, held", memory),)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        predicted = self.model.flow(self.estimates(x), self.known(u))
        return self.named_estimates(predicted - self.correction(x, self.acting(x, p), p))

    def acting(self, x: Any, p: Any) -> Array:
        """The innovation as it acts now, shape (q,)."""
        return self.sampled_part(x)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew; the estimates stay continuous."""
        return self.named_part(self.innovation(x, u))

    def vertex_error(self, drift: np.ndarray, p: Any) -> GapError:
        """``de = drift e - theta inv(Delta) K c``, ``dc = 0``, ``c = C e`` at a sample."""
        gain, decay = self.gain_matrices(p)
        return ImpulsiveError.with_innovation(drift, gain, 0.0 * decay, self.model.C, self.levels())

    def condition_of(self, p: Any) -> Finding:
        """``theta gap`` of the bare chain against its exact limits, constant and aperiodic, at the model's
        `sample_period`.
        """
        theta, gap = float(p.theta), self.model.sample_period
        found = certify_sampled_error((self.vertex_error(self.model.A, p),), gap, "bare chain")
        return condition_found(
            holds=bool(found.holds),
            numbers={
                "theta_gap": theta * gap,
                "constant_limit": theta * found.condition(CONSTANT_GAP).limit,
                "aperiodic_limit": theta * found.limit,
            },
            statement="theta_gap <= aperiodic_limit for the model without its nonlinear part; the "
            "finding about gaps takes that into account",
            source="exact transition over a gap; the thesis prints no condition",
        )


_DECAY_RATE, _DECAY_EXPONENT = 10.0, 0.5  # [1/s], [1]; Hann 2014, section 3.4.3
_PUBLISHED_THETA, _PUBLISHED_K = 10.0, (1.0, 2.0)


class DecayingInnovation(HeldInnovation):
    """High-gain observer with a held innovation that decays by ``phi' = -eta phi^a``: Hann 2014, (3.72).

    ``dxh = A xh + psi(xh, u) - theta inv(Delta) K phi (C xh(t_k) - y(t_k))``, ``phi(t_k) = 1``. With a = 1 and
    ``eta = theta K_1`` it is `exponential_gain`, and so `output_predictor`; with ``eta = 0`` it is `held_innovation`,
    the constant gain of (3.112). phi is used in closed form, of the time since the sample. With a < 1 the innovation
    ends after ``1/((1 - a) eta)``, whatever the gap: an old sample does nothing more. The model must be a chain with
    its first block measured.

    Presets, for chains of two blocks: `as_published` (theta = 10, K = (1, 2)), which contradicts every published number
    and is unstable from 0.10 s on without decay; `repaired` (theta = 5, K = (2, 1)), which gives them. Both eta = 10
    1/s; a = 0.5, of the printed 1, 0.5 and 0.25.
    """

    name = "decaying_innovation"
    description = "High-gain observer at aperiodic samples, innovation held and decaying to an end"
    source = "Hann 2014, (3.72)-(3.112)"
    theta_start = 5.0

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        super().__init__(model)
        if self.model.order == 2 * self.outputs_count:
            published = np.kron(np.array(_PUBLISHED_K)[:, None], np.eye(self.outputs_count))
            self.presets = {
                "as_published": {"theta": _PUBLISHED_THETA, "high_gain": tuple(map(float, published.ravel()))},
                "repaired": {},
            }
            self.default_preset = "repaired"

    def theta_parameters(self) -> tuple[Signal, ...]:
        return (*super().theta_parameters(), *decay_parameters(_DECAY_RATE, _DECAY_EXPONENT))

    def declare_sampled_part(self, model: ObserverModel) -> None:
        super().declare_sampled_part(model)
        self.extra_states = (ELAPSED,)

    def acting(self, x: Any, p: Any) -> Array:
        """What is left of the innovation, shape (q,)."""
        return innovation_left(x.elapsed, p.decay_rate, p.decay_exponent) * self.sampled_part(x)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return super().flow(t, x, u, p) | {"elapsed": 1.0}

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew; the estimates stay continuous."""
        return super().update(event, t, x, u, p) | {"elapsed": 0.0}

    def vertex_error(self, drift: np.ndarray, p: Any) -> DecayingError | ImpulsiveError:
        """``de = drift e - theta inv(Delta) K phi C e(t_k)``."""
        gain, _ = self.gain_matrices(p)
        return decaying_error(drift, gain, self.model.C, float(p.decay_rate), float(p.decay_exponent), self.levels())

    def bounds(self, p: Any) -> DecayBounds:
        """The sufficient bounds of Theorem 3.4, as printed and as its proof needs them."""
        model = self.model
        K = as_matrix(np.asarray(p.high_gain, dtype=float), model.order, self.outputs_count)
        return decay_bounds(model.A, K, model.C, float(p.theta), float(p.decay_rate), model.lipschitz)

    def printed_bounds(self, p: Any) -> tuple[Finding, ...]:
        """(3.109), and (3.105) with the factor that it leaves out."""
        bounds = self.bounds(p)
        enough, sigma = float(p.theta) > max(1.0, bounds.smallest_theta), 0.25 * bounds.alpha
        premise = "" if enough else f", if theta were above {bounds.smallest_theta:.3g} 1/s"
        strict = f"sigma = {sigma:.3g} 1/s, the factor exp(sigma T) left out of (3.109) kept{premise}"
        return (
            as_printed(PERIOD, bounds.longest_gap, f"tau_MASP, sigma to zero{premise}", "Hann 2014, (3.109)"),
            as_printed(PERIOD, bounds.strict_gap(sigma), f"gamma_0 < 1, {strict}", "Hann 2014, (3.105)"),
        )

    def condition_of(self, p: Any) -> Finding:
        """Theorem 3.4: the smallest theta, and the longest gap, against the model's `sample_period`."""
        bounds, theta, gap = self.bounds(p), float(p.theta), self.model.sample_period
        return condition_found(
            holds=theta > max(1.0, bounds.smallest_theta) and gap <= bounds.longest_gap,
            numbers={
                "theta [1/s]": theta,
                "smallest_theta [1/s]": bounds.smallest_theta,
                "printed_smallest_theta [1/s]": bounds.printed_smallest_theta,
                **gap_numbers(gap, bounds.longest_gap, self.model.lipschitz),
            },
            statement="theta > smallest_theta [1/s], gap <= longest_gap [s]; sufficient, a thousand times too careful; "
            "the finding about gaps is exact",
            source="Hann 2014, Theorem 3.4, (3.109), theta_0 with the factor lmax/lmin that (3.89) needs",
        )

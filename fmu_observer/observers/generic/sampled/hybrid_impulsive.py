"""O18: the hybrid observer, which jumps at samples and is corrected between them too."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.models.known_models import find_model
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.generic.sampled.high_gain_sampled import THETA, chain_gain
from fmu_observer.observers.generic.sampled.sampled_observer import SampledObserver, check_chain, per_measurement
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array

_JUMP_SHARE = 0.5  # of the correction of a sample that is given at once [ours]


class HybridImpulsive(SampledObserver):
    """Hybrid observer, which jumps at samples and is corrected between them too: Bouchama 2024, (1.53)-(1.54).

    ``dxh = A xh + phi(xh, u) + L z``, ``dz = H z``; at a sample ``xh+ = xh + F (y - C xh)``,
    ``z+ = (I - C F)(y - C xh)``.

    The thesis prints no gains. Ours, for a model in chain form: ``L = theta inv(Delta) K`` and ``H = -theta K_1`` are
    those of `exponential_gain`, which this observer is for F = 0, and ``F = s inv(Delta) K inv(K_1)`` gives the share s
    = 1/2 of what that observer would give until the next sample at once (s = 1 leaves z = 0: a pure jump). All three
    are parameters.

    Its certificate takes the slopes of phi as constant over a gap, as those of the other sampled observers do, but here
    that
    matters: close to the limit, at 0.999 of it on the pendulum, slopes that switch within gaps were found to make the
    error grow. The certificate notes up to which gap it covers such slopes too.
    """

    name = "hybrid_impulsive"
    description = "Hybrid observer at aperiodic samples: a jump, and a correction between"
    source = "Bouchama 2024, (1.53)-(1.54)"
    sampled_state = "rest"

    def __init__(self, model: str | ObserverModel = "pendulum") -> None:
        chosen = find_model(model)
        width = check_chain(chosen, self.name)
        L, H, F = _hybrid_gains(chain_gain(chosen.order // width, width), THETA, _JUMP_SHARE)
        self.gain_parameters = (
            self.gain_parameter("flow_gain", L, "Gain L of z, row by row"),
            self.gain_parameter("flow_matrix", H, "Matrix H of z, row by row [1/s]", "1/s"),
            self.gain_parameter("jump_gain", F, "Gain F of the jump, row by row"),
        )
        self.extra_states = (per_measurement(chosen, "rest", "Rest of the innovation, z, as it acts now"),)
        super().__init__(chosen)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        L, H, _ = self._gains(p)
        z = self.sampled_part(x)
        moved = self.model.flow(self.estimates(x), self.known(u)) + L @ z
        return self.named_estimates(moved) | self.named_part(H @ z)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The estimate jumps, and z is set to what the jump left over."""
        _, _, F = self._gains(p)
        missing = -self.innovation(x, u)
        step = F @ missing
        return self.named_estimates(self.estimates(x) + step) | self.named_part(missing - self.model.C @ step)

    def vertex_error(self, drift: np.ndarray, p: Any) -> ImpulsiveError:
        """``de = drift e + L z``, ``dz = H z``; ``e+ = (I - F C) e``, ``z+ = -(I - C F) C e`` at a sample."""
        L, H, F = (np.asarray(gain, dtype=float) for gain in self._gains(p))
        C, n, q = self.model.C, self.model.order, self.outputs_count
        generator = np.block([[drift, L], [np.zeros((q, n)), H]])
        kept, rest = np.eye(n) - F @ C, -(np.eye(q) - C @ F) @ C
        reset = np.block([[kept, np.zeros((n, q))], [rest, np.zeros((q, q))]])
        return ImpulsiveError.of(generator, reset, (*self.levels(), *(0,) * q))

    def remark(self) -> str:
        """The shortest gap covered, besides what is left out."""
        return f"gaps shorter than 1/2400 of the longest are left out, and {super().remark()}"

    def condition_of(self, p: Any) -> Finding:
        """H Hurwitz, and the growth from sample to sample at the model's `sample_period`, its nonlinear part left
        out.
        """
        _, H, _ = self._gains(p)
        abscissa = float(np.linalg.eigvals(np.asarray(H, dtype=float)).real.max())
        error = self.vertex_error(self.model.A, p)
        found = certify_sampled_error((error,), self.model.sample_period, "bare chain")
        return condition_found(
            holds=abscissa < 0.0 and found.numbers[GROWTH] < 1.0,
            numbers={
                "abscissa [1/s]": abscissa,
                "gap [s]": self.model.sample_period,
                "spectral_radius": found.numbers[GROWTH],
                "constant_limit [s]": found.condition(CONSTANT_GAP).limit,
                "aperiodic_limit [s]": found.limit,
            },
            statement="H is Hurwitz (abscissa < 0), the error of the linear part falls at a constant gap "
            "(spectral_radius < 1)",
            source="exact transition over a gap; the thesis prints no condition",
        )

    def _gains(self, p: Any) -> tuple[Array, Array, Array]:
        n, q = self.model.order, self.outputs_count
        return as_matrix(p.flow_gain, n, q), as_matrix(p.flow_matrix, q, q), as_matrix(p.jump_gain, n, q)


def _hybrid_gains(K: np.ndarray, theta: float, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gains L, H, F from a high gain [ours]."""
    n, q = K.shape
    powers = theta ** (np.arange(n) // q)[:, None]
    return theta * powers * K, -theta * K[:q], share * powers * np.linalg.solve(K[:q].T, K.T).T

"""What measurement noise does to an estimate that is corrected at samples: exact, from the transition over a gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from fmu_observer.certificates.sampled_error import SampledError

POINTS = 16  # of time in a gap at which the error is judged


@dataclass(frozen=True)
class NoiseAmplification:
    """Standard deviations of the estimate's error, at their largest over the gaps judged.

    Attributes:
        position: of the position [m], speed: of the speed [m/s], for balise positions with independent errors of 1 m.
        slip: error of the speed [m/s] for an odometer that is constantly 1 m/s off.
    """

    position: float
    speed: float
    slip: float

    def explain(self) -> str:
        """One sentence for the user."""
        return (
            f"Noise of 1 m in the balise positions becomes {self.position:.3g} m in position and {self.speed:.3g} m/s "
            f"in speed, "
            f"1 m/s of odometer slip {self.slip:.3g} m/s."
        )


def noise_amplification(
    errors: Sequence[tuple[SampledError, float]], odometer_gain: tuple[float, float] = (0.0, 0.0)
) -> NoiseAmplification:
    """Amplification at constant gaps, in the long run.

    Args:
        errors: error equations of position and speed with the gap they are judged at [s]; stable there.
        odometer_gain: gain on the odometer error in position [1] and speed [1/s], as contained in the equations' drift.

    Returns:
        The largest standard deviations over all of them.

    Raises:
        ValueError: the error grows at one of the gaps.
    """
    found = [_at(error, gap, np.asarray(odometer_gain, dtype=float)) for error, gap in errors]
    return NoiseAmplification(*map(float, np.max(found, axis=0)))


def _at(error: SampledError, gap: float, odometer_gain: np.ndarray) -> tuple[float, float, float]:
    """Position and speed by balise noise, speed by slip, at one gap."""
    n = error.size
    generator = np.zeros((n + 2, n + 2))  # error, decaying innovation, constant odometer error
    generator[: n + 1, : n + 1] = error.generator
    generator[:n, n + 1] = odometer_gain
    if error.spectral_radius(gap) >= 1.0:
        raise ValueError(f"Noise amplification: the error grows at a constant gap of {gap:.4g} s.")
    moved = [scipy.linalg.expm(generator * t)[:n] for t in np.linspace(0.0, gap, POINTS)]
    # the innovation starts as the first error component
    closed = [m[:, :n] + np.outer(m[:, n], np.eye(n)[0]) for m in moved]
    at_balises = scipy.linalg.solve_discrete_lyapunov(closed[-1], np.outer(moved[-1][:, n], moved[-1][:, n]))
    offset = np.linalg.solve(np.eye(n) - closed[-1], moved[-1][:, n + 1])
    variances = [np.diag(c @ at_balises @ c.T) + m[:, n] ** 2 for c, m in zip(closed, moved, strict=True)]
    slip = max(abs(float((c @ offset + m[:, n + 1])[1])) for c, m in zip(closed, moved, strict=True))
    position, speed = np.sqrt(np.max(variances, axis=0))[:2]
    return float(position), float(speed), slip

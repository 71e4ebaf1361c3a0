"""What balise noise does within a gap, against a Monte Carlo run of the same equations."""

import numpy as np
from scipy.linalg import expm

from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.observers.train.gains.gap_aware import _POINTS, _noise_amplification


def test_the_largest_error_within_a_gap_counts() -> None:
    """A fast correction in a weak loop: the newest balise's own noise moves the estimate within the gap, and fades
    again.
    """
    error, gap = SampledError.of([[-2.0, 1.0], [0.0, -3.0]], (6.0, 1.0), 8.0), 1.0
    rng = np.random.default_rng(0)
    count, instants = 4000, np.linspace(0.0, gap, _POINTS)
    transitions = [expm(error.generator * t) for t in instants]
    e, spread = np.zeros((count, 2)), np.zeros((_POINTS, 2))
    for k in range(30):
        # the innovation: error and noise of the balise
        start = np.column_stack([e, e[:, 0] + rng.standard_normal(count)])
        moved = [start @ m.T for m in transitions]
        e = moved[-1][:, :2]
        if k >= 20:
            spread += np.array([m[:, :2].std(axis=0) for m in moved]) / 10.0
    found = _noise_amplification([(error, gap)])
    assert spread[:, 0].argmax() not in (0, _POINTS - 1)  # else the case shows nothing
    # 40000 draws: the standard deviation is known to 1 / sqrt(2 * 40000) = 0.35 %; four of them.
    np.testing.assert_allclose([found.position, found.speed], spread.max(axis=0), rtol=0.015)

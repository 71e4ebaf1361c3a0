"""Intervals of calibrations on results folders of this package hold the true value as often as they say: journeys that
docs/studies/calibrated_intervals.py does not count, with other trains, noises, steps, algorithms and seeds.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy

import fmus
from plant_models import PLANTS

STUDIES = Path(__file__).resolve().parents[3] / "docs" / "studies"
JOURNEYS = range(10_000, 10_060)
CHANCE = 1e-5
"""Of a share that is right to lie outside of what is demanded: 28 are."""

pytestmark = pytest.mark.compiler


def demanded(level: float) -> tuple[float, float]:
    """How many of the journeys hold, by the binomial law."""
    law = scipy.stats.binom(len(JOURNEYS), level)
    return float(law.ppf(0.5 * CHANCE)), float(law.isf(0.5 * CHANCE))


def test_intervals_hold_as_often_as_they_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 95 %, where too narrow ones are found, and at 50 %, where too wide ones are: quantiles of a normal law."""
    monkeypatch.syspath_prepend(str(STUDIES))
    import calibrated_intervals as study

    path = str(fmus.cached_fmu(PLANTS["longitudinal_train"](), fmi_version=2))
    found = [study.errors(number, path) for number in JOURNEYS]
    for level in (0.95, 0.5):
        share = scipy.stats.norm.ppf(0.5 + 0.5 * level) / scipy.stats.norm.ppf(0.975)
        low, high = demanded(level)
        for key in found[0]:
            count = np.sum([one[key] < share for one in found])
            assert low <= count <= high, (level, key, count)

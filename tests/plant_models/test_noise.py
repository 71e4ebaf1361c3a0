"""The counter-based noise: published vectors, uniformity, normality, and independence of the order of drawing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from plant_models.hybrid.noise import philox4x32, standard_normal, uniform_pair

FULL = 0xFFFFFFFF


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [  # known-answer vectors of Random123 (kat_vectors, philox4x32 10)
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((FULL,) * 4, (FULL,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_philox_gives_the_published_vectors(counter: tuple, key: tuple, expected: tuple) -> None:
    assert philox4x32(counter, key) == expected


def test_uniform_numbers_lie_inside_the_open_interval_and_are_uniform() -> None:
    numbers = np.array([uniform_pair(7, 0, i) for i in range(4000)]).ravel()
    assert numbers.min() > 0.0
    assert numbers.max() < 1.0
    assert stats.kstest(numbers, "uniform").pvalue > 1e-3  # a fixed seed: the test cannot flicker


def test_normal_numbers_are_standard_normal_and_uncorrelated() -> None:
    n = 20000
    numbers = np.array([standard_normal(1, 0, i) for i in range(n)])
    # Four standard errors of mean, variance and lag-one correlation of n independent normal numbers.
    assert abs(numbers.mean()) < 4.0 / np.sqrt(n)
    assert abs(numbers.var() - 1.0) < 4.0 * np.sqrt(2.0 / n)
    assert abs(np.corrcoef(numbers[1:], numbers[:-1])[0, 1]) < 4.0 / np.sqrt(n)
    assert stats.kstest(numbers, "norm").pvalue > 1e-3


def test_seeds_and_signals_give_independent_streams() -> None:
    streams = np.array(
        [
            [standard_normal(seed, signal, i) for i in range(4000)]
            for seed, signal in ((0, 0), (1, 0), (0, 1), (2**40, 0))
        ]
    )
    correlation = np.corrcoef(streams) - np.eye(len(streams))
    assert np.abs(correlation).max() < 4.5 / np.sqrt(4000)  # six pairs: a little more than four standard errors

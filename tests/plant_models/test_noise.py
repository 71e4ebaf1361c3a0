"""The counter-based noise: published vectors, uniformity, normality, and independence of the order of drawing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from plant_models.hybrid.noise import Purpose, _philox4x32, seed_of, standard_normal, uniform_pair

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
    assert _philox4x32(counter, key) == expected


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
            [standard_normal(seed, signal, i, purpose) for i in range(4000)]
            for seed, signal, purpose in (
                *((0, 0, purpose) for purpose in Purpose),
                *((seed, 0, 0) for seed in (1, 2**40, seed_of(0, "a"), seed_of(0, "b"), seed_of(1, "a"))),
                (0, 1, 0),
            )
        ]
    )
    correlation = np.corrcoef(streams) - np.eye(len(streams))
    assert np.abs(correlation).max() < 5.0 / np.sqrt(4000)  # 55 pairs: beyond in one of 30 000 sets of streams


def test_names_are_hashed_as_fnv_says() -> None:
    """Vectors of FNV-1a with 64 bits (draft-eastlake-fnv, appendix C): "", "a", "foobar"; the seed is 53 bits of Philox
    over hash and run seed.
    """
    for name, hashed in (("", 0xCBF29CE484222325), ("a", 0xAF63DC4C8601EC8C), ("foobar", 0x85944171F73967E8)):
        words = _philox4x32((hashed & 0xFFFFFFFF, hashed >> 32, 7, 0), (0x73656564, 0))
        assert seed_of(7, name) == (words[0] >> 5) * 2**26 + (words[1] >> 6)


def test_seeds_of_names_and_runs_differ() -> None:
    names = ["a", "b", "odometer", "odometer_2", "odometer_3", "radar", *(f"m[{i}]" for i in range(500))]
    assert len({seed_of(run_seed, name) for name in names for run_seed in (0, 1, 2**32, 2**53 - 1)}) == 4 * len(names)

"""Counter-based noise: the number drawn depends on (seed, purpose, signal, index) and on nothing else.

A seed that nobody gives follows from the seed of the run and the name of what draws, so that every component of a run,
and every instance of one FMU, has a stream of its own. Two that are given the same seed draw the same on purpose.

Philox 4x32-10 (Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3, SC'11). The same numbers come
out in Python and in the C runtime, whatever was saved, restored or re-run in between. Standard library only.
"""

from __future__ import annotations

import math
from enum import IntEnum

_MASK = 0xFFFFFFFF
_MULTIPLIER_0, _MULTIPLIER_1 = 0xD2511F53, 0xCD9E8D57
_WEYL_0, _WEYL_1 = 0x9E3779B9, 0xBB67AE85
_FNV_START, _FNV_PRIME, _MASK_64 = 0xCBF29CE484222325, 0x100000001B3, 0xFFFFFFFFFFFFFFFF
_NAMING = (0x73656564, 0)
"""Key under which names become seeds."""

SEED_LIMIT = 2**53
"""Seeds lie below: whole numbers that a double holds exactly."""
FROM_NAME = -1
"""In place of a seed: it follows from the seed of the run and the name."""
RUN_SEED = 0
"""Seed of a run that is given none, and of an FMU whose master knows of none."""
SEED_EXPECTED = f"a whole number from 0 to {SEED_LIMIT - 1}"
OWN_SEED_EXPECTED = f"{SEED_EXPECTED}, or {FROM_NAME}: it follows from the seed of the run and the name"


class Purpose(IntEnum):
    """What is drawn for: streams of different purpose are independent though they have the same seed."""

    NOISE = 0
    NETWORK = 1
    TELEGRAMS = 2
    FAULTS = 3
    MEMBERS = 4


def is_seed(value: float) -> bool:
    """Whether a number is a seed: whole, from 0, below `SEED_LIMIT`.

    Args:
        value: the number.
    """
    return 0.0 <= value < SEED_LIMIT and value == math.floor(value)


def seed_of(run_seed: int, name: str) -> int:
    """The seed of a component that is given none.

    Args:
        run_seed: of the run, from 0, below `SEED_LIMIT`.
        name: of the component, which is the instance name of its FMU.

    Returns:
        A whole number below `SEED_LIMIT`: 53 bits of Philox over the run seed and the FNV-1a hash of the name in UTF-8
        (Fowler, Noll, Vo).
    """
    hashed = _FNV_START
    for byte in name.encode():
        hashed = (hashed ^ byte) * _FNV_PRIME & _MASK_64
    words = (hashed & _MASK, hashed >> 32, run_seed & _MASK, run_seed >> 32)
    high, low, _, _ = _philox4x32(words, _NAMING)
    return (high >> 5) << 26 | low >> 6


def _philox4x32(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Ten rounds of Philox 4x32 on a 128-bit counter with a 64-bit key."""
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        product_0 = _MULTIPLIER_0 * c0
        product_1 = _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (product_1 >> 32) ^ c1 ^ k0, product_1 & _MASK, (product_0 >> 32) ^ c3 ^ k1, product_0 & _MASK
        k0, k1 = (k0 + _WEYL_0) & _MASK, (k1 + _WEYL_1) & _MASK
    return c0, c1, c2, c3


def uniform_pair(seed: int, signal: int, index: int, purpose: int = Purpose.NOISE) -> tuple[float, float]:
    """Two independent numbers, uniform on the open interval (0, 1).

    Args:
        seed: non-negative integer below 2**53.
        signal: number of the noise signal within its system.
        index: number of the draw.
        purpose: what it is drawn for.
    """
    key = (seed & _MASK, (seed >> 32) & _MASK)
    a, b, c, d = _philox4x32((index & _MASK, (index >> 32) & _MASK, signal & _MASK, purpose), key)
    scale = 2.0**-53
    first = ((a >> 5) * 67108864.0 + (b >> 6) + 0.5) * scale
    second = ((c >> 5) * 67108864.0 + (d >> 6) + 0.5) * scale
    return first, second


def standard_normal(seed: int, signal: int, index: int, purpose: int = Purpose.NOISE) -> float:
    """A standard normal number by Box and Muller from the two uniform numbers of `uniform_pair`.

    Args:
        seed: of the stream. signal: number of the noise signal. index: number of the draw, from 0.
        purpose: what it is drawn for.
    """
    first, second = uniform_pair(seed, signal, index, purpose)
    return math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)

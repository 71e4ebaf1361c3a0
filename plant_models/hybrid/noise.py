"""Counter-based noise: the number drawn depends on (seed, signal, index) and on nothing else.

Philox 4x32-10 (Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3, SC'11). The same numbers come
out in Python and in the C runtime, whatever was saved, restored or re-run in between. Standard library only.
"""

from __future__ import annotations

import math

_MASK = 0xFFFFFFFF
_MULTIPLIER_0, _MULTIPLIER_1 = 0xD2511F53, 0xCD9E8D57
_WEYL_0, _WEYL_1 = 0x9E3779B9, 0xBB67AE85


def philox4x32(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Ten rounds of Philox 4x32 on a 128-bit counter with a 64-bit key.

    Args:
        counter: four 32-bit words.
        key: two 32-bit words.

    Returns:
        Four 32-bit words, uniform over their range.
    """
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        product_0 = _MULTIPLIER_0 * c0
        product_1 = _MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (product_1 >> 32) ^ c1 ^ k0, product_1 & _MASK, (product_0 >> 32) ^ c3 ^ k1, product_0 & _MASK
        k0, k1 = (k0 + _WEYL_0) & _MASK, (k1 + _WEYL_1) & _MASK
    return c0, c1, c2, c3


def uniform_pair(seed: int, signal: int, index: int) -> tuple[float, float]:
    """Two independent numbers, uniform on the open interval (0, 1).

    Args:
        seed: non-negative integer below 2**53.
        signal: number of the noise signal within its system.
        index: number of the draw.
    """
    key = (seed & _MASK, (seed >> 32) & _MASK)
    a, b, c, d = philox4x32((index & _MASK, (index >> 32) & _MASK, signal & _MASK, 0), key)
    scale = 2.0**-53
    first = ((a >> 5) * 67108864.0 + (b >> 6) + 0.5) * scale
    second = ((c >> 5) * 67108864.0 + (d >> 6) + 0.5) * scale
    return first, second


def standard_normal(seed: int, signal: int, index: int) -> float:
    """A standard normal number by Box and Muller from the two uniform numbers of `uniform_pair`.

    Args:
        seed: of the run. signal: number of the noise signal. index: number of the draw, from 0.
    """
    first, second = uniform_pair(seed, signal, index)
    return math.sqrt(-2.0 * math.log(first)) * math.cos(2.0 * math.pi * second)

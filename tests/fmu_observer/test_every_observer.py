"""Laws of every registered observer: it converges, survives missing samples, repeats itself, keeps its word."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import Follower, Situation, observers

ALL = observers()
SAMPLED = {name: s for name, s in ALL.items() if s.system.triggered_events}
CERTIFIED = {name: s for name, s in SAMPLED.items() if hasattr(s.system, "sampled_events")}

every = pytest.mark.parametrize("name", ALL)
DURATION = 20.0


def gaps_of(s: Situation, longest: float = 1.0) -> list[float]:
    return [s.gap * longest] * round(DURATION / (s.gap * longest))


@every
def test_it_forgets_a_wrong_start(name: str) -> None:
    follower = Follower(ALL[name]).start()
    first = follower.error()
    follower.follow(gaps_of(ALL[name]))
    # No noise and the right model: what is left is transient, and the feeding of inputs that are held for 2 ms (second
    # order).
    assert follower.error() < ALL[name].left * first, follower.errors()


@pytest.mark.parametrize("name", SAMPLED)
def test_missing_samples_delay_it_but_do_not_destroy_it(name: str) -> None:
    follower = Follower(SAMPLED[name]).start()
    first = follower.error()
    follower.follow(gaps_of(SAMPLED[name], 0.4), skip=lambda k: k % 7 in (2, 3))
    assert follower.error() < 2e-2 * first, follower.errors()


@every
def test_redo_after_restore_is_bit_identical(name: str) -> None:
    follower = Follower(ALL[name], feed=0.02).start()
    follower.follow([ALL[name].gap] * 3)
    snapshot = follower.runtime.snapshot()
    follower.follow([ALL[name].gap] * 4)
    first = follower.runtime.memory.copy()
    follower.follow([0.7 * ALL[name].gap])
    follower.runtime.restore(snapshot)
    follower.follow([ALL[name].gap] * 4)
    np.testing.assert_array_equal(follower.runtime.memory, first)


def limit_of(name: str) -> float:
    certificate = next(CERTIFIED[name].system.findings(CERTIFIED[name].gap))  # type: ignore[attr-defined]
    return float(certificate.value)


@pytest.mark.parametrize("name", CERTIFIED)
@settings(max_examples=5)
@given(data=st.data())
def test_a_certificate_is_not_contradicted_by_a_run(name: str, data: Any) -> None:
    """Two copies of an observer, of different start, forget their difference over any gaps that are certified."""
    limit = limit_of(name)
    assert isfinite(limit)
    assert limit > 0.0
    longest = min(0.98 * limit, 5.0)
    fractions = data.draw(st.lists(st.floats(0.2, 1.0), min_size=25, max_size=25))
    run: Callable[[float], np.ndarray] = lambda offset: _final(CERTIFIED[name], longest * np.array(fractions), offset)  # noqa: E731
    difference, before = run(0.0) - run(0.3), 0.3
    assert np.abs(difference).max() < 0.5 * before, f"limit {limit:.4g} s"


def _final(s: Situation, gaps: np.ndarray, offset: float) -> np.ndarray:
    follower = Follower(s, feed=0.02)
    follower.runtime.x[0] += offset
    follower.start()
    follower.follow(map(float, gaps))
    return follower.runtime.x[:2].copy()

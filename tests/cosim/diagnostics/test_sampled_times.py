"""Times by samples: one call that the operating system interrupted does not stand for all of them."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from cosim.diagnostics import call_statistics
from cosim.diagnostics.call_statistics import EVERY, CallStatistics
from cosim.diagnostics.sampled_times import BINS, bin_of, typical_seconds


def typical(times: Sequence[float]) -> float:
    calls, seconds = [0] * BINS, [0.0] * BINS
    for time in times:
        calls[bin_of(time)] += 1
        seconds[bin_of(time)] += time
    return typical_seconds(calls, seconds)


def test_nothing_timed_takes_no_time() -> None:
    assert typical([]) == 0.0


def test_ordinary_times_give_their_mean() -> None:
    assert typical([1e-6, 2e-6, 3e-6, 6e-6]) == pytest.approx(3e-6)
    assert typical([0.0, 1e-9]) == pytest.approx(0.5e-9)


def test_steps_that_do_more_now_and_then_count() -> None:
    assert typical([1e-6] * 9 + [6e-6]) == pytest.approx(1.5e-6)


def test_an_interrupted_call_does_not_count() -> None:
    assert typical([1e-6] * 99 + [4e-3]) == pytest.approx(1e-6)
    assert typical([1e-6] * 99 + [1e9]) == pytest.approx(1e-6)


def test_every_time_has_a_bin() -> None:
    assert [bin_of(t) for t in (0.0, 1e-9, 2.5e-9, 4.5e-9, 1e-6, 1.0, 1e9)] == [0, 0, 1, 2, 9, 29, BINS - 1]


def test_samples_stand_for_calls_that_were_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(time for number in range(40) for time in (number, number + (1e-6 if number != 3 else 0.5)))
    monkeypatch.setattr(call_statistics, "perf_counter", lambda: next(clock))
    statistics = CallStatistics()
    call = statistics.counting(lambda: None, lambda error: error)
    for _ in range(20 * EVERY):
        call()
    statistics.add(2.0, 3)
    assert statistics.count == 20 * EVERY + 3
    assert statistics.seconds == pytest.approx(2.0 + 20 * EVERY * 1e-6, rel=1e-6)

"""Comparisons of real runs: the same again, another step size, one thing changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Outcome, Result, compare


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    outcome: Outcome = small().run()
    return outcome


def with_values(result: Result, **changed: Any) -> Result:
    table = result.table.copy()
    for name, values in changed.items():
        table[name.replace("__", ".")] = values
    return replace(result, table=table)


def test_a_run_done_again_is_equal(outcome: Outcome) -> None:
    comparison = compare(outcome, small().run())
    assert comparison.equal
    assert {signal.status for signal in comparison.signals} == {"equal"}
    assert comparison.events.compared
    assert comparison.events.matched == len(outcome.result.events) == 3
    assert not comparison.notes


def test_every_third_row_with_the_events_is_as_good(outcome: Outcome) -> None:
    """Whatever the signals of a run are: smooth, sampled, reset by telegrams, indicators."""
    result = outcome.result
    event = np.zeros(len(result.time), dtype=bool)
    pairs = np.flatnonzero(np.diff(result.time) == 0.0)
    event[pairs] = event[pairs + 1] = True
    keep = event | (np.arange(len(event)) % 3 == 0)
    keep[-1] = True
    thin = replace(result, table=result.table[keep])
    assert compare(thin, result).equal
    assert compare(result, thin).equal


def test_one_percent_of_mass_is_found(outcome: Outcome) -> None:
    heavier = small()
    heavier.set("locomotive.mass", 1.01 * 90e3)
    comparison = compare(outcome, heavier.run())
    assert "locomotive.acceleration" in [signal.name for signal in comparison.failed]
    assert any("locomotive.mass" in note for note in comparison.notes)


def test_a_reading_one_sample_late_is_a_time_error(outcome: Outcome) -> None:
    result = outcome.result
    before = np.maximum(np.searchsorted(result.time, result.time - 0.01 + 1e-9, side="right") - 1, 0)
    rising = 10.0 + np.round(result.time / 0.05) * 0.1
    one, two = with_values(result, odometer__reading=rising), with_values(result, odometer__reading=rising[before])
    found = compare(one, two)["odometer.reading"].findings
    assert [finding.kind for finding in found] == ["jump_time"]
    assert found[0].size == pytest.approx(0.01, abs=1e-9)

"""What signals that differ have in common: a factor, an offset, a delay is found again, and noise is none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_results import compared, made

from cosim.comparison.common_change import CommonChange, common_changes

TIME = np.arange(401) * 0.01
UNITS = {"speed": "m/s", "place": "m", "effort": "N"}
Change = Callable[[Callable[[np.ndarray], np.ndarray]], np.ndarray]

# none of them is a line or an exponential, which a delay changes as an offset or a factor does
CURVES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "speed": lambda t: 8.0 + 3.0 * np.sin(2.0 * t),
    "place": lambda t: 20.0 + 8.0 * t + np.cos(3.0 * t),
    "effort": lambda t: 1e5 * np.sin(t) * np.sin(5.0 * t),
}


def found(change: Change, others: int = 0) -> list[CommonChange]:
    equal = {f"other{k}": np.sin(TIME + k) for k in range(others)}
    one = {name: curve(TIME) for name, curve in CURVES.items()}
    two = {name: change(curve) for name, curve in CURVES.items()}
    return common_changes(compared(made(TIME, **one, **equal, units=UNITS), made(TIME, **two, **equal, units=UNITS)))


@settings(deadline=None, max_examples=15)
@given(st.floats(0.002, 50.0), st.sampled_from([-1.0, 1.0]), st.integers(0, 2))
def test_a_factor_is_found_again(size: float, sign: float, others: int) -> None:
    factor = 1.0 + sign * size
    (one,) = found(lambda curve: factor * curve(TIME), others)
    assert (one.kind, set(one.signals)) == ("factor", set(CURVES))
    assert one.value == pytest.approx(factor, rel=1e-9, abs=1e-9)
    assert one.text.startswith("all 3 signals that differ" if others else "all 3 signals ")


@settings(deadline=None, max_examples=10)
@given(st.floats(0.003, 0.15), st.sampled_from([-1.0, 1.0]))
def test_a_delay_is_found_again(size: float, sign: float) -> None:
    (one,) = found(lambda curve: curve(TIME - sign * size))
    assert (one.kind, set(one.signals)) == ("delay", set(CURVES))
    assert one.value == pytest.approx(sign * size, rel=0.05, abs=2e-4)  # rows are 10 ms apart, lines between them
    assert ("late" if sign > 0.0 else "early") in one.text


@settings(deadline=None, max_examples=10)
@given(st.floats(0.01, 100.0), st.sampled_from([-1.0, 1.0]))
def test_an_offset_is_found_again_and_belongs_to_a_unit(size: float, sign: float) -> None:
    changes = found(lambda curve: curve(TIME) + sign * size)
    assert {change.kind for change in changes} == {"offset"}
    assert {change.unit: change.value for change in changes} == pytest.approx(
        dict.fromkeys(UNITS.values(), sign * size)
    )
    assert all(("high" if sign > 0.0 else "low") in change.text for change in changes)


def test_words_for_signs_zeros_units_and_steps() -> None:
    assert found(lambda curve: -curve(TIME))[0].text == "all 3 signals have the opposite sign"
    assert found(lambda curve: 0.0 * curve(TIME))[0].text == "all 3 signals are zero"
    assert found(lambda curve: 1.01 * curve(TIME))[0].text == "all 3 signals scale by +1 %"
    assert "a factor of 3.6, as from m/s to km/h" in found(lambda curve: 3.6 * curve(TIME))[0].text
    assert "a factor of 0.01, the inverse of per cent" in found(lambda curve: 0.01 * curve(TIME))[0].text
    assert found(lambda curve: curve(np.maximum(TIME - 0.02, 0.0)))[0].text == "all 3 signals are 0.02 s late (2 steps)"


def test_noise_steps_and_missing_numbers_have_nothing_in_common() -> None:
    noise = np.random.default_rng(0).standard_normal(len(TIME))
    assert found(lambda curve: curve(TIME) + 0.1 * noise) == []
    assert found(lambda curve: np.where(TIME > 2.0, 2.0, 1.0) * curve(TIME)) == []
    assert found(lambda curve: np.where(TIME > 2.0, np.nan, 1.01) * curve(TIME)) == []


def test_of_several_changes_each_is_reported_with_its_signals() -> None:
    one = {name: curve(TIME) for name, curve in CURVES.items()}
    two = {**one, "speed": 1.02 * one["speed"], "place": 1.02 * one["place"], "effort": -one["effort"]}
    first, second = common_changes(compared(made(TIME, **one), made(TIME, **two)))
    assert (set(first.signals), first.value) == ({"speed", "place"}, pytest.approx(1.02))
    assert second.text == "effort has the opposite sign"


@settings(deadline=None, max_examples=10)
@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(1, 9), st.integers(1, 7), st.booleans())
def test_the_delay_of_a_held_signal_is_known_between_rows(
    gaps: list[int], delay: int, every: int, is_late: bool
) -> None:
    """Changes fall between rows of 10 ms; one side keeps fewer rows, and both that surround a change."""
    changes = 0.105 + 0.1 * np.cumsum(gaps)
    time = np.arange(2000) * 0.01
    before, after = (
        np.searchsorted(changes + shift, time).astype(float) for shift in (0.0, 0.01 * delay)[:: 1 if is_late else -1]
    )
    rows = np.arange(len(time)) % every == 0
    for row in np.flatnonzero(np.diff(before)):
        rows[[row, row + 1]] = True
    few, all_rows = made(time[rows], discrete=["y"], y=before[rows]), made(time, discrete=["y"], y=after)
    (one,) = common_changes(compared(few, all_rows))
    text = f"y is between {0.01 * (delay - 1):.4g} and {0.01 * (delay + 1):.4g} s {'late' if is_late else 'early'}"
    assert one.text.startswith(text)
    assert one.value == pytest.approx(0.01 * delay * (1.0 if is_late else -1.0))


def test_the_delay_of_a_held_signal_with_the_rows_of_its_events_is_exact() -> None:
    def stepped(at: float) -> tuple[np.ndarray, np.ndarray]:
        time = np.sort([*TIME, at, at])
        values = (time > at).astype(float)
        values[np.searchsorted(time, at) + 1] = 1.0
        return time, values

    one, two = (made(time, discrete=["y"], y=values) for time, values in (stepped(1.001), stepped(1.0234)))
    assert [change.text for change in common_changes(compared(one, two))] == ["y is 0.0224 s late"]

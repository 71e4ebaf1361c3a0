"""Whole numbers that are held (codes, modes, counters): one off is another one, however far the values reach."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from made_results import compared, kinds, made

from cosim.baselines import check, read_baseline, write_baseline
from cosim.comparison.compare import compare_results
from cosim.comparison.tolerance import Tolerance, Tolerances

DEFAULT = Tolerance()
CODES = st.lists(st.integers(-(10**12), 10**12), min_size=3, max_size=20)


@settings(deadline=None, max_examples=30)
@given(CODES, st.integers(1, 3), st.data())
def test_a_code_that_is_a_little_off_differs(codes: list[int], off: int, data: st.DataObject) -> None:
    time, values = np.arange(len(codes)), np.array(codes, dtype=float)
    other = values.copy()
    other[data.draw(st.integers(0, len(codes) - 1))] += off
    one, two = (made(time, discrete=["code"], code=column) for column in (values, other))
    assert not compared(one, two, DEFAULT).equal
    if values.any():  # of a signal that is zero throughout, nothing says how large rounding is
        assert compared(one, made(time, discrete=["code"], code=values + 1e-5), DEFAULT).equal
    some = bool(values.any())
    for fits, stated in ((True, {"c*": {"absolute": 3.0}}), (some, {"code": 3.0}), (False, {"c*": 0.3})):
        assert compare_results(one, two, Tolerances.of(by_signal=stated)).equal == fits


def test_a_quantity_keeps_the_share_of_its_range() -> None:
    time = np.arange(100.0)
    speed = 1e4 * np.sin(time)
    assert compared(made(time, discrete=["v"], v=speed), made(time, discrete=["v"], v=speed + 1.0), DEFAULT).equal


def test_an_indicator_of_a_plain_table_is_whole_numbers_too() -> None:
    time = np.arange(100.0)
    code = np.where(time > 30.0, 12000.0, 100.0)
    assert "value" in kinds(compared(made(time, code=code), made(time, code=code + 1.0), DEFAULT)["code"])


def test_a_counter_that_counts_far_is_kept_in_full(tmp_path: Path) -> None:
    time = np.arange(50.0)
    count = 3e9 * time + 7.0
    write_baseline(made(time, discrete=["n"], n=count), tmp_path / "b.json")
    baseline = read_baseline(tmp_path / "b.json")
    assert np.array_equal(baseline.result["n"], count)
    assert check(made(time, discrete=["n"], n=count), baseline).equal
    count[20:] += 1.0
    assert not check(made(time, discrete=["n"], n=count), baseline).equal


def test_a_number_that_vanishes_is_the_result_s_though_the_baseline_rounds_its_instants() -> None:
    time = np.arange(100.0)
    values = np.where(time < 60.0, time, np.nan)
    fine = np.arange(0.0, 99.5, 0.5)
    result = made(fine + 4e-9, y=np.where(fine < 60.0, fine, np.nan))
    found = compared(made(time, y=time), result, DEFAULT)["y"].findings
    assert any("the result is not a number" in finding.text for finding in found if finding.kind == "nan")
    assert not compared(made(time, y=values), made(time, y=time), DEFAULT).equal


@settings(deadline=None, max_examples=30)
@given(st.integers(3, 30), st.integers(1, 4), st.booleans())
def test_a_change_in_the_last_row_is_seen(rows: int, finer: int, lost: bool) -> None:
    coarse, fine = np.arange(float(rows)), np.arange(0.0, rows - 0.9, 1.0 / finer)
    reference = made(coarse, discrete=["y"], y=np.where(coarse == coarse[-1], float(lost), 0.0))
    result = made(fine, discrete=["y"], y=np.where(fine == fine[-1], float(not lost), 0.0))
    assert not compared(reference, result, DEFAULT).equal
    if lost and finer == 1:  # a change that is late by less than allowed comes after the end
        assert compared(reference, result, Tolerance(time=2.0)).equal


@settings(deadline=None, max_examples=20)
@given(st.floats(-2e9, 2e9))
def test_what_is_seen_does_not_depend_on_where_time_begins(start: float) -> None:
    time = start + np.arange(101) * 0.1
    last, pulse = np.zeros(101), np.zeros(101)
    last[-1] = pulse[50] = 1.0
    zero, discrete = np.zeros(101), ["y"]
    assert not compared(made(time, discrete=discrete, y=last), made(time, discrete=discrete, y=zero), DEFAULT).equal
    few = made(time[::20], discrete=discrete, y=zero[::20])
    assert not compared(made(time, discrete=discrete, y=pulse), few, DEFAULT).equal


def test_an_indicator_with_missing_values_is_whole_numbers_too() -> None:
    time = np.arange(100.0)
    code = np.where(time < 5.0, np.nan, np.where(time > 30.0, 12000.0, 100.0))
    assert not compared(made(time, code=code), made(time, code=code + 1.0), DEFAULT).equal


def test_rows_without_numbers_that_pass_are_noted() -> None:
    time = np.arange(101.0)
    none, sine = np.full(101, np.nan), np.sin(0.01 * time)
    rest = np.where(np.arange(101) % 2, np.nan, sine)
    for rows, known in ((1, []), (2, ["Compared at 51 instants, those of reference; result has 101."])):
        found = compared(made(time[::rows], y=none[::rows], k=sine[::rows]), made(time, y=none, k=sine), DEFAULT)
        assert found.equal
        assert found.notes == ["y: no row holds a number, so nothing was compared.", *known]
    found = compared(made(time[::2], y=sine[::2]), made(time, y=rest), DEFAULT)
    words = "y: 50 of 101 rows of the result hold no number, all of them between two rows of the reference."
    assert (found.equal, found.notes[0]) == (True, words)

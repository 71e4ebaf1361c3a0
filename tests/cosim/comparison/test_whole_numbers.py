"""Whole numbers that are held (codes, modes, counters): one off is another one, however far the values reach."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from made_results import compared, kinds, made

from cosim.baselines import check, read_baseline, write_baseline
from cosim.comparison.compare import compare_results
from cosim.comparison.tolerance import Tolerance, Tolerances

DEFAULT = Tolerance()
CODES = st.lists(st.integers(-(10**12), 10**12), min_size=3, max_size=20)


@given(CODES, st.integers(1, 3), st.data())
def test_a_code_that_is_a_little_off_differs(codes: list[int], off: int, data: st.DataObject) -> None:
    time, values = np.arange(len(codes)), np.array(codes, dtype=float)
    other = values.copy()
    other[data.draw(st.integers(0, len(codes) - 1))] += off
    one, two = (made(time, discrete=["code"], code=column) for column in (values, other))
    assert not compared(one, two, DEFAULT).equal
    if values.any():  # of a signal that is zero throughout, nothing says how large rounding is
        assert compared(one, made(time, discrete=["code"], code=values + 1e-5), DEFAULT).equal
    stated = Tolerances.of(by_signal={"code": {"absolute": 3.0}})
    assert compare_results(one, two, stated).equal


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


@given(st.integers(3, 30), st.integers(1, 4), st.booleans())
def test_a_change_in_the_last_row_is_seen(rows: int, finer: int, lost: bool) -> None:
    coarse, fine = np.arange(float(rows)), np.arange(0.0, rows - 0.9, 1.0 / finer)
    reference = made(coarse, discrete=["y"], y=np.where(coarse == coarse[-1], float(lost), 0.0))
    result = made(fine, discrete=["y"], y=np.where(fine == fine[-1], float(not lost), 0.0))
    assert not compared(reference, result, DEFAULT).equal
    if lost and finer == 1:  # a change that is late by less than allowed comes after the end
        assert compared(reference, result, Tolerance(time=2.0)).equal

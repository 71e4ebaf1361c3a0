"""Columns of a live page: what is decoded is what was packed, within the stated tolerance, and extremes stay."""

from __future__ import annotations

import zlib
from base64 import b64decode

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.report.live.live_page import LivePage, PageCurve, PagePanel, PageRecording, PageVerdict
from cosim.report.live.packed_column import INSTANTS, PackedColumn, pack
from cosim.report.live.page_data import page_data
from cosim.report.live.render import live_page
from fmus.tables.line_picture import extreme_rows

VALUES = st.lists(
    st.one_of(
        st.floats(allow_subnormal=True),
        st.floats(-1e3, 1e3),
        st.sampled_from([0.0, np.nan, np.inf, -np.inf, 1e-300, 1e308, -1e308]),
    ),
    max_size=60,
)


def decoded(column: PackedColumn) -> np.ndarray:
    """As the page decodes it, written a second time."""
    planes = np.frombuffer(zlib.decompress(b64decode(column.text)), np.uint8).reshape(4, -1).astype(np.uint32)
    zigzag = planes[0] | planes[1] << 8 | planes[2] << 16 | planes[3] << 24
    integers = (zigzag >> 1).astype(np.int64) ^ -(zigzag & 1).astype(np.int64)
    for _ in range(column.order):
        integers = (np.cumsum(integers) + 2**31) % 2**32 - 2**31
    places = (integers % 2**32).astype(np.uint64)
    if column.kind == "grid":
        values = column.low + places * ((column.high - column.low) / column.steps)
        values[places == column.steps] = column.high
    else:
        values = (places << np.uint64(32)).view(np.float64).copy()
    if column.odd:
        odd = np.frombuffer(zlib.decompress(b64decode(column.odd)), np.uint8)
        for code, value in ((1, np.nan), (2, -np.inf), (3, np.inf)):
            values[odd == code] = value
    return values


def assert_decodes(values: np.ndarray, column: PackedColumn) -> None:
    found, finite = decoded(column), np.isfinite(values)
    np.testing.assert_array_equal(found[~finite], values[~finite])
    error = np.abs(found[finite] - values[finite])
    allowed = column.tolerance * (1.0 if column.kind == "grid" else np.abs(values[finite]) + 1e-300)
    assert np.all(error <= allowed)


@given(VALUES)
def test_what_is_packed_is_decoded_within_the_tolerance(listed: list[float]) -> None:
    values = np.array(listed)
    column = pack(values)
    assert column.count == len(values)
    assert_decodes(values, column)


@given(st.integers(0, 2**31), st.sampled_from([1e-6, 1.0, 1e9]), st.floats(0.0, 1.0))
def test_a_signal_is_exact_to_its_noise_and_keeps_its_extremes(seed: int, scale: float, noise: float) -> None:
    rng = np.random.default_rng(seed)
    values = scale * (np.cumsum(rng.standard_normal(300)) + noise * rng.standard_normal(300))
    column = pack(values)
    found = decoded(column)
    assert_decodes(values, column)
    assert column.kind == "grid"
    assert (found.min(), found.max()) == (values.min(), values.max())
    assert column.tolerance <= 1e-5 * np.ptp(values)


def test_a_signal_that_diverged_keeps_what_it_was_before() -> None:
    values = np.append(np.sin(np.arange(500.0)), np.exp(np.arange(300.0)))
    column = pack(values)
    assert column.kind == "float"
    np.testing.assert_allclose(decoded(column), values, rtol=2.0**-21)


@pytest.mark.parametrize("every", [2, 4, 10, 100])
def test_a_signal_that_mostly_rests_keeps_what_it_does_beside_one_large_value(every: int) -> None:
    """A residual or a slip: zero, except at some rows, and one outlier."""
    values = np.zeros(2000)
    values[::every] = 0.3 * np.sin(np.arange(0, 2000, every) + 1.0)
    values[1001] = 1e9
    np.testing.assert_allclose(decoded(pack(values)), values, rtol=1e-6)


@given(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=60))
def test_instants_never_fall_and_equal_ones_stay_equal(listed: list[float]) -> None:
    time = np.sort(np.array(listed))
    found = decoded(pack(time, INSTANTS))
    assert np.all(np.diff(found) >= 0.0)
    assert np.all((np.diff(found) == 0.0)[np.diff(time) == 0.0])
    np.testing.assert_allclose(found, time, atol=1e-5)


@given(VALUES.filter(len), st.integers(1, 20))
def test_reduced_curves_keep_both_ends_and_the_extremes(listed: list[float], pieces: int) -> None:
    values = np.array(listed)
    rows = extreme_rows(values, pieces)
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, len(values) - 1)
    assert len(rows) <= 4 * pieces
    known = values[~np.isnan(values)]
    if len(known):
        kept = values[rows][~np.isnan(values[rows])]
        assert (kept.min(), kept.max()) == (known.min(), known.max())


def test_smooth_signals_take_less_than_a_byte_a_row() -> None:
    values = 1e4 * np.sin(np.arange(20_000) / 500.0)
    assert pack(values).size < 0.6 * len(values)


def test_what_finds_no_room_is_reduced_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    import cosim.report.live.page_data as module

    monkeypatch.setattr(module, "ROOM", 40_000)
    monkeypatch.setattr(module, "ROOM_A_ROW", 1)
    rng = np.random.default_rng(0)
    curves = [PageCurve(f"a.{i}", rng.standard_normal(5000)) for i in range(6)]
    recordings, panels = [PageRecording("r", np.arange(5000.0), curves)], [PagePanel("p", ["a.4"])]
    found = page_data(LivePage("t", PageVerdict("v"), recordings=recordings, panels=panels))
    assert "a.4" not in found.reduced  # a panel shows it
    assert found.reduced
    assert sum(map(len, found.blocks)) < 60_000
    monkeypatch.undo()
    assert not page_data(LivePage("t", PageVerdict("v"), recordings=recordings)).reduced


def test_the_page_of_a_hundred_thousand_rows_is_small() -> None:
    """40 signals, half of them noise."""
    rng, time = np.random.default_rng(0), np.arange(100_000) * 0.01
    waves = [np.sin(time / (3.0 + i)) + (i % 2) * 0.05 * rng.standard_normal(len(time)) for i in range(40)]
    curves = [PageCurve(f"a.{i}", wave, "m/s") for i, wave in enumerate(waves)]
    page = LivePage(
        "t", PageVerdict("v"), recordings=[PageRecording("r", time, curves)], panels=[PagePanel("p", ["a.1", "a.2"])]
    )
    assert len(live_page(page)) < 3_000_000

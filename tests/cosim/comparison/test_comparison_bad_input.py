"""What is not as expected: NaN, other ends, gaps, units, names, nothing in common."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_results import compared, kinds, made, signal

from cosim import compare
from cosim.comparison.compare import compare_results
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.errors import ComparisonError

TIME = np.arange(101) * 0.01
LINE = 2.0 * TIME
LOOSE = Tolerance(absolute=0.1, relative=0.0, time=0.02)


def with_(values: np.ndarray, rows: slice, value: float) -> np.ndarray:
    changed = values.copy()
    changed[rows] = value
    return changed


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_no_number_is_equal_to_no_number_and_to_nothing_else(value: float) -> None:
    holed = with_(LINE, slice(40, 50), value)
    assert signal(TIME, holed, holed + 1e-4).status == "within"
    for one, two in [
        (LINE, holed),
        (holed, LINE),
        (with_(LINE, slice(40, 50), 7.0 if np.isinf(value) else np.inf), holed),
    ]:
        found = [f for f in signal(TIME, one, two).findings if f.kind == "nan"]
        assert [(f.time, f.end, f.size) for f in found] == [(0.4, 0.49, 10.0)]


def test_nan_names_the_side_that_has_it() -> None:
    holed = with_(LINE, slice(40, 41), np.nan)
    assert "the result is not a number" in signal(TIME, LINE, holed).findings[0].text
    assert "the reference is not a number" in signal(TIME, holed, LINE).findings[0].text
    assert "the result is infinite" in signal(TIME, LINE, with_(LINE, slice(40, 41), np.inf)).findings[0].text


def test_signals_without_any_number() -> None:
    nothing = np.full(101, np.nan)
    assert signal(TIME, nothing, nothing).status == "equal"
    assert kinds(signal(TIME, nothing, LINE)) == ["nan"]
    assert kinds(signal(TIME, LINE, nothing)) == ["nan"]
    assert np.isnan(signal(TIME, LINE, nothing).max_error)


def test_half_a_step_beside_a_hole_is_not_evaluated() -> None:
    """Between a number and NaN nobody knows the value; beyond them they are compared."""
    fine = made(np.arange(21) * 0.05, y=[0.0] * 10 + [np.nan] + [100.0] * 10)
    coarse = made(np.arange(9) * 0.1 + 0.075, y=[0.0] * 5 + [100.0] * 4)
    assert {"value", "nan"}.isdisjoint(kinds(compared(fine, coarse)["y"]))


def test_values_after_a_hole_are_evaluated() -> None:
    one = with_(LINE, slice(40, 50), np.nan)
    two = one + np.where(TIME > 0.7, 0.5, 0.0)
    assert signal(TIME, one, two).max_error == pytest.approx(0.5, abs=3e-6)  # less the slope in the allowed time


@pytest.mark.parametrize(
    ("rows", "kind", "at"),
    [
        (slice(0, 100), "ends_early", 0.99),
        (slice(1, 101), "starts_late", 0.01),
        (slice(0, 50), "ends_early", 0.49),
    ],
)
def test_a_dropped_sample_at_an_end_is_found(rows: slice, kind: str, at: float) -> None:
    full, part = made(TIME, y=LINE), made(TIME[rows], y=LINE[rows])
    (found,) = compared(full, part)["y"].findings
    assert found.kind == kind
    assert found.result == pytest.approx(at)
    other = {"ends_early": "ends_late", "starts_late": "starts_early"}[kind]
    assert kinds(compared(part, full)["y"]) == [other]
    if rows != slice(0, 50):
        assert compared(full, part, LOOSE)["y"].passed


def test_a_gap_is_found_where_something_happened_in_it() -> None:
    wave = np.sin(20.0 * TIME)
    keep = (TIME < 0.3) | (TIME > 0.6)
    full, holed = made(TIME, y=wave, flat=0.0 * TIME), made(TIME[keep], y=wave[keep], flat=0.0 * TIME[keep])
    for one, two, who in [(full, holed, "the result"), (holed, full, "the reference")]:
        comparison = compared(one, two)
        (found,) = [f for f in comparison["y"].findings if f.kind == "gap"]
        assert found.text.startswith(f"y: {who} has no rows from 0.29 to 0.61 s")
        assert comparison["flat"].passed


def test_units_are_converted_or_refused() -> None:
    metres, kilometres = made(TIME, y=LINE, units={"y": "m"}), made(TIME, y=LINE / 1000.0, units={"y": "km"})
    assert compared(metres, kilometres)["y"].passed
    assert compared(metres, made(TIME, y=LINE, units={"y": "km"}))["y"].max_error == pytest.approx(1998.0)
    assert kinds(compared(metres, made(TIME, y=LINE, units={"y": "kg"}))["y"]) == ["unit"]
    unknown = compared(metres, made(TIME, y=LINE, units={"y": "furlong"}))["y"]
    assert "furlong" in unknown.findings[0].text
    assert compared(unknown_units := made(TIME, y=LINE, units={"y": "furlong"}), unknown_units)["y"].status == "equal"


def test_missing_extra_and_ignored_signals() -> None:
    reference = made(TIME, plant__speed=LINE, plant__force=LINE, plant__note=LINE)
    result = made(TIME, train__speed=LINE, plant__force=LINE, plant__note=LINE + 1.0)
    comparison = compare_results(reference, result, Tolerances(ignore=("*.note",)))
    assert [(s.name, s.status) for s in comparison.signals] == [
        ("plant.speed", "missing"),
        ("plant.force", "equal"),
        ("plant.note", "ignored"),
        ("train.speed", "extra"),
    ]
    assert comparison["plant.speed"].nearest[0] == "train.speed"
    assert [signal.name for signal in comparison.failed] == ["plant.speed"]
    assert not comparison.equal
    strict = compare_results(result, reference, Tolerances(ignore=("*.note", "train.*")), extra_fails=True)
    assert [signal.name for signal in strict.failed] == ["plant.speed"]


def test_what_cannot_be_compared_is_said_in_words() -> None:
    some = made(TIME, y=LINE)
    with pytest.raises(ComparisonError, match=r"result: an empty run"):
        compare(some, made([], y=[]))
    with pytest.raises(ComparisonError, match=r"none of the 1 signals of reference .*nearest in result: 'yy'"):
        compare(some, made(TIME, yy=LINE))
    with pytest.raises(ComparisonError, match=r"row 3 has the time 0\.5 s after 1 s"):
        compare(some, made([0.0, 1.0, 0.5], y=[0.0, 0.0, 0.0]))
    with pytest.raises(ComparisonError, match=r"row 2 has the time nan s"):
        compare(made([0.0, np.nan], y=[0.0, 0.0]), some)
    with pytest.raises(ComparisonError, match=r"no time in common \(reference 0 to 1 s, result 5 to 6 s\)"):
        compare(some, made(TIME + 5.0, y=LINE))
    with pytest.raises(ComparisonError, match=r"all 1 common signals are ignored"):
        compare(some, some, ignore=["y"])
    with pytest.raises(ComparisonError, match=r"Cannot compare a builtins\.int"):
        compare(some, 5)
    with pytest.raises(ComparisonError, match=r"Unknown tolerance 'relativ'; did you mean 'relative'"):
        compare(some, some, tolerances={"y": {"relativ": 1.0}})


def test_files_are_read_and_named(tmp_path: Path) -> None:
    for name, more in (("good", 0.0), ("other", 1.0)):
        rows = "\n".join(f"{t},{y + more}" for t, y in zip(TIME, LINE, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"time,y\n{rows}\n", encoding="utf-8")
    good, other = tmp_path / "good.csv", str(tmp_path / "other.csv")
    comparison = compare(good, other)
    assert (comparison.reference, comparison.result) == (str(good), other)
    assert comparison["y"].max_error == pytest.approx(1.0, abs=3e-6)
    assert compare(good, good).equal
    assert not comparison.events.compared


def test_a_single_row_and_a_constant_signal() -> None:
    one = compared(made([0.0], y=[1000.0]), made([0.0], y=[1000.05]), Tolerance(0.0, 1e-4))
    assert one.equal
    assert one["y"].allowed == pytest.approx(0.1)  # of its size, since it has no range
    rounding = 1000.0 + 1e-13 * np.arange(101)
    assert signal(TIME, rounding, rounding + 0.05, Tolerance(0.0, 1e-4)).passed


def test_a_table_without_units_is_compared_by_its_numbers(tmp_path: Path) -> None:
    """A CSV without units says nothing of them; that is told, and is no difference."""
    run = made(TIME, units={"a.x": "m/s"}, a__x=LINE)
    rows = [f"{t!r},{x!r}\n" for t, x in zip(TIME.tolist(), LINE.tolist(), strict=True)]
    (tmp_path / "t.csv").write_text("time,a.x\n" + "".join(rows))
    for one, two in ((run, tmp_path / "t.csv"), (tmp_path / "t.csv", run)):
        comparison = compare(one, two, 0.0)
        assert comparison.equal
        assert comparison.signals[0].unit == "m/s"
        assert any("names no units" in note for note in comparison.notes)

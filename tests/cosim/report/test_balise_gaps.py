"""Position errors at the end of the gaps between balises: against a train whose every number is known."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.evaluation.balise_gaps import ENVELOPE, PLAIN_ODOMETER, gap_errors, rows_before
from cosim.evaluation.spec import ReportSpec
from cosim.report.figures.gap_figure import GapErrorsPanel
from cosim.report.page.run_tables import _gaps_table
from cosim.results.result import BaliseRecord, Result, SignalInfo
from cosim.run.outcome import Outcome
from cosim.studies.measures import error_measures, measure_unit

SPEED = 20.0  # [m/s]
PLACES = (100.0, 200.0, 1000.0, 1050.0)  # [m]; passed at 5, 10, 50 and 52.5 s
LIES = 0.98  # the wheel creeps by 2 %
SPEC = ReportSpec(
    true_position="train.position", true_speed="train.speed", odometer="odo.reading", observers=["a", "b"]
)


def run(*, distance: bool = True, spoilt: bool = False, kinds: tuple[str, ...] = ("true",) * 4) -> Result:
    """A train at 20 m/s. Observer ``a`` drifts by a hundredth of the way since the last balise, ``b`` is 3 m behind."""
    stamps = np.array(PLACES) / SPEED
    time = np.sort(np.concatenate([np.arange(0.0, 60.05, 0.1), stamps, stamps]))
    place = SPEED * time
    after = np.zeros(len(time), dtype=bool)  # the second of the rows of an event
    after[1:] = np.diff(time) == 0.0
    since = np.array(
        [
            max((s for s in stamps if s < t or (s == t and late)), default=0.0)
            for t, late in zip(time, after, strict=True)
        ]
    )
    columns = {
        "train.position": place,
        "train.speed": np.full(len(time), SPEED),
        "odo.reading": np.full(len(time), LIES * SPEED),
        "a.position": place + 0.01 * SPEED * (time - since),
        "b.position": place - 3.0,
    } | ({"odo.distance": LIES * place + 7.0} if distance else {})
    if spoilt:
        columns["a.position"][time > 40.0] = np.nan
    table = np.zeros(len(time), dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = time
    for name, values in columns.items():
        table[name] = values
    events = [
        BaliseRecord(s, np.nan if kind == "missed" else s, f"B{i}", p, p, kind=kind)  # type: ignore[arg-type]
        for i, (s, p, kind) in enumerate(zip(stamps, PLACES, kinds, strict=True))
    ]
    return Result(table, [], events)


@pytest.mark.parametrize("distance", [True, False])
def test_errors_just_before_the_next_balise(distance: bool) -> None:
    found = gap_errors(run(distance=distance), SPEC)
    assert [(g.origin, g.target) for g in found.gaps] == [("B0", "B1"), ("B1", "B2"), ("B2", "B3")]
    ways = np.diff(PLACES)
    np.testing.assert_allclose([g.length for g in found.gaps], ways, rtol=1e-12)
    np.testing.assert_allclose([g.seconds for g in found.gaps], ways / SPEED, rtol=1e-12)
    np.testing.assert_allclose([g.envelope for g in found.gaps], 5.0 + 0.05 * ways, rtol=1e-12)
    # closed forms; sums of some hundred terms round to 1e-10
    np.testing.assert_allclose(found.errors["a"], 0.01 * ways, atol=1e-9)
    np.testing.assert_allclose(found.errors["b"], -3.0, atol=1e-9)
    np.testing.assert_allclose(found.errors[PLAIN_ODOMETER], (LIES - 1.0) * ways, atol=1e-9)
    np.testing.assert_allclose(found.running_time("a"), 0.01 * ways / SPEED, atol=1e-9)
    assert found.longest() == [1, 0, 2]
    assert found.longest(1) == [1]
    assert found.within_envelope("a") == 1.0


@given(st.floats(0.0, 1.0), st.floats(10.0, 500.0), st.sampled_from([1.0, -1.0]))
def test_a_gap_is_the_way_that_was_made_also_where_the_train_turned(share: float, out: float, sign: float) -> None:
    """Past a balise, out, and back to the same one, which is read again: twice the way beyond it."""
    place = sign * np.concatenate((np.arange(0.0, out, 0.5), np.arange(out, 0.0, -0.5)))
    at = sign * share * out
    table = np.zeros(len(place), dtype=[("time", float), ("train.position", float), ("train.speed", float)])
    table["time"], table["train.position"] = np.arange(len(place)), place
    turned = int(np.argmax(np.abs(place)))
    first = float(np.interp(abs(at), np.abs(place[: turned + 1]), table["time"][: turned + 1]))
    second = float(np.interp(-abs(at), -np.abs(place[turned:]), table["time"][turned:]))
    events = [BaliseRecord(t, t, "B", at, at) for t in (first, second) if first < second]
    found = gap_errors(Result(table, [], events), SPEC)
    for gap in found.gaps:  # a row is half a metre of way
        assert gap.length == pytest.approx(2.0 * (np.max(np.abs(place)) - abs(at)), abs=1.01)


def test_a_distance_that_is_sampled_is_read_between_its_samples() -> None:
    """A count of every 0.7 s at 20 m/s would be up to 14 m behind."""
    result = run()
    held = np.floor(result.time / 0.7 + 1e-9) * 0.7
    result.table["odo.distance"] = LIES * SPEED * held
    sampled = Result(result.table, [SignalInfo("odo.distance", "m", variability="discrete")], result.events)
    found = gap_errors(sampled, SPEC).errors[PLAIN_ODOMETER]
    np.testing.assert_allclose(found, (LIES - 1.0) * np.diff(PLACES), atol=1e-9)


def test_a_balise_that_was_not_read_ends_no_gap() -> None:
    found = gap_errors(run(kinds=("true", "missed", "true", "false")), SPEC)
    assert [(g.origin, g.target) for g in found.gaps] == [("B0", "B2")]
    assert found.gaps[0].length == pytest.approx(900.0)
    assert found.errors["a"][0] == pytest.approx(0.01 * 800.0)  # the observer of this example knew of it


def test_gaps_that_end_before_the_evaluation_do_not_count() -> None:
    late = ReportSpec(**{**vars(SPEC), "evaluate_after": 20.0})
    assert [g.target for g in gap_errors(run(), late).gaps] == ["B2", "B3"]


def test_nothing_without_a_place_or_with_one_balise() -> None:
    assert not gap_errors(run(), ReportSpec(observers=["a"])).errors
    assert not gap_errors(run(kinds=("true", "missed", "false", "missed")), SPEC).errors
    assert not _gaps_table(gap_errors(run(), ReportSpec()))


def test_summary_table_and_measures_agree() -> None:
    result = run()
    found = gap_errors(result, SPEC)
    data = found.to_data()
    assert data["gaps"] == 3
    assert data["envelope"] == ENVELOPE
    assert [row["to"] for row in data["longest"]] == ["B2", "B1", "B3"]
    assert data["longest"][0]["error_m"]["a"] == pytest.approx(8.0)
    assert data["all"][PLAIN_ODOMETER]["largest_m"] == pytest.approx(16.0)
    assert data["all"]["b"]["rms_m"] == pytest.approx(3.0)
    measures = error_measures(Outcome(result, SPEC))
    assert measures["a.gap_error_max"] == pytest.approx(8.0)
    assert measures["a.gap_error_time_max"] == pytest.approx(0.4)
    assert measures["odo.gap_error_max"] == pytest.approx(16.0)
    assert (measure_unit("a.gap_error_max"), measure_unit("a.gap_error_time_max")) == ("m", "s")
    rows = _gaps_table(found).cells
    assert rows[0][0] == "B1 to B2"
    assert "8.00\n0.400" in rows[0]
    assert rows[-1][-1] == "16.0 m\n100 %"


@pytest.mark.parametrize(("kinds", "longest"), [(("true",) * 4, 800.0), (("true", "true", "missed", "missed"), 100.0)])
def test_the_figure_of_gaps_begins_at_zero(kinds: tuple[str, ...], longest: float) -> None:
    """Balises at one distance, 100 m, were once marked 0 on an axis of 1e-10 m."""
    ax = GapErrorsPanel.draw(run(kinds=kinds), SPEC)
    assert ax.get_xlim() == pytest.approx((0.0, 1.05 * longest))
    ax.figure.canvas.draw()
    assert ax.xaxis.get_major_formatter().get_offset() == ""
    plt.close(ax.figure)


def test_an_estimate_that_is_no_number_has_diverged() -> None:
    found = gap_errors(run(spoilt=True), SPEC)
    assert np.isinf(found.errors["a"]).tolist() == [False, True, True]
    assert found.within_envelope("a") == pytest.approx(1.0 / 3.0)
    assert "diverged\ndiverged" in _gaps_table(found).cells[0]


def test_the_row_before_an_event() -> None:
    time = np.array([0.0, 1.0, 1.5, 1.5, 2.0])
    assert rows_before(time, np.array([1.5, 1.7, 2.0, 9.0, 0.0])).tolist() == [2, 3, 4, 4, 0]

"""The allowance: by hand on a short run."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.choice.allowance import Allowance, used_allowance
from cosim.errors import ScenarioError
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import BaliseRecord, Result, SignalInfo

SPEC = ReportSpec(true_position="p.position", observers=["o"])
TIME = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0])
PLACE = 10.0 * TIME  # 10 m/s; two rows where a telegram comes at 2 s


def run(error: np.ndarray, *events: BaliseRecord) -> Result:
    table = np.empty(len(TIME), dtype=[("time", float), ("p.position", float), ("o.position", float)])
    table["time"], table["p.position"], table["o.position"] = TIME, PLACE, PLACE + error
    return Result(table, [SignalInfo("p.position", "m"), SignalInfo("o.position", "m")], list(events))


def telegram(stamp: float, delivered: float, kind: str = "true") -> BaliseRecord:
    return BaliseRecord(stamp, delivered, f"B{stamp:g}", 10.0 * stamp, 10.0 * stamp, kind=kind)  # type: ignore[arg-type]


def test_it_grows_with_the_way_since_the_balise_whose_telegram_has_come() -> None:
    """Passed at 1.5 s, delivered at 2 s: before that row the start counts, after it the balise at 15 m."""
    allowed = Allowance(5.0, 0.1).at(run(0.0 * TIME, telegram(1.5, 2.0)), SPEC)
    assert allowed is not None
    assert allowed.tolist() == pytest.approx([5.0, 6.0, 7.0, 5.5, 6.5, 7.5, 8.5])


def test_a_train_that_comes_back_has_made_the_way_there_and_back() -> None:
    """20 m out and 20 m back: 40 m of way, of which 10 m lie before the balise."""
    way = run(0.0 * TIME, telegram(1.0, 1.0))
    way.table["p.position"] = np.interp(TIME, [0.0, 2.0, 4.0, 5.0], [0.0, 20.0, 0.0, -10.0])
    allowed = Allowance(5.0, 0.1).at(way, SPEC)
    assert allowed is not None
    assert allowed.tolist() == pytest.approx([5.0, 5.0, 6.0, 6.0, 7.0, 8.0, 9.0])


@pytest.mark.parametrize("other", [telegram(1.5, nan, "missed"), telegram(1.5, 2.0, "false"), telegram(0.0, 4.0)])
def test_what_was_not_read_or_is_not_there_or_came_too_late_is_no_balise(other: BaliseRecord) -> None:
    alone = Allowance().at(run(0.0 * TIME), SPEC)
    assert np.array_equal(alone, Allowance().at(run(0.0 * TIME, other), SPEC))  # type: ignore[arg-type]


def test_the_worst_instant_is_found_and_one_that_diverges_uses_more_than_there_is() -> None:
    error = np.array([0.0, 3.0, 0.0, 0.0, 0.0, -3.5, 0.0])
    used = used_allowance(run(error), SPEC, "o", Allowance(5.0, 0.1))
    assert used is not None
    assert used.share == pytest.approx(0.5)
    assert used.time == 1.0
    lost = used_allowance(run(np.where(TIME == 4.0, nan, error)), SPEC, "o", Allowance())
    assert lost is not None
    assert (lost.share, lost.time) == (inf, 4.0)


@given(st.floats(1e-6, 1e6), st.floats(0.0, 1e3))
def test_what_is_written_is_read(fixed: float, per_cent: float) -> None:
    found = Allowance.of(f"{fixed!r}+{per_cent!r}%")
    assert (found.fixed, found.share) == (fixed, per_cent / 100.0)


@pytest.mark.parametrize("text", ["5", "5+5", "-1+5%", "0+5%", "5 km + 5 %", "1e+5%", "inf+5%", "5+-1%", ""])
def test_what_is_no_allowance_is_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match="expected metres plus per cent"):
        Allowance.of(text)

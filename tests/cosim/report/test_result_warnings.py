"""A run that shows nothing says so: in its numbers, its warnings and its page."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_scenarios import small
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.evaluation.event_counts import count_events, outcome_columns
from cosim.evaluation.metrics import FEWEST_INSTANTS, error_size, instants, phase_metrics
from cosim.evaluation.phase_details import phase_details
from cosim.evaluation.result_warnings import result_warnings
from cosim.evaluation.spec import Phase, ReportSpec
from cosim.report.live.render import live_page
from cosim.report.overlay.overlaid_runs import make_runs
from cosim.report.overlay.overlay_measures import measured
from cosim.report.page.run_page import run_page
from cosim.report.page.run_statements import run_statements
from cosim.report.page.run_verdict import observer_statuses
from cosim.results.result import BaliseRecord, Result
from cosim.run.outcome import Outcome
from cosim.studies.measures import UNMET, error_measures

SPEC = ReportSpec(true_position="train.position", true_speed="train.speed", observers=["obs"])


def run(speed: Any, estimate: Any, step: float = 0.1, **more: Any) -> Result:
    """Rows of a train and one observer."""
    count = len(speed)
    columns = {
        "train.speed": speed,
        "train.position": np.concatenate(([0.0], np.cumsum(step * 0.5 * (np.add(speed[1:], speed[:-1]))))),
        "obs.speed": estimate,
        "obs.position": np.zeros(count),
    }
    table = np.empty(count, [("time", "f8"), *((name, "f8") for name in columns)])
    table["time"] = step * np.arange(count)
    for name, values in columns.items():
        table[name] = values
    return Result(table, [], **more)


def card(result: Result, spec: ReportSpec, name: str) -> tuple[str, str, str]:
    return next(fact[1:] for fact in run_statements(result, spec, observer_statuses(result, spec)) if fact[0] == name)


@given(rows=st.integers(1, 9), event=st.booleans())
def test_a_phase_of_few_instants_has_no_numbers_anywhere(rows: int, event: bool) -> None:
    result = run(np.full(101, 10.0), np.full(101, 10.5))
    first = 10.0 - 0.1 * (rows - 1)
    if event:  # two rows of one instant count once
        result = replace(result, table=np.insert(result.table, 100, result.table[100]))
    spec = replace(SPEC, phases=[Phase("end", first - 0.05, 20.0)])
    (entry,) = phase_metrics(result, spec)
    (details,) = phase_details(result, spec)
    (row,) = measured(make_runs([result], [spec], ["a"]))
    measures = error_measures(Outcome(result, replace(spec, evaluate_after=first - 0.05)))
    assert entry.speed is not None
    enough = rows >= FEWEST_INSTANTS
    assert np.isfinite([entry.speed.max_abs, entry.speed.rms]).all() == enough
    assert (row.values["a"][0] is not None) == enough
    assert np.isfinite(list(measures.values())).all() == enough
    assert details.indicator_on is None
    assert any("Too few rows" in text for text in result_warnings(result, spec)) == (not enough)


def test_instants_are_different_times() -> None:
    assert [instants(np.array(times)) for times in ([], [1.0], [1.0, 1.0, 2.0], [0.0, 0.0])] == [0, 1, 2, 1]


def test_a_train_that_never_moves_is_reported() -> None:
    (text,) = result_warnings(run(np.full(50, 1e-4), np.zeros(50)), SPEC)
    assert "never moves" in text
    assert "train.speed" in text
    assert result_warnings(run(np.full(50, 1.0), np.zeros(50) + 0.9), SPEC) == []


def test_phases_that_were_not_reached_are_reported_together() -> None:
    phases = [Phase("hold", 3.0, 9.0), Phase("braking", 12.0, 15.0), Phase("stop", 15.0, 16.0)]
    result = run(np.full(101, 10.0), np.full(101, 10.0))
    (text,) = result_warnings(result, replace(SPEC, phases=phases))
    assert text == "Not reached, since the run ends at 10 s: braking (12 to 15 s), stop (15 to 16 s)."
    (late,) = result_warnings(result, replace(SPEC, evaluate_after=10.0))
    assert "whole run (0 to 10 s, judged from 10 s on)" in late
    assert result_warnings(replace(result, failure="it broke"), replace(SPEC, phases=phases)) == []


def test_a_phase_after_the_journey_is_reported() -> None:
    speed = np.where(np.arange(101) < 40, 10.0, 0.0)
    phases = [Phase("journey", 1.0, 6.0), Phase("after", 5.0, 9.0)]
    (text,) = result_warnings(run(speed, speed), replace(SPEC, phases=phases))
    assert "stands from 4 s on" in text
    assert "after (5 to 9 s)" in text
    assert "journey" not in text.partition(":")[2]


@pytest.mark.parametrize(("wrong", "reported"), [(9.0, False), (11.0, True), (np.inf, True), (np.nan, True)])
def test_an_observer_that_is_worse_than_none_is_reported(wrong: float, reported: bool) -> None:
    estimate = np.full(101, 10.0)
    estimate[60] += wrong
    texts = result_warnings(run(np.full(101, 10.0), estimate), SPEC)
    assert ["obs: its speed error" in text for text in texts] == [True] * reported
    assert result_warnings(run(np.full(101, 10.0), estimate), replace(SPEC, evaluate_after=6.5)) == []


@given(st.integers(0, 50))
def test_an_honest_run_has_no_doubts(seed: int) -> None:
    assert result_warnings(synthetic_result(step=0.5, seed=seed), synthetic_spec()) == []


def test_the_page_is_not_green() -> None:
    standing = run(np.zeros(50), np.zeros(50))
    spec = replace(SPEC, evaluate_after=4.9)
    assert card(standing, spec, "Run")[0] == "complete"
    assert run_page(standing, spec).verdict.mood == "doubt"
    assert "never moves" in run_page(standing, spec).verdict.text
    assert card(standing, spec, "Largest speed error") == ("–", "too few rows to judge", "doubt")
    assert "The train never moves" in live_page(run_page(standing, spec))
    assert card(run(np.ones(50), np.ones(50)), SPEC, "Run")[2] == "good"


def test_the_card_shows_the_worst_of_the_observers() -> None:
    result, spec = synthetic_result(), synthetic_spec()
    errors = [np.abs(result[f"{o}.speed"] - result["locomotive.speed"])[result.time >= 5.0].max() for o in OBSERVERS]
    value, remark, _ = card(result, spec, "Largest speed error")
    assert float(value.removesuffix(" m/s")) == pytest.approx(max(errors), rel=0.01)
    assert remark == f"{OBSERVERS[int(np.argmax(errors))]}, the worst of 4"
    assert card(synthetic_result(diverged="multirate_cdo"), spec, "Largest speed error") == (
        card(
            replace(result),
            replace(spec, observers=[o for o in OBSERVERS if o != "multirate_cdo"]),
            "Largest speed error",
        )[0],
        "discrete_uio, the worst of 3, 1 failing left out",
        "",
    )
    assert "two CDOs fails" in run_page(synthetic_result(diverged="multirate_cdo"), spec).verdict.text


# -- telegrams ---------------------------------------------------------------------------------------------------------


def test_what_was_delivered_and_what_became_of_it_stand_together() -> None:
    outcomes = ["accepted"] * 5 + ["undelivered", "doubted", "notified"]
    events = [BaliseRecord(float(i), i + 0.1, f"B{i}", 0.0, 0.0, outcomes={"obs": o}) for i, o in enumerate(outcomes)]
    counts = count_events([*events, BaliseRecord(9.0, np.nan, "M", 0.0, 0.0, kind="missed")])
    assert (counts.delivered, counts.undelivered, counts.missed) == (7, 1, 1)
    assert sum(counts.outcomes["obs"].values()) == counts.delivered + counts.undelivered
    columns = outcome_columns(counts.outcomes.values())
    assert columns == {
        "accepted": "accepted",
        "notified": "delivered, outcome not reported",
        "undelivered": "undelivered",
        "doubted": "doubted",
    }
    assert outcome_columns([Counter(accepted=3), Counter(accepted=0, late=0)]) == {"accepted": "accepted"}


def test_the_page_counts_in_one_way() -> None:
    page = live_page(run_page(synthetic_result(), synthetic_spec()))
    assert " told" not in card(synthetic_result(), synthetic_spec(), "Balise telegrams")[0]
    assert ">told<" not in page  # a column of an outcome that nobody had
    assert "telegrams were delivered" in page


# -- whole runs --------------------------------------------------------------------------------------------------------


def test_a_run_that_ends_before_anything_happens() -> None:
    """As `freight_sc3 --set stop=20.0`: what is judged begins where the run ends."""
    scenario = small(
        expect=[{"check": "speed_error", "max": 9.0}, {"check": "telegrams", "missed": 0}, {"check": "certificate"}]
    )
    scenario.set("report.evaluate_after", 0.5).set("balises.positions", [900.0])
    for name in ("locomotive.train_speed", "locomotive.wheel_rate", "observer.estimated_speed", "driver.profile_speed"):
        scenario.set(name, 0.0)
    outcome = scenario.run()
    assert outcome.failure is None
    assert [evaluated.passed for evaluated in outcome.expectations] == [False, False, False]
    assert all("0.5" in j.text or "nothing" in j.text or "no gap" in j.text for j in outcome.expectations)
    assert [("never moves" in w, "Not reached" in w) for w in outcome.warnings][-2:] == [(True, False), (False, True)]
    measures = error_measures(outcome)
    assert measures.pop(UNMET) == 3.0
    assert all(np.isnan(value) for value in measures.values())


def test_error_sizes_themselves_count_every_row() -> None:
    assert error_size(np.array([1.0]), np.array([-2.0])).max_abs == 2.0

"""Comparison of observers on one recorded run: the numbers of the run itself, whoever takes part, and failures in
words.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenarios import small

from cosim import Scenario
from cosim.choice.benchmark import ObserverBenchmark, benchmark_observers
from cosim.choice.candidates import find_candidates, shipped_rows
from cosim.choice.known_parameters import Known, stated_parameters
from cosim.choice.observer_scores import (
    SEEN_GAP,
    ObserverScore,
    divergence,
    error_at_balises,
    false_alarms,
    gap_certified,
    longest_gap,
    telegram_outcomes,
)
from cosim.choice.observer_table import observer_table
from cosim.choice.playback import find_parts
from cosim.errors import RunError, ScenarioError
from cosim.evaluation.metrics import PhaseMetrics, _ErrorSize, phase_metrics
from cosim.evaluation.spec import ReportSpec
from cosim.master.master import Master
from cosim.results.load_result import load_result
from cosim.results.result import BaliseRecord, Result, SignalInfo
from plant_models.railway.vehicle.locomotive import Locomotive


def quietly(scenario: Scenario) -> Any:
    return scenario.run(warn=lambda _: None)


def two() -> Scenario:
    """`small` with a second observer and what a report needs."""
    scenario = small().add("uio", observer="discrete_uio", **{"as": "block3"}, label="UIO", parameters={"mass": 80e3})
    scenario.connect("driver.effort -> uio.effort", "odometer.reading -> uio.odometer")
    return scenario.report(evaluate_after=0.1, phases=[{"name": "late", "start": 0.2, "end": 0.5}], zones=[(0.2, 0.3)])


@pytest.fixture(scope="module")
def benchmark() -> ObserverBenchmark:
    return benchmark_observers(two(), ["observer", "uio"], repeat=2)


class Constant:
    """A plain observer that believes in one speed."""

    inputs = ("odometer",)
    outputs = ("speed",)

    def __init__(self, mass: float = 1.0, believed: float = 0.0) -> None:
        self.mass, self.believed = mass, believed
        self.hidden = 0.0  # no argument: an attribute of this very instance

    @property
    def speed(self) -> float:
        return self.believed + self.hidden

    def step(self, t: float, inputs: Any, dt: float) -> None:
        """Nothing to learn."""


def test_an_instance_takes_part_as_it_is() -> None:
    given = Constant(believed=3.0)
    given.hidden = 0.5
    found = benchmark_observers(two(), [given, Constant])
    assert found.failed == []
    assert [outcome[f"{name}.speed"][-1] for name, outcome in found.outcomes.items()] == [3.5, 0.0]
    assert len({score.label for score in found.scores}) == 2


# -- the numbers of the run
# -------------------------------------------------------------------------------------------------


def test_on_profile_d_every_observer_gives_the_numbers_of_the_joint_run() -> None:
    """Four observers, 264 telegrams, 90 s: bit for bit; S1 in the traction zone is the 0.00326 m/s of its page."""
    scenario = Scenario.load("freight_profile_d")
    together = quietly(scenario)
    names = list(together.spec.observers)
    alone = benchmark_observers(scenario, names)
    assert alone.failed == []
    for name in names:
        result = alone.outcomes[name].result
        for column in (c for c in result.table.dtype.names or () if c == "time" or c.startswith(f"{name}.")):
            assert result[column].tobytes() == together[column].tobytes(), column
    scored = [phase for score in alone.scores for phase in score.phases]
    expected = phase_metrics(together.result, together.spec)
    assert [(m.observer, m.phase, m.speed, m.position) for m in scored] == [
        (m.observer, m.phase, m.speed, m.position) for m in expected
    ]
    assert f"{scored[0].speed.max_abs:.5f}" == "0.00326"  # type: ignore[union-attr]
    seen = {n: c["largest_gap_seen"] for n, c in together.result.summary["certificates"].items()}
    assert {s.name: s.certificate.condition(SEEN_GAP).value for s in alone.scores if s.certificate is not None} == seen


def test_an_observer_in_the_loop_is_recorded_in_it_and_said_to_be() -> None:
    scenario = two()
    data = scenario.table().model_dump(by_alias=True, exclude_unset=True)
    data["connections"] = [c for c in data["connections"] if "driver.odometer" not in c]
    data["connections"] += ["observer.speed -> driver.odometer", "odometer.reading -> observer.odometer"]
    looped = Scenario(**data)
    assert find_parts(looped).in_loop == ("observer",)
    together = quietly(looped)
    found = benchmark_observers(looped, ["observer", "uio"])
    assert any("observer acts on the train" in note for note in found.notes)
    assert [s.in_loop for s in found.scores] == [True, False]
    assert found.outcomes["uio"]["uio.speed"].tobytes() == together["uio.speed"].tobytes()


def test_a_recording_is_kept_and_can_be_played_back_later(tmp_path: Path, benchmark: ObserverBenchmark) -> None:
    first = benchmark_observers(two(), ["uio"], record=tmp_path / "run")
    assert "locomotive.speed" in (load_result(tmp_path / "run").table.dtype.names or ())
    warned: list[str] = []
    again = benchmark_observers(two(), ["uio"], recorded=tmp_path / "run", warn=warned.append)
    assert not warned
    sizes = [b.scores[-1].whole for b in (first, again, benchmark)]
    assert sizes[0] == sizes[1] == sizes[2]
    quietly(two().set("locomotive.train_speed", 9.0)).write(tmp_path / "other", report=False)
    other = benchmark_observers(two(), ["uio"], recorded=tmp_path / "other", warn=warned.append)
    assert ["locomotive.train_speed was 9.0 and is" in text for text in warned] == [True]
    assert other.outcomes["uio"]["locomotive.speed"][0] == 9.0
    assert other.scores[0].whole != sizes[0]


def test_each_repetition_has_its_cost(benchmark: ObserverBenchmark) -> None:
    for score in benchmark.scores:
        assert len(score.costs) == 2
        assert min(score.costs) <= score.cost <= max(score.costs)  # type: ignore[operator]
        assert all(cost > 0.0 for cost in score.costs)


# -- scores
# -----------------------------------------------------------------------------------------------------------------


def test_errors_at_balises_are_those_of_a_naive_search(benchmark: ObserverBenchmark) -> None:
    """The first row at the time of delivery, which is the one before the telegram."""
    for score in benchmark.scores:
        result = benchmark.outcomes[score.name].result
        errors = []
        for event in result.events:
            row = next(i for i, t in enumerate(result.time) if abs(t - event.delivered_at) < 1e-9)
            errors.append(float(result[f"{score.name}.speed"][row] - result["locomotive.speed"][row]))
        assert score.speed_at_balises is not None
        assert len(errors) == 3  # all of them after evaluate_after = 0.1 s
        assert score.speed_at_balises.mean == pytest.approx(sum(errors) / 3, rel=1e-12)
        assert score.speed_at_balises.rms == pytest.approx(math.sqrt(sum(e * e for e in errors) / 3), rel=1e-12)
        assert score.speed_at_balises.max_abs == max(map(abs, errors))


def result_of(**columns: Any) -> Result:
    table = np.empty(len(columns["time"]), dtype=[(key.replace("__", "."), float) for key in columns])
    for key, values in columns.items():
        table[key.replace("__", ".")] = values
    return Result(table, [SignalInfo(name) for name in table.dtype.names or () if name != "time"])


def test_false_alarms_are_indications_that_begin_outside_the_zones() -> None:
    """On at 1, 4 and 7 s; the zone is 3 to 5 s; before 0.5 s nothing counts."""
    result = result_of(time=np.arange(10.0), o__slip_indicator=[2, 2, 1, 1, 2, 2, 2, 1, 2, 1])
    spec = ReportSpec(observers=["o"], zones=[(3.0, 5.0)], evaluate_after=0.5)
    assert false_alarms(result, spec, "o") == 1
    assert false_alarms(result, ReportSpec(observers=["o"]), "o") is None


def test_telegrams_that_were_not_used_do_not_count() -> None:
    result = result_of(time=[0.0, 1.0, 2.0, 3.0], p__speed=[0.0] * 4, o__speed=[1.0, 2.0, 3.0, 4.0])
    reported = {"accepted": 1.0, "rejected": 2.0, "replayed": 3.0}
    events = [BaliseRecord(t, t, f"B{t:g}", 0.0, 0.0, outcomes={"o": outcome}) for outcome, t in reported.items()]
    spec = ReportSpec(true_speed="p.speed", observers=["o"])
    found = error_at_balises(Result(result.table, result.signals, events), spec, "o", "speed")
    assert found is not None
    assert (found.count, found.mean, found.max_abs) == (2, 3.0, 4.0)
    assert longest_gap(events, 0.0) == 1.0
    assert telegram_outcomes([*events, events[1]], "o") == {"accepted": 1, "rejected": 2, "replayed": 1}


def test_a_certificate_is_held_against_both_gaps() -> None:
    gap = gap_certified(limit=0.5, expected=0.4, seen=0.6)
    assert (gap.holds, gap.condition(SEEN_GAP).holds) == (True, False)
    assert gap_certified(0.5, None, None).holds is None


# -- who takes part
# -----------------------------------------------------------------------------------------------------------


def test_by_default_every_preset_takes_part_and_is_set_to_this_train() -> None:
    scenario = two()
    found, _ = find_candidates(scenario, find_parts(scenario), None)
    assert [candidate.name for candidate in found[:2]] == ["observer", "uio"]
    rows = {(c.model, c.table.preset) for c in found[2:]}
    assert rows == set(shipped_rows()) - {("takagi_sugeno_cdo", "repaired"), ("discrete_uio", None)}
    assert not [c.misfit for c in found if c.misfit]
    assert len({candidate.name for candidate in found}) == len(found)
    fits = {c.name: {signal: link[0] for signal, link in c.sources.items()} for c in found}
    assert fits["adaptive_gain_cdo"] == {"effort": "driver.effort", "odometer": "odometer.reading"}


def test_what_an_observer_cannot_have_is_said() -> None:
    scenario = two()
    (found,), _ = find_candidates(scenario, find_parts(scenario), ["takagi_sugeno_cdo:long_gaps"])
    assert (found.name, found.table.preset, found.misfit) == ("takagi_sugeno_cdo_long_gaps", "long_gaps", "")
    with pytest.raises(ScenarioError, match="no preset 'long_gap'"):
        find_candidates(scenario, find_parts(scenario), ["takagi_sugeno_cdo:long_gap"])


def known(scenario: Scenario) -> Known:
    return stated_parameters(scenario, find_parts(scenario))


def test_what_is_known_comes_from_the_observers_where_they_agree_else_from_the_plant() -> None:
    scenario = two().set("observer.mass", 80e3).set("locomotive.davis_b", 30.0).set("locomotive.mass", 95e3)
    found = known(scenario)
    assert found["mass"] == (80e3, "as for the observers of the scenario")
    assert found["davis_b"] == (30.0, "as for locomotive")
    assert known(scenario.set("uio.mass", 70e3))["mass"] == (95e3, "as for locomotive")


def test_what_the_plant_is_by_default_is_known_too() -> None:
    """An observer whose own default is another train would be told of 1 kg."""
    found = known(two())
    plant = Locomotive()
    starts = {signal.name: signal.start for signal in plant.parameter_signals}
    assert found["davis_a"] == (starts["davis_a"], "as for locomotive")
    assert found["wheel_radius"] == (starts["wheel_radius"], "as for locomotive")
    assert found["odometer_period"] == (0.01, "of the odometer")


@pytest.mark.parametrize(("mass", "named"), [(90.0, True), (90e3, False)])
def test_a_mass_that_is_no_trains_is_named_before_observers_are_measured_with_it(mass: float, named: bool) -> None:
    warned: list[str] = []
    scenario = two().set("locomotive.mass", mass)
    for name in find_parts(scenario).observers:
        scenario.set(f"{name}.mass", mass)
    benchmark_observers(scenario, ["odometer_reset"], warn=warned.append)
    assert any(text.startswith("mass = 90.0 kg (as for") for text in warned) is named


def test_an_observer_that_does_not_want_a_fact_does_not_hide_it() -> None:
    scenario = two().set("observer.mass", 80e3).set("uio.mass", 80e3).set("observer.estimated_position", 7.0)
    scenario.set("uio.estimated_position", 7.0).add("plain", observer="odometer_reset").connect(
        "odometer.reading -> plain.odometer"
    )
    found = known(scenario.set("plain.estimated_position", 7.0))
    assert found["mass"][0] == 80e3  # the plain odometer has no mass
    assert found["estimated_position"] == (7.0, "as for the observers of the scenario")
    assert "estimated_position" not in known(scenario.set("plain.estimated_position", 0.0))


def test_no_limit_is_reported_as_any_gap() -> None:
    gaps = [gap_certified(np.inf, 22.5, 31.9), gap_certified(0.5, None, None)]
    rows = observer_table([ObserverScore("o", "o", "m", "defaults", certificate=gap) for gap in gaps]).data()
    assert [(row["certified"], row["holds"]) for row in rows] == [("any", "yes/yes"), (0.5, "?/?")]


def test_a_scenario_without_observers_serves_shipped_ones() -> None:
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    del data["components"]["observer"]
    data["connections"] = [
        "driver.effort -> locomotive.effort",
        "locomotive.wheel_speed -> odometer.wheel_speed",
        "locomotive.speed -> driver.odometer",
    ]
    parts = find_parts(Scenario(**data))
    assert {signal: link[0] for signal, link in parts.template.items()} == {
        "effort": "driver.effort",
        "wheel_speed": "locomotive.wheel_speed",
        "odometer": "odometer.reading",
    }


# -- failures
# -----------------------------------------------------------------------------------------------------------------


def test_an_unknown_observer_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ScenarioError, match="unknown observer 'discrete_uoi'; did you mean 'discrete_uio'"):
        benchmark_observers(two(), ["discrete_uoi"])


def test_one_that_cannot_be_coupled_or_diverges_keeps_its_row_with_the_reason() -> None:
    scenario = two().set("observer.estimated_speed", 1e150)
    found = benchmark_observers(scenario, ["luenberger", "observer", "uio"])
    assert found.failed == ["luenberger", "observer"]
    reasons = {score.name: str(score.failure) for score in found.scores}
    assert (
        reasons["luenberger"] == "cannot be coupled: nothing in this scenario gives its inputs torque, measured_angle"
    )
    assert reasons["observer"].startswith("diverged: its speed error reached 1e+150 m/s, the train no more than ")
    assert found.scores[2].failure is None
    assert found.scores[2].whole is not None
    assert "luenberger: cannot be coupled" in found.text()


def test_an_estimate_that_is_worse_than_none_has_diverged() -> None:
    """Not at 1000 m/s only: beyond the speed of the train itself a zero were the better estimate."""
    speeds = PhaseMetrics("o", "whole run", speed=_ErrorSize(25.1, 3.0), position=None)
    assert divergence(speeds, 25.0) == "diverged: its speed error reached 25.1 m/s, the train no more than 25 m/s"
    assert divergence(speeds, 25.2) is None


def test_a_plant_that_fails_is_said() -> None:
    with pytest.raises(RunError, match="run of the plant side failed"):
        benchmark_observers(two().set("locomotive.train_speed", 1e308).balises(method="interpolate"), ["uio"])


class Breaks(Constant):
    """Gives up in the middle of the run."""

    def step(self, t: float, inputs: Any, dt: float) -> None:
        if t > 0.2:
            raise ValueError("enough of it")


class Lost(Constant):
    """Says NaN from some time on."""

    def step(self, t: float, inputs: Any, dt: float) -> None:
        self.hidden = math.nan if t > 0.3 else 0.0


def test_one_that_fails_takes_nobody_along() -> None:
    """Two that end early in different ways and one that cannot be set up, among two that are well: each as alone."""
    refused = two().with_settings({"uio.parameters": {"sample_period": -1.0}})
    alone = benchmark_observers(two(), ["observer"]).scores[0]
    observers = [Constant(believed=9.0), Breaks(), "observer", Lost(believed=9.0), "uio"]
    found = {score.name: score for score in benchmark_observers(refused, observers).scores}
    assert list(found) == ["Constant", "Breaks", "observer", "Lost", "uio"]
    assert found["Constant"].failure is None
    assert replace(found["observer"], costs=()) == replace(alone, costs=())
    assert "enough of it" in str(found["Breaks"].failure)
    assert "is nan" in str(found["Lost"].failure)
    assert str(found["uio"].failure).startswith("cannot be coupled: ")
    for score in (found["Breaks"], found["Lost"]):
        assert score.whole is not None
        assert 0.0 < score.costs[0] < 1e6


TOGETHER = ("observer", "uio", "odometer_reset", "luenberger", "multirate_cdo", "stopping_uio")


@settings(max_examples=3)
@given(st.lists(st.sampled_from(TOGETHER), min_size=2, unique=True))
def test_scores_do_not_depend_on_who_else_takes_part(names: list[str]) -> None:
    def score_of(name: str) -> ObserverScore:
        return replace(benchmark_observers(two(), [name]).scores[0], costs=())

    together = benchmark_observers(two(), names).scores
    assert [replace(score, costs=()) for score in together] == [score_of(name) for name in names]


# -- what is written
# ------------------------------------------------------------------------------------------------------------


class Texts(HTMLParser):
    """Headings and cells of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(text)

    def handle_data(self, data: str) -> None:
        self.found.append(data)


def test_page_and_data_say_the_same(benchmark: ObserverBenchmark, tmp_path: Path) -> None:
    paths = benchmark.write(tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["observers.html", "observers.json"]
    data = json.loads(paths["data"].read_text(encoding="utf-8"))
    assert [entry["label"] for entry in data["observers"]] == ["observer", "UIO"]
    assert data["observers"][1]["whole"]["speed"]["rms"] == benchmark.scores[1].speed_rms
    page = paths["page"].read_text(encoding="utf-8")
    assert {"Overview", "Errors by phase", "Certificates", "Telegrams"} <= set(Texts(page).found)
    assert '"Speed error"' in page  # a panel of it


# -- interrupted
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", [1, 2, 3])
def test_what_was_computed_before_an_interruption_is_kept(
    at: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first run is the plant's, the others one observer each, as telegrams reach them in different ways."""
    begun = interrupted_at(at, monkeypatch)
    scenario = two().set("uio.as", "block2")
    if at < 3:
        with pytest.raises(KeyboardInterrupt):
            benchmark_observers(scenario, ["observer", "uio"], record=tmp_path)
    else:
        found = benchmark_observers(scenario, ["observer", "uio"], record=tmp_path)
        assert found.interrupted
        assert [score.name for score in found.scores] == ["observer"]
        assert "Interrupted; not evaluated: uio." in found.notes
    assert len(begun) == at
    assert len(load_result(tmp_path).time) > 50


def test_of_repeated_runs_those_before_an_interruption_count(monkeypatch: pytest.MonkeyPatch) -> None:
    interrupted_at(4, monkeypatch)
    found = benchmark_observers(two(), ["observer", "uio"], repeat=5)
    assert [len(score.costs) for score in found.scores] == [2, 2]
    assert found.interrupted
    assert "Interrupted; the cost is that of fewer runs." in found.notes


def interrupted_at(at: int, monkeypatch: pytest.MonkeyPatch) -> list[Master]:
    """Somebody interrupts when so many runs have ended; the runs."""
    step, begun = Master.run, list[Master]()

    def interrupted(master: Master) -> None:
        step(master)
        begun.append(master)
        if len(begun) == at:
            raise KeyboardInterrupt

    monkeypatch.setattr(Master, "run", interrupted)
    return begun

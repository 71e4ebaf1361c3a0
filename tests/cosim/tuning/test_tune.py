"""Tuning: the same costs in every way of running candidates, nothing lost, what cannot be seen is said."""

from __future__ import annotations

import json
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.errors import OutputError, ScenarioError
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from cosim.run.outcome import Outcome
from cosim.runs.journal import EARLIER, JOURNAL
from cosim.tuning.costs import LikelihoodCost, make_cost
from cosim.tuning.evaluation import Evaluator
from cosim.tuning.parameters import tunable
from cosim.tuning.replays import Replays
from cosim.tuning.slopes import LikelihoodSlopes, NoSlopesError
from cosim.tuning.study import _at_bounds
from cosim.tuning.tune import tune
from cosim.tuning.tuning_page import tuning_page
from cosim.tuning.tuning_result import Tuning
from fmu_observer import OBSERVERS
from fmu_observer.design.optimisers.search_space import Bounded, SearchSpace
from plant_models.hybrid import HybridSystem, output_signal, parameter, scalar_names, state

CURRENTS = "state:current_d=motor.current_d,current_q=motor.current_q"
VARIANCES = {
    **{f"process_variance[{i}]": (1e-6, 20.0, True) for i in range(1, 5)},
    **{f"measurement_variance[{i}]": (1e-6, 20.0, True) for i in (1, 2)},
}


def drive(stop: float = 0.01) -> Scenario:
    """The shipped drive as blocks, 100 samples."""
    scenario = Scenario.load("traction_drive").set("stop", stop).set("expect", [])
    for name in ("cycle", "motor", "control", "filter"):
        scenario.set(f"{name}.as", "block3")
    return scenario


def drive_with_poor_guess(stop: float = 0.01) -> Scenario:
    """With covariances that trust the measurements too much."""
    return (
        drive(stop).set("filter.process_variance", [1.0, 1.0, 1.0, 0.5]).set("filter.measurement_variance", [1.0, 1.0])
    )


def tuned(scenario: Scenario | None = None, **changes: Any) -> Tuning:
    stated: dict[str, Any] = {
        "observer": "filter",
        "cost": CURRENTS,
        "iterations": 2,
        "options": {"population": 5},
    }
    return tune(scenario or drive(), changes.pop("parameters", VARIANCES), **{**stated, **changes})


@pytest.fixture(scope="module")
def found() -> Tuning:
    return tuned(drive_with_poor_guess(), seeds=[0, 1], validate=[5])


def mean_square(outcome: Outcome) -> float:
    """The published cost, by hand, with the trapezoidal rule of the errors."""
    errors = [outcome[f"filter.{name}"] - outcome[f"motor.{name}"] for name in ("current_d", "current_q")]
    return float(sum(np.trapezoid(e**2, outcome.result.time) for e in errors) / outcome.result.time[-1])


def test_costs_are_those_of_runs_of_the_scenario(found: Tuning) -> None:
    """Members of a batch against whole runs: the same bits, and a cost written by hand to rounding."""
    assert found.how == "as members of a batch over the inputs of the observer"
    whole = tuned(drive_with_poor_guess(), seeds=[0, 1], validate=[5], whole_runs=True)
    assert whole.how.startswith("of the whole scenario")
    assert (found.before, found.after, found.validated_after) == (whole.before, whole.after, whole.validated_after)
    assert found.searches == whole.searches
    assert found.before[1] == pytest.approx(mean_square(drive_with_poor_guess().set("seed", 1).run()), rel=1e-12)
    again = found.scenario.copy().set("seed", 5).run()
    assert found.validated_after[0] == pytest.approx(mean_square(again), rel=1e-12)
    assert sum(found.after) < sum(found.before)


def test_present_values_are_found_under_names_with_dots(tmp_path: Path) -> None:
    """A component of the scenario, its table of parameters, and an FMU whose variables have dots in their names."""
    linear_fmu(tmp_path, "plant", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], inputs=["body.force"], outputs=["body.speed"])
    scenario = Scenario(stop=0.1, step=0.1, folder=tmp_path).add(
        "plant", fmu="plant.fmu", parameters={"body.force": 2.0}
    )
    names = ("plant.body.force", "plant.parameters.body.force")
    for name in names:
        assert tunable(scenario, None, {name: (1.0, 3.0)}).start == {name: 2.0}


def test_a_candidate_costs_the_mean_over_its_seeds_and_the_best_search_counts(found: Tuning) -> None:
    assert found.searches[0].costs[-1] == pytest.approx(np.mean(found.after), rel=1e-12)
    several = tuned(drive_with_poor_guess(), seeds=[0], searches=3, iterations=0)
    ends = [search.costs[-1] for search in several.searches]
    assert len(set(ends)) == 3
    assert several.after[0] == min(ends) < several.before[0]


def test_values_that_no_candidate_beats_are_kept() -> None:
    """The cost is the distance from what the scenario as it is gives."""
    present = float(np.mean(drive_with_poor_guess().run()["filter.current_d"]))
    found = tuned(
        drive_with_poor_guess(),
        cost=lambda outcome: abs(float(np.mean(outcome["filter.current_d"])) - present),
        iterations=0,
    )
    assert found.before == found.after == [0.0]
    assert found.best == found.start
    assert found.searches[0].costs[-1] > 0.0


def test_what_changes_nothing_is_held_and_said() -> None:
    """The angle's noise moves no current: rank 3 of 4."""
    found = tuned(drive_with_poor_guess(), iterations=0, options={"population": 3})
    assert list(found.fixed) == ["filter.process_variance[4]"]  # in 100 samples the start P(0) has not faded
    assert found.best["filter.process_variance[4]"] == found.start["filter.process_variance[4]"]
    assert any("process_variance[4] changes nothing" in text for text in found.warnings)
    assert "held: filter.process_variance[4], at 0.5: it changes nothing" in found.text()
    with pytest.raises(ScenarioError, match="nothing to tune"):
        tuned(parameters={"process_variance[4]": (1e-6, 1.0)})


def test_the_likelihood_needs_no_true_values_and_sees_the_scale() -> None:
    """It tells how large the noise is, not only ratios: the common factor stays."""
    some = {name: bounds for name, bounds in VARIANCES.items() if name != "process_variance[4]"}
    found = tuned(parameters=some, cost="likelihood", seeds=[0], options={"population": 4})
    assert not found.fixed
    assert "only their ratios" not in " ".join(found.warnings)
    nis = tuned(parameters=some, cost="nis", seeds=[0], iterations=1, options={"population": 4})
    assert 0.0 <= nis.after[0] < 10.0


@pytest.mark.parametrize("observer", ["motor_ekf", "extended_kalman_filter", "ensemble_kalman_filter"])
def test_nis_is_evaluated_by_the_measurements_of_the_observer(observer: str) -> None:
    """Two currents of a motor, one angle of a pendulum; and a filter that tells its degrees itself."""
    rows = np.zeros(50, [("time", "f8"), ("filter.nis", "f8"), ("filter.nis_degrees", "f8")])
    rows["time"], rows["filter.nis_degrees"] = np.arange(50.0), 3.0
    expected = {"motor_ekf": 2.0, "extended_kalman_filter": 1.0, "ensemble_kalman_filter": 3.0}[observer]
    rows["filter.nis"] = expected
    cost = make_cost("nis", "filter", scalar_names(OBSERVERS[observer]().outputs))
    assert cost.of(Outcome(Result(rows, []), ReportSpec())) == 0.0
    rows["filter.nis"] *= np.e
    assert cost.of(Outcome(Result(rows, []), ReportSpec())) == pytest.approx(1.0, rel=1e-12)


def test_an_interrupted_search_keeps_what_it_found_and_goes_on(tmp_path: Path, found: Tuning) -> None:
    def stop(done: int, _total: int, what: str) -> None:
        if what.startswith("search") and done > 15:
            raise KeyboardInterrupt

    part = tuned(drive_with_poor_guess(), seeds=[0, 1], validate=[5], directory=tmp_path, progress=stop)
    assert part.interrupted
    assert part.validated == ()
    lines = [json.loads(line) for line in (tmp_path / "iterations.jsonl").read_text().splitlines()]
    assert [line["iteration"] for line in lines] == [0]
    whole = tuned(drive_with_poor_guess(), seeds=[0, 1], validate=[5], directory=tmp_path, resume=True)
    assert whole.searches == found.searches
    assert whole.validated_after == found.validated_after
    assert whole.runs < found.runs
    evaluations = [json.loads(line) for line in (tmp_path / JOURNAL).read_text().splitlines()]
    assert len({entry["key"] for entry in evaluations}) == len(evaluations)  # none was done twice
    again = Scenario.load(tmp_path / "tuned.toml")
    assert again.run(overrides={"seed": 5}).failure is None
    overlay = tmp_path / "both.toml"
    drive_with_poor_guess().save(tmp_path / "drive.toml")
    overlay.write_text('include = ["drive.toml", "overlay.toml"]\n')
    assert mean_square(Scenario.load(overlay).run()) == pytest.approx(whole.after[0], rel=1e-12)
    assert "validation seeds" in (tmp_path / "tuning.html").read_text("utf-8")


SOME = {
    name: bounds for name, bounds in VARIANCES.items() if name in ("process_variance[1]", "measurement_variance[2]")
}


def test_a_descent_has_exact_gradients_where_the_filter_is_ours() -> None:
    """One evaluation an iteration; the same descent by differences of 1e-4 of the range ends within 1e-3 of it."""
    asked: dict[str, Any] = {"parameters": SOME, "method": "gradient", "options": {}, "seeds": [0], "iterations": 3}
    exact = tuned(drive_with_poor_guess(0.004), cost="likelihood", **asked)
    assert exact.how.endswith("exact gradients of the likelihood, by the equations of the filter")
    assert exact.searches[0].evaluations == [1, 2, 3, 4]
    reported = tuned(drive_with_poor_guess(0.004), cost=Twin("filter"), **asked)
    assert reported.how.endswith("gradients by central differences: the cost is not the likelihood")
    assert reported.searches[0].evaluations[0] == 5
    np.testing.assert_allclose(exact.searches[0].costs, reported.searches[0].costs, rtol=1e-3)
    assert exact.searches[0].costs[-1] < exact.searches[0].costs[0]


def test_slopes_are_those_of_differences() -> None:
    """In search coordinates, the logarithm; central differences of 1e-4 leave 1e-8 of a smooth function."""
    outcome = drive_with_poor_guess().run()
    asked = tunable(drive_with_poor_guess(), "filter", SOME)
    replays = Replays(outcome, "filter")
    slopes = LikelihoodSlopes([replays], asked, LikelihoodCost("filter"))
    at = np.log([0.3, 0.2])

    def cost(point: np.ndarray) -> float:
        (found,) = replays.outcomes([asked.settings(asked.space.named(point))])
        assert isinstance(found, Outcome)
        return LikelihoodCost("filter").of(found)

    moves = 1e-4 * np.eye(2)
    reported = [(cost(at + move) - cost(at - move)) / 2e-4 for move in moves]
    np.testing.assert_allclose(slopes.of(asked.space, asked.space.named(at)), reported, rtol=1e-6)
    alone = asked.space.without({asked.space.names[0]: 0.3})
    np.testing.assert_allclose(slopes.of(alone, asked.space.named(at)), reported[1:], rtol=1e-6)
    with pytest.raises(NoSlopesError, match="candidates are not run as members of a batch"):
        LikelihoodSlopes([], asked, LikelihoodCost("filter"))


def test_members_are_stepped_in_parts_of_which_memory_does_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of 5, the last one of 2: each member as alone; ten times as many need no more."""
    outcome = drive_with_poor_guess().run()
    monkeypatch.setattr("cosim.tuning.replays.BYTES", 5 * outcome.result.table.nbytes)
    replays, cost = Replays(outcome, "filter"), LikelihoodCost("filter")
    draws = np.random.default_rng(3).uniform(0.1, 1.0, 500)
    candidates = [{"filter.process_variance[1]": float(value)} for value in draws]

    def costs(asked: list[dict[str, float]]) -> tuple[list[float], int]:
        tracemalloc.start()
        found = [cost.of(each) for each in replays.outcomes(asked) if isinstance(each, Outcome)]
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found, peak

    few, _ = costs(candidates[:12])
    assert few == [costs([candidate])[0][0] for candidate in candidates[:12]]
    assert len(set(few)) == 12
    _, small = costs(candidates[:50])
    _, large = costs(candidates)
    assert large < small + 100 * len(candidates)  # a number each, and its name


class Twin(LikelihoodCost):
    """The same cost of another kind."""


class Logarithm(HybridSystem):
    """``y = log(1 - rate t)``, which is no number from 1 / rate on."""

    name = "logarithm"
    description = "An output that leaves the numbers"
    source = "a test"
    states = (state("x", "1", 1.0),)
    outputs = (output_signal("y", "1"),)
    parameters = (parameter("rate", "1/s", 1.0),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -p.rate}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": np.log(x.x)}


class LogarithmOrNothing(Logarithm):
    """Its output can be missing."""

    name = "logarithm_or_nothing"
    outputs = (output_signal("y", "1", can_be_missing=True),)


def test_an_observer_with_balises_runs_beside_recordings() -> None:
    """A train observer: one recording a seed; its error is that of the whole run to the interpolation of nothing."""
    asked: dict[str, Any] = {
        "parameters": {"balise_gain_position[1]": (0.1, 1.0), "locomotive_mass": (1.0, 2.0)},
        "observer": "observer",
        "cost": "position_error_rms",
        "method": "hand",
        "options": {},
    }
    with pytest.raises(ScenarioError, match="has no 'locomotive_mass'"):
        tuned(small(), **asked)
    del asked["parameters"]["locomotive_mass"]
    beside = tuned(small(), **asked, seeds=[0, 3], validate=[7])
    assert "recorded" in beside.how
    whole = tuned(small(), **asked, seeds=[0, 3], validate=[7], whole_runs=True)
    np.testing.assert_allclose(beside.before, whole.before, rtol=1e-9)
    np.testing.assert_allclose(beside.searches[0].costs, whole.searches[0].costs, rtol=1e-9)


def test_anything_of_a_scenario_is_tuned_by_a_function_of_the_outcome() -> None:
    """The mass of a plant, found from where it is after the run: the search ends near the mass that was used."""
    scenario = Scenario(stop=0.2, step=0.01)
    scenario.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0, "effort": 5e4})
    true = scenario.copy().set("train.mass", 80e3).run()["train.speed"][-1]

    def off(outcome: Outcome) -> float:
        return float(abs(outcome["train.speed"][-1] - true))

    found = tune(scenario, {"train.mass": (60e3, 120e3)}, method="hand", cost=off, iterations=12)
    assert found.best["train.mass"] == pytest.approx(80e3, rel=1e-2)
    assert "train" in found.how


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parameters": {}}, "Nothing is tuned"),
        ({"parameters": {"process_varianc[1]": (1.0, 2.0)}}, "did you mean 'process_variance'"),
        ({"parameters": {"process_variance": (1.0, 2.0)}}, "vector with 4 elements"),
        ({"parameters": {"process_variance[5]": (1.0, 2.0)}}, "no such element"),
        ({"parameters": {"process_variance[1,2]": (1.0, 2.0)}}, "the diagonal is tuned"),
        ({"parameters": {"sample_period[1]": (1.0, 2.0)}}, "has no elements"),
        ({"parameters": {"process_variance[1]": (1.0, float("inf"))}}, "finite bounds"),
        ({"parameters": {"process_variance[1]": (0.0, 1.0, True)}}, "above zero"),
        ({"parameters": {"process_variance[1]": 3.0}}, "expected .low, high."),
        ({"seeds": [0, 1], "validate": [1, 2]}, "Seeds 1 stand among"),
        ({"seeds": []}, "no training seeds"),
        ({"method": "bob"}, "did you mean bbo"),
        ({"options": {"populaton": 3}}, "populaton"),
        ({"cost": "expectation"}, "say which"),
        ({"cost": "state:current_d"}, "expected estimate=component.signal"),
        ({"resume": True}, "resumed from its folder"),
        ({"observer": "fliter"}, "unknown observer"),
        ({"cost": "nothing_rms"}, "^cost: .*no measure"),
        ({"cost": "state:current_d=motor.curent_d"}, "^cost: .*did you mean 'motor.current_d'"),
        ({"options": {"popultion": 3}}, "no option 'popultion'; did you mean 'population'"),
    ],
)
def test_what_cannot_be_is_reported_before_a_search(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        tuned(drive(0.001), **changes)


def test_values_at_the_end_of_their_range_are_reported() -> None:
    space = SearchSpace([Bounded("q", 1e-6, 1.0, True), Bounded("r", 0.0, 2.0), Bounded("held", 0.0, 1.0)])
    reported = _at_bounds(space, {"q": 1e-6, "r": 1.0, "held": 0.0}, {"held": "it changes nothing"})
    assert [text.partition(":")[0] for text in reported] == ["q ends at its lower bound, 1e-06"]
    assert "r ends at its upper bound, 2" in _at_bounds(space, {"q": 0.1, "r": 2.0, "held": 0.0}, {"held": ""})[0]


def test_a_search_that_is_not_resumed_keeps_the_one_before(tmp_path: Path) -> None:
    (tmp_path / JOURNAL).write_text('{"key": "one"}\n')
    Evaluator({}, tunable(drive(), "filter", VARIANCES), LikelihoodCost("filter"), tmp_path)
    assert (tmp_path / EARLIER).read_text() == '{"key": "one"}\n'
    assert not (tmp_path / JOURNAL).read_text()


def grew(outcome: Outcome) -> float:
    """A cost that is no finite number where a train is light."""
    return float(np.nan if outcome["train.speed"][-1] > 10.1 else outcome["train.speed"][-1])


def times(factor: float) -> Callable[[Outcome], float]:
    return lambda outcome: factor * float(outcome["train.speed"][-1])


def test_a_cost_of_the_user_s_that_was_changed_is_computed_anew(tmp_path: Path) -> None:
    bounds = {"train.mass": (60e3, 120e3)}
    asked: dict[str, Any] = {"method": "hand", "iterations": 1, "directory": tmp_path, "resume": True}
    first, other, again = (tune(light_train(), bounds, cost=times(k), **asked) for k in (1.0, -2.0, 1.0))
    np.testing.assert_allclose(other.before, -2.0 * np.array(first.before), rtol=1e-12)
    assert again.before == first.before


def light_train() -> Scenario:
    scenario = Scenario(stop=0.1, step=0.01)
    values = {"train_speed": 10.0, "wheel_rate": 10.0 / 0.575, "effort": 5e4}
    return scenario.add("train", model="locomotive", **{"as": "block3"}, parameters=values)


def test_what_changes_nothing_of_a_plant_is_held_and_said() -> None:
    """A gradient behind the end of the journey; masses and efforts do change what the cost depends on."""
    bounds = {"train.mass": (60e3, 120e3), "train.gradient[4]": (0.0, 0.01)}
    scenario = light_train().set("train.gradient_position", [0.0, 1e5, 2e5, 3e5])
    found = tune(scenario, bounds, cost=lambda o: -float(o["train.speed"][-1]), method="hand", iterations=1)
    assert list(found.fixed) == ["train.gradient[4]"]
    assert found.best["train.mass"] < found.start["train.mass"]
    with pytest.raises(ScenarioError, match="there is nothing to tune"):
        tune(scenario, {"train.gradient[4]": (0.0, 0.01)}, cost=grew, iterations=0)


def test_a_cost_that_is_not_finite_is_said_with_signal_instant_and_candidate() -> None:
    """A signal that can be missing, one that may not be, and a cost that is none although all signals are finite."""
    texts = []
    for model in (LogarithmOrNothing, Logarithm):
        scenario = light_train().add("wave", model=model, **{"as": "block3"})
        cost = make_cost("state:wave.y=train.speed", "wave")
        with pytest.raises(ScenarioError) as caught:
            tune(scenario, {"wave.rate": (20.0, 30.0)}, cost=cost, iterations=0, options={"population": 3})
        texts.append(str(caught.value))
    assert "the cost is not finite, for wave.y is not (" in texts[0]
    assert "wave.y became no finite number first, at t = 0.0" in texts[1]
    assert re.search(r"first with wave.rate = 2[\d.]+, seed 0 from t = 0\.0[45] s on", texts[0])
    assert "first with wave.rate = " in texts[1]
    with pytest.raises(ScenarioError, match="the cost is nan, although all signals that it names are finite"):
        tune(light_train(), {"train.mass": (1e3, 2e3)}, cost=grew, iterations=0, options={"population": 3})


def test_a_journal_of_version_0_1_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "evaluations.jsonl").write_text('{"key": "one", "cost": 1.0}\n')
    with pytest.raises(OutputError, match=r"evaluations\.jsonl was written by version 0\.1"):
        tune(light_train(), {"train.mass": (60e3, 120e3)}, cost=grew, directory=tmp_path, resume=True)


def test_the_page_says_what_the_cost_is_and_how_the_searches_went(found: Tuning) -> None:
    page = tuning_page(found)
    assert page.lead == found.cost
    curves = [curve for recording in page.recordings for curve in recording.curves if curve.name == "Best cost"]
    assert [curve.values.tolist() for curve in curves] == [list(search.costs) for search in found.searches]
    assert ("gain" in page.verdict.text, page.verdict.mood == "good") == (True, found.gain.low > 0.0)

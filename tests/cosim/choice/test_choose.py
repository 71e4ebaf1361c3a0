"""The choice on a small scenario: what it plays, what it knows, what it says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from small_scenarios import small

import fmu_observer
from cosim import Scenario
from cosim.choice.choice import INTERRUPTED, Choice
from cosim.choice.choose import choose, scenario_for_fmu
from cosim.choice.ranking import ranked
from cosim.choice.trial import Trial
from cosim.cli import main
from cosim.errors import RunError, ScenarioError
from fmus.cache import cached_fmu
from plant_models import PLANTS

FEW = ["odometer_reset", "balise_odometer_ekf", "quasi_lpv_uio", "luenberger"]


@pytest.fixture(scope="module")
def choice() -> Choice:
    return choose(small(), FEW, seeds=2, further=2)


def test_every_run_counts_but_the_harder_ones(choice: Choice) -> None:
    first, harder, more = ["nominal", "seed 1", "seed 2"], ["harder seed 1", "harder seed 2"], ["seed 3", "seed 4"]
    assert [d.name for d in choice.disturbances] == [*first, *harder, *more]
    for row in choice.rows:
        assert list(row.used) in ([first, [*first, *more]] if row.tried else [[]])
        assert list(row.harder) == (harder if row.safe else [])
    assert {row.label for row in choice.groups["not tried"]} == {"luenberger"}
    assert choice.answer.startswith(f"use {choice.best.label}")


def test_the_lines_to_paste_are_a_component_that_knows_the_train(choice: Choice) -> None:
    name = choice.best.candidate.name
    assert f"[components.{name}]" in choice.lines()
    assert f"-> {name}.odometer" in choice.lines()
    quasi = next(row for row in choice.rows if row.label == "quasi_lpv_uio")
    assert quasi.candidate.table.parameters["mass"] == 90e3  # of the plant, by default, in place of its own 1 kg
    assert quasi.candidate.table.parameters["estimated_speed"] == 10.0


def test_what_workers_find_is_what_one_process_finds(choice: Choice) -> None:
    again = choose(small(), FEW, seeds=2, further=2, workers=2)
    assert [(r.label, r.used, r.harder) for r in again.rows] == [(r.label, r.used, r.harder) for r in choice.rows]


def test_the_declared_odometer_is_played_and_not_what_the_driver_hears() -> None:
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    del data["components"]["observer"]
    data["connections"] = [
        "driver.effort -> locomotive.effort",
        "locomotive.speed -> driver.odometer",
        {"from": "locomotive.wheel_speed", "to": "odometer.wheel_speed", "factor": 1.5},
    ]
    found = choose(Scenario(**data), ["odometer_reset"], seeds=0)
    assert found.best.candidate.sources["odometer"][0] == "odometer.reading"
    assert found.best.score.speed_rms == pytest.approx(5.0, rel=0.05)  # the odometer reads half as much again


def test_what_fails_nominally_is_not_run_again_and_says_why() -> None:
    scenario = small().set("observer.estimated_speed", 1e150)
    found = choose(scenario, ["observer", "odometer_reset"], seeds=1)
    lost = next(row for row in found.rows if row.label == "observer (takagi_sugeno_cdo)")
    assert list(lost.used) == ["nominal"]
    assert not lost.safe
    assert "diverged" in lost.why_not()
    assert found.best.label == "odometer_reset"


def test_an_observer_that_refuses_what_is_known_of_the_train_says_so_and_ends_nothing() -> None:
    """Some trains have a negative Davis coefficient, as printed; an observer that does not allow it is no answer."""
    found = choose(Scenario.load("jam_odometry").set("stop", 12.0), ["adaptive_gain_cdo", "odometer_reset"], seeds=1)
    assert found.best.candidate.model == "odometer_reset"
    refused = next(row for row in found.rows if row.label == "adaptive_gain_cdo")
    assert not refused.tried
    assert "cannot be coupled" in refused.why_not()


def test_a_single_row_is_no_run_to_be_evaluated() -> None:
    with pytest.raises(RunError, match="evaluate_after"):
        choose(small().set("stop", 3.0).report(evaluate_after=3.0), ["odometer_reset"], seeds=0)


def test_an_answer_from_fewer_runs_begins_with_it(choice: Choice) -> None:
    assert replace(choice, stopped=INTERRUPTED).answer.startswith("interrupted after 7 runs; so far: use ")


def test_a_disturbed_run_that_fails_leaves_what_the_others_gave(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plant may crash on one seed: the choice from the other runs is kept, and says what is missing."""
    played = Trial.played

    def failing(trial: Trial, **more: Any) -> Any:
        if trial.number == 1:
            raise RunError("plant: the process that ran it has ended")
        return played(trial, **more)

    monkeypatch.setattr(Trial, "played", failing)
    found = choose(small(), ["odometer_reset"], seeds=2)
    assert [d.name for d in found.disturbances] == ["nominal", "seed 2"]
    assert found.stopped == "A disturbed run failed: plant: the process that ran it has ended"
    assert found.answer.startswith("cut short after 2 runs; so far: use odometer_reset")


def test_where_the_best_falls_on_a_further_seed_the_next_ones_run_on_these_too(monkeypatch: pytest.MonkeyPatch) -> None:
    played = Trial.played
    few = ["odometer_reset", "balise_odometer_ekf", "quasi_lpv_uio"]
    before = choose(small(), few, seeds=1, further=0)
    assert {len(row.used) for row in before.rows} == {2}
    monkeypatch.setattr("cosim.choice.ranking.NEAR", 1.0)
    monkeypatch.setattr("cosim.choice.ranking.TIE", 0.0)
    first = ranked(before.rows)[0].score.name

    def failing(trial: Trial, **more: Any) -> Any:
        found = played(trial, **more)
        beyond = [
            replace(s, used=replace(s.used, share=2.0)) if s.name == first and trial.number > 1 and s.used else s
            for s in found.scores
        ]
        return replace(found, scores=tuple(beyond))

    monkeypatch.setattr(Trial, "played", failing)
    found = choose(small(), few, seeds=1, further=1)
    runs = {row.score.name: len(row.used) for row in found.rows}
    assert found.best.score.name != first
    assert (runs[first], runs[found.best.score.name]) == (3, 3)
    assert [d.name for d in found.disturbances if not d.harder] == ["nominal", "seed 1", "seed 2"]


def test_presets_that_are_the_same_here_are_one_line() -> None:
    """The second is the default preset by its name."""
    asked = ["odometer_reset", "quasi_lpv_uio", "quasi_lpv_uio:as_published"]
    found = choose(small(), asked, seeds=1, further=0)
    assert sorted(row.named for row in found.rows) == ["odometer_reset", "quasi_lpv_uio = quasi_lpv_uio:as_published"]


@pytest.mark.parametrize(("spacing", "within"), [(5.0, True), (10.0, False)])
def test_the_observer_for_dense_balises_is_far_better_up_to_half_a_second_and_diverges_beyond(
    spacing: float, within: bool
) -> None:
    """A train at 10 m/s, so gaps of 0.5 and 1 s: what the starter and the recommendations state."""
    scenario = small().set("stop", 15.0).set("odometer.sample_period", 0.01)
    scenario.set("balises.positions", [spacing * (k + 1) for k in range(40)])
    scenario.set("driver.profile_speed", [10.0, 13.9, 13.9, 10.0, 10.0, 10.0, 10.0, 10.0])
    found = choose(scenario, ["differentiator_cdo", "quasi_lpv_uio"], seeds=0)
    dense, usual = (
        next(row for row in found.rows if row.label == name) for name in ("differentiator_cdo", "quasi_lpv_uio")
    )
    assert usual.safe
    assert dense.safe == within
    if within:
        assert dense.score.speed_rms is not None
        assert usual.score.speed_rms is not None
        assert dense.score.speed_rms < 0.5 * usual.score.speed_rms


def test_what_a_run_will_say_of_the_preset_is_said_with_the_answer() -> None:
    found = choose(small(), ["balise_odometer_ekf:tuned"], seeds=0)
    assert any("is made for the 900 t train" in str(part) for part in found.parts())
    own = choose(small(), ["observer"], seeds=0)
    assert own.lines() == "# it is in the scenario already: components.observer"


def test_balises_reach_whom_the_scenario_names_and_the_observer_that_is_chosen() -> None:
    """What was measured with telegrams is written with them; an own observer that is not named has none."""
    named = small().add("deaf", observer="odometer_reset", **{"as": "block3"}).balises(receivers=["observer"])
    named.connect("odometer.reading -> deaf.odometer")
    found = choose(named, ["deaf", "balise_odometer_ekf"], seeds=0)
    telegrams = [event for outcome in found.benchmark.outcomes.values() for event in outcome.result.events]
    assert {name for event in telegrams for name in event.outcomes} == {"balise_odometer_ekf"}
    assert found.best.candidate.name == "balise_odometer_ekf"
    assert found.with_best().table().balises.receivers == ["observer", "balise_odometer_ekf"]
    assert "# into [balises], receivers = [...]: 'balise_odometer_ekf'" in found.lines()
    assert "No telegram" not in found.answer


def test_an_answer_of_the_nominal_run_alone_says_so(choice: Choice) -> None:
    assert "by the nominal run alone" in choose(small(), ["odometer_reset"], seeds=0).answer
    assert "by the nominal run alone" not in choice.answer


def test_an_answer_without_any_telegram_says_so() -> None:
    assert "No telegram reached an observer" in choose(small().balises(latency=9.0), ["odometer_reset"], seeds=0).answer


def test_where_nothing_comes_through_there_is_no_best() -> None:
    found = choose(small(), ["luenberger"], seeds=1)
    assert not found.found
    with pytest.raises(RunError, match="no observer came through"):
        _ = found.best


def test_a_train_of_which_nobody_says_where_it_is_is_refused() -> None:
    data = small().table().model_dump(by_alias=True, exclude_unset=True)
    del data["balises"], data["report"]
    with pytest.raises(ScenarioError, match="nothing says where the train truly is"):
        choose(Scenario(**data), ["luenberger"], seeds=0)


@pytest.mark.parametrize("factor", [1.0, 3.6])
def test_speed_and_position_of_two_motions_are_refused_before_anything_is_played(factor: float, tmp_path: Path) -> None:
    """A log whose speed is in km/h and does not say so; the same in m/s is a train."""
    rows = [f"{t},{10.0 * t},{10.0 * factor}" for t in range(31)]
    (tmp_path / "log.csv").write_text("\n".join(["time,position,speed", *rows]), encoding="utf-8")
    made = Scenario(folder=tmp_path, stop=30.0, step=0.1).add("log", recording="log.csv")
    made.report(true_position="log.position", true_speed="log.speed", odometer="log.speed")
    made.balises(position="log.position", speed="log.speed", layout="spacing", spacing=50.0, track_end=1e3)
    if factor == 1.0:
        assert choose(made, ["odometer_reset"], seeds=0).best.safe
    else:
        with pytest.raises(ScenarioError, match=r"do not go together: the train moves 300 m.*km/h taken for m/s"):
            choose(made, ["odometer_reset"], seeds=0)


def test_a_plant_fmu_alone_gets_the_scenario_of_its_starter(tmp_path: Path) -> None:
    fmu: Any = cached_fmu(PLANTS["locomotive"](), fmi_version=3)
    scenario = scenario_for_fmu(fmu).set("stop", 3.0)
    with pytest.raises(RunError, match="evaluate_after = 5 s"):
        choose(scenario, ["odometer_reset"], seeds=0)
    scenario.set("report.evaluate_after", 1.0)
    found = choose(scenario, ["odometer_reset", "quasi_lpv_uio"], seeds=0)
    quasi = next(row for row in found.rows if row.label == "quasi_lpv_uio")
    assert quasi.candidate.table.parameters["mass"] == 90e3
    written = found.with_best().save(tmp_path / "chosen.toml")
    assert Scenario.load(written).run(warn=lambda _: None).failure is None


def test_an_fmu_that_is_no_train_is_refused() -> None:
    fmu: Any = cached_fmu(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), fmi_version=3)
    with pytest.raises(ScenarioError, match=r"is an observer and no train.*cosim new takagi_sugeno_cdo.*\.fmu"):
        scenario_for_fmu(fmu)
    with pytest.raises(ScenarioError, match=r"own\.fmu is an FMU, and nothing says what it is connected to"):
        choose(small(), ["own.fmu"], seeds=0)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("README.md", "README.md is no scenario (.toml or .ssp) and no train (.fmu)."),
        ("missing.toml", "Scenario file missing.toml does not exist"),
        ("missing.fmu", "missing.fmu does not exist"),
        ("broken.fmu", "broken.fmu is not a readable FMU"),
    ],
)
def test_what_is_neither_a_scenario_nor_a_train_is_named_in_a_line(
    name: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in ("README.md", "broken.fmu"):
        Path(file).write_text("# words\n", encoding="utf-8")
    assert main(["choose", name]) == 2
    shown = capsys.readouterr().err
    assert text in shown
    assert len(shown.splitlines()) == 1

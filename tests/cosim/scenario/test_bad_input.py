"""Bad input: every mistake is answered with file, place, what was expected, and exit code 2; results so far are
kept.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError
from cosim.results.results_folder import read_results

SETTINGS: dict[str, tuple[dict[str, Any], str]] = {
    "step negative": ({"step": -0.01}, "step must be positive"),
    "step zero": ({"step": 0.0}, "step must be positive"),
    "step does not divide": ({"step": 0.03}, "does not divide the horizon.*stop = 0.48 or 0.51"),
    "horizon empty": ({"stop": 0.0}, "must lie behind start"),
    "wrong type": ({"stop": "soon"}, "stop: .*number.*soon"),
    "unknown preset": ({"observer.preset": "repared"}, "components.observer.*no preset 'repared'.*'repaired'"),
    "unknown option": ({"observer.options.premis": "live"}, "no option 'premis'.*premise"),
    "option out of range": ({"locomotive.options.zone_count": 65}, "zone_count = 65 of locomotive; choose 1 to 64"),
    "option no whole number": (
        {"locomotive.options.zone_count": 2.5},
        "zone_count = 2.5 of locomotive; choose 1 to 64",
    ),
    "option of another kind": (
        {"locomotive.options.zone_count": True},
        "zone_count = True of locomotive; choose 1 to 64",
    ),
    "option that is a table of no lists": (
        {"observer.options.premise": {"x2": 3}},
        r"observer.options.premise: expected a text, .* or a table of lists of finite numbers .*got {'x2': 3}",
    ),
    "option that is no number": (
        {"locomotive.options.zone_count": float("nan")},
        "zone_count: expected a text.*got nan",
    ),
    "bad option": ({"observer.options.premise": "dead"}, "'dead'.*'frozen'"),
    "unknown parameter": ({"locomotive.mas": 1.0}, "locomotive: no variable 'mas'.*'mass'"),
    "list shorter than its vector": (
        {"driver.profile_speed": [1.0, 2.0]},
        r"driver.profile_speed: expected 8 values, one for each element, or one number for all \(got 2\)",
    ),
    "unknown model": ({"report.observers": ["x y"]}, "report.observers"),
    "unknown key": ({"balises.spaceing": 3.0}, "balises.spaceing: unknown key.*'spacing'"),
    "unknown top-level key": ({"stepp": 3.0}, "stepp: unknown key.*'step'"),
    "unknown iteration key": (
        {"master.iteration": {"max_iteration": 3}},
        "max_iteration: unknown key.*'max_iterations'",
    ),
    "a word that log does not know": (
        {"driver.log": "everything"},
        r"driver\.log: expected 'all', 'errors', 'none', or a list of log categories \(got .everything.\)$",
    ),
    "a word that interpolation does not know": (
        {"driver.interpolation": "sometimes"},
        r"^[^\n]*driver\.interpolation: expected 'linear' or 'hold', or a table of these by column "
        r"\(got .sometimes.\)$",
    ),
    "a column's word that interpolation does not know": (
        {"driver.interpolation": {"a": "sometimes"}},
        r"^[^\n]*driver\.interpolation\.a: expected 'linear' or 'hold', or a table of these by column "
        r"\(got .sometimes.\)$",
    ),
    "one name for the list of those that can be missing": (
        {"driver.can_be_missing": "odometer"},
        r"^[^\n]*driver\.can_be_missing: expected a list of names, such as \['effort'\] \(got .odometer.\)$",
    ),
    "seed of a component that is no number": (
        {"driver.seed": float("nan")},
        r"driver\.parameters\.seed: expected a whole number from 0 to 9007199254740991, or -1: it follows .*got nan",
    ),
    "balises unsorted": (
        {"balises.positions": [3.0, 1.0]},
        "increasing position.*number 2 at 1 m follows number 1 at 3 m",
    ),
    "two balises at one place": ({"balises.positions": [1.0, 1.0]}, "one at a place"),
    "balise outside the track": ({"balises.track_end": 3.0}, "'B3' at 4 m lies outside the track from 0 m to 3 m"),
    "no balises": ({"balises.positions": []}, "at least one balise"),
    "layout incomplete": ({"balises.layout": "csv"}, "layout 'csv' needs 'file'"),
    "balise list missing": ({"balises.layout": "csv", "balises.file": "none.csv"}, "none.csv does not exist"),
    "position unknown": ({"balises.position": "locomotive.positon"}, "locomotive: no variable 'positon'.*'position'"),
    "position of nobody": ({"balises.position": "lokomotive.position"}, "balises.position.*'locomotive'"),
    "not a receiver": ({"balises.receivers": ["driver"]}, "'driver' declares no event 'balise'"),
    "early return impossible": ({"balises.method": "early-return"}, "needs balises.clock"),
    "location accuracy": ({"balises.location_accuracy": 80.0}, "location_accuracy.*63"),
    "probability": ({"balises.missed_fraction": 1.5}, "missed_fraction.*1"),
    "certificate required": (
        {"certificates": "require", "balises.expected_speed": 1.0},
        "certificates = 'require'.*(?s:.)*UNSTABLE",
    ),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_a_wrong_setting_is_named_with_what_was_expected(case: str) -> None:
    settings, message = SETTINGS[case]
    with pytest.raises(CosimError, match=message):
        small().run(overrides=settings)


def test_a_whole_number_may_be_written_with_a_point() -> None:
    """2.0 is in 0 ... 5, so it passed the check and then failed as an index, with a traceback."""
    s = Scenario(stop=0.2, step=0.1).add("slope", observer="levant_differentiator", options={"order": 2.0})
    assert "slope.derivative_2" in s.run().result.table.dtype.names


CONNECTIONS = {
    "two sources": (
        "locomotive.speed -> driver.odometer",
        "driver.odometer has two sources, .*odometer.reading.* and locomotive.speed",
    ),
    "unknown component": ("train.speed -> driver.odometer", "'train.speed'.*component"),
    "unknown output": ("locomotive.sped -> driver.odometer", "no variable 'sped'.*'speed'"),
    "an input as source": ("driver.odometer -> observer.odometer", "causality 'input', expected output"),
    "no arrow": ("driver.odometer observer.odometer", "line 4.*is not 'source.signal -> target.signal'"),
}


@pytest.mark.parametrize("case", CONNECTIONS)
def test_a_wrong_connection_is_named(case: str) -> None:
    line, message = CONNECTIONS[case]
    with pytest.raises(CosimError, match=message):
        small().connect(line).run()


def test_units_that_do_not_fit_are_refused_with_both_names() -> None:
    scenario = small()
    scenario._data["connections"] = ["locomotive.position -> odometer.wheel_speed"]
    with pytest.raises(
        CosimError, match=r"locomotive.position -> odometer.wheel_speed: units 'm' and 'm/s' do not fit"
    ):
        scenario.run()


# -- the command line
# ---------------------------------------------------------------------------------------------------


def run_cli(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    code = main(list(arguments))
    return code, capsys.readouterr().err


@pytest.fixture
def plant_file(tmp_path: Path) -> Path:
    path = tmp_path / "plant.toml"
    path.write_text(
        'stop = 1.0\nstep = 0.1\n[components.plant]\nfmu = "plant.fmu"\n[components.driver]\nmodel = "driver"\nas = '
        '"block3"\n'
    )
    return path


def test_a_missing_fmu(plant_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, error = run_cli(capsys, "run", str(plant_file), "--out", str(plant_file.parent / "out"))
    assert code == 2
    assert f"plant: FMU {plant_file.parent / 'plant.fmu'} does not exist" in error


def test_a_broken_fmu(plant_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (plant_file.parent / "plant.fmu").write_bytes(b"PK not a zip")
    code, error = run_cli(capsys, "run", str(plant_file), "--out", str(plant_file.parent / "out"))
    assert code == 2
    assert "plant.fmu is not a readable FMU" in error
    assert "Traceback" not in error


def test_an_fmu_of_another_platform(plant_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with zipfile.ZipFile(plant_file.parent / "plant.fmu", "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="2.0" modelName="plant" guid="{0}"><CoSimulation modelIdentifier="plant"/>'
            "<ModelVariables/><ModelStructure/></fmiModelDescription>",
        )
        archive.writestr("binaries/win32/plant.dll", "")
    code, error = run_cli(capsys, "run", str(plant_file), "--out", str(plant_file.parent / "out"))
    assert code == 2
    assert "no library for this platform" in error
    assert "win32" in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "freight_profil_d"], "No scenario 'freight_profil_d'; did you mean 'freight_profile_"),
        (["run", "missing.toml"], "missing.toml does not exist"),
        (["run", "--set", "locomotive.mass"], "expected NAME=VALUE"),
        (["run", "--set", "locomotiv.mass=3"], "no component 'locomotiv'.*did you mean 'locomotive'"),
        (["info", "missing.fmu"], "missing.fmu does not exist"),
    ],
)
def test_a_wrong_command_ends_with_2_and_a_hint(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, error = run_cli(capsys, *arguments)
    assert code == 2
    assert re.search(message, error), error


def test_a_file_that_is_not_toml(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.toml").write_text("stop = = 3")
    code, error = run_cli(capsys, "run", str(tmp_path / "bad.toml"))
    assert code == 2
    assert "bad.toml: not readable as TOML" in error
    assert "line 1" in error


def test_every_fault_of_a_file_is_named_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "faults.toml"
    path.write_text('stop = 1.0\nstep = 0.1\ncolour = 1\n[components.a]\nmodel = "driver"\nfmu = "x.fmu"\n')
    code, error = run_cli(capsys, "run", str(path))
    assert code == 2
    assert "colour: unknown key" in error
    assert "components.a: give exactly one of 'fmu'" in error


def test_an_output_folder_that_cannot_be_written_is_found_early(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "taken").write_text("a file")
    code, error = run_cli(capsys, "run", "--out", str(tmp_path / "taken" / "out"))
    assert code == 2
    assert "taken" in error


def test_a_run_that_turns_to_nan_keeps_its_rows_and_ends_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "diverging.toml"
    path.write_text(
        "stop = 60.0\nstep = 0.1\n"
        '[components.train]\nmodel = "locomotive"\nas = "block3"\n'
        "parameters = { train_speed = 1e200, wheel_rate = 1e200 }\n"
    )
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--no-report"]) == 2
    said = capsys.readouterr()
    assert "cosim: the run could not begin: " in said.err
    assert " at t = " in said.err
    assert "simulated in" not in said.out  # figures of a run without a step would hide the reason
    assert "summary.json" in said.out
    result = read_results(tmp_path / "out")
    assert result.failure is not None
    assert len(result.table) >= 1
    assert np.isfinite(result.table["time"]).all()


# -- what a sceptical user tried
# ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "needed"),
    [
        ("master.threads", 2, "master.algorithm = 'jacobi'"),
        ("master.tolerance", 1e-3, "master.control = 'doubling'"),
        ("master.smallest_step", 1e-3, "master.control = 'doubling'"),
        ("balises.max_gap", 0.4, "balises.layout = 'aperiodic'"),
        ("balises.dropout_fraction", 0.3, "balises.layout = 'aperiodic'"),
        ("balises.position_noise", 0.5, "balises.location_accuracy = 2"),
    ],
)
def test_a_setting_without_effect_is_reported(key: str, value: float, needed: str) -> None:
    reported: list[str] = []
    small().run(overrides={key: value, "stop": 0.02}, warn=reported.append)
    name, wanted = needed.replace("'", "").split(" = ")
    assert any(text.startswith(f"{key} has no effect without {name}") for text in reported)
    works = {key: value, name: int(wanted) if wanted.isdigit() else wanted, "stop": 0.02}
    small().run(overrides=works, warn=reported.append)
    assert sum("has no effect" in text for text in reported) == 1


@pytest.mark.parametrize(
    ("setting", "value", "message"),
    [
        ("locomotive.mass", -5.0, r"locomotive.mass: -5 lies outside what the component declares: 1.0 to inf kg"),
        ("observer.mass", 0.0, r"observer.mass: 0 lies outside"),
        ("report.true_speed", "locomotive.sped", r"no variable 'sped'.*'speed'"),
        ("report.true_speed", "locomotive.position", r"report.true_speed: locomotive.position is not in m/s"),
        ("report.observers", ["nobody"], r"report.observers: no component 'nobody'"),
        ("report.other_trains", ["driver"], r"driver: no variable 'position'"),
        ("report.zones", [[5.0, 2.0]], r"report.zones, number 1: ends at 2 s"),
        ("report.phases", [{"name": "p", "start": 1.0, "end": 1.0}], r"report.phases, 'p'"),
        ("balises.false_telegrams", [{"time": 500.0, "offset": 1.0}], r"false_telegrams: 500 s lies outside the run"),
        ("balises.missed", ["B33"], r"missed: no balise 'B33'.*'B3'"),
        ("observer.parameters.mass", "heavy", r"observer.mass: expected a number"),
        ("observer.mass", "heavy", r"mass: expected a number, or a list of numbers for a vector \(got .heavy.\)"),
    ],
)
def test_nonsense_is_refused_with_its_place(setting: str, value: Any, message: str) -> None:
    with pytest.raises(CosimError, match=message) as caught:
        small().run(overrides={setting: value})
    assert str(caught.value).startswith("script: ")


@pytest.mark.compiler
@pytest.mark.compiler
def test_a_late_policy_for_an_fmu_that_has_none_is_refused() -> None:
    """The locomotive has no triggered events, so no parameter for late ones."""
    with pytest.raises(CosimError, match=r"components\.locomotive: this FMU has no parameter late_policy"):
        small().run(overrides={"locomotive.as": "fmu3", "locomotive.late_policy": "reject"})


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("forget", r"observer\.late_policy: no item 'forget'; "),
        (4, r"observer\.late_policy: 4 is no item of the enumeration: replay \(1\), reject \(2\), late \(3\)"),
    ],
)
def test_an_enumeration_takes_its_items_only(value: Any, message: str) -> None:
    with pytest.raises(CosimError, match=message):
        small().run(overrides={"observer.as": "fmu3", "observer.parameters": {"late_policy": value}})


def test_a_text_for_a_number_is_refused() -> None:
    with pytest.raises(CosimError, match=r"locomotive\.train_speed: expected a number, .* \(got 'fast'\)"):
        small().run(overrides={"locomotive.train_speed": "fast"})


@pytest.mark.parametrize(
    "doubt", [{}, {"balises.expected_speed": 10.0, "balises.missed_fraction": 0.1}, {"balises.expected_speed": 1.0}]
)
def test_required_certificates_must_be_had(doubt: dict[str, Any]) -> None:
    with pytest.raises(CosimError, match="require"):
        small().run(overrides={"certificates": "require", **doubt})
    assert small().run(overrides={"certificates": "require", "balises.expected_speed": 10.0}).failure is None


def test_rejected_and_undelivered_telegrams_are_not_passed_over() -> None:
    outcome = small().run(overrides={"observer.late_policy": "reject", "balises.latency": 0.15})
    fates = [e.outcomes["observer"] for e in outcome.result.events]
    assert fates == ["rejected", "rejected", "undelivered"]  # passed at 0.1, 0.25 and 0.4 s; the run ends at 0.5 s
    assert any("observer: 2 telegrams were rejected" in w for w in outcome.warnings)


def test_an_interrupted_run_keeps_its_rows() -> None:
    def interrupt(_t: float, _stop: float) -> None:
        raise KeyboardInterrupt

    outcome = small(title="long").set("stop", 5.0).run(progress=interrupt)
    assert outcome.failure is not None
    assert "interrupted" in outcome.failure
    assert len(outcome.result.table) > 1


def test_a_failed_run_with_seeds_writes_what_it_has(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(
        'stop = 1.0\nstep = 0.1\n[components.train]\nmodel = "locomotive"\nas = "block3"\n'
        "parameters = { train_speed = 1e200, wheel_rate = 1e200 }\n"
    )
    code, _ = run_cli(capsys, "run", str(path), "--out", str(tmp_path / "out"), "--seeds", "2")
    assert code == 2
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.compiler
@pytest.mark.parametrize("backend", ["fmu2", "fmu3"])
def test_what_a_failing_fmu_logged_is_part_of_the_message(backend: str) -> None:
    overflow = {"driver.profile_speed": 1e305, "driver.effort_limit": 1e308, "driver.power_limit": 1e308}
    outcome = small().run(overrides={"driver.as": backend, **overflow})
    assert outcome.failure is not None
    assert "Component 'driver' at t = " in outcome.failure
    assert "The FMU says: " in outcome.failure
    assert "not a finite number" in outcome.failure


@pytest.mark.parametrize(
    ("written", "meant", "name"), [("model", "observer", "threshold_detector"), ("observer", "model", "wheel_fault")]
)
def test_a_name_under_the_wrong_key_is_reported_with_the_right_one(written: str, meant: str, name: str) -> None:
    scenario = Scenario(stop=1.0, step=0.1)
    with pytest.raises(CosimError, match=f"write {meant} = '{name}'"):
        (scenario.add("part", model=name) if written == "model" else scenario.add("part", observer=name)).run()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"model": "pendulm"}, "components.filter: extended_kalman_filter: Unknown model 'pendulm'"),
        ({"model": "longitudinal_train", "outputs": ["sped"]}, "output 'sped' is unknown"),
    ],
)
def test_a_model_that_a_filter_cannot_have_is_no_traceback(options: dict[str, object], message: str) -> None:
    with pytest.raises(CosimError, match=message):
        Scenario(stop=1.0, step=0.1).add("filter", observer="extended_kalman_filter", options=options)


def test_an_observer_without_true_values_gets_no_row_of_dashes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "slope.toml"
    path.write_text(
        'stop = 0.2\nstep = 0.1\n[components.slope]\nobserver = "levant_differentiator"\nas = "block3"\n'
        "[components.other]\n"
        'observer = "levant_differentiator"\nas = "block3"\n'
    )
    assert main(["run", str(path), "--no-report", "--out", str(tmp_path / "out")]) == 0
    assert "rms v" not in capsys.readouterr().out


def test_an_interruption_while_a_command_is_loaded_is_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fmus.cli.commands.CommandProgram.parser", interrupted)
    assert main(["tune"]) == 2
    assert capsys.readouterr().err == "cosim: interrupted.\n"

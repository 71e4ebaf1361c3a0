"""The command line: what it prints, what it writes, how it exits."""

from __future__ import annotations

import json
import logging
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from small_scenarios import small

import fmu_observer
import plant_models
from cosim import Scenario
from cosim.cli import main
from cosim.cli.run_command import _slowest
from cosim.cli.scenarios import parse_setting
from cosim.errors import RunError
from cosim.results.results_folder import read_results
from fmu_observer import OBSERVERS
from fmu_observer.recommended import RECOMMENDED
from fmus.cli.warning_lines import warnings_in_lines


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every scenario name stands for the small one."""
    monkeypatch.setattr(Scenario, "load", classmethod(lambda _cls, _name, **_: small(title="Small run")))


@pytest.mark.usefixtures("quick")
def test_run_writes_everything_and_prints_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "any", "--out", str(tmp_path / "out"), "--set", "stop=0.3"]) == 0
    printed = capsys.readouterr().out
    assert "Small run: 0.3 s simulated" in printed
    assert "localised by 'rollback'" in printed
    written = {p.name for p in (tmp_path / "out").iterdir()}
    assert written >= {"table.csv", "events.csv", "summary.json", "report.html"}
    result = read_results(tmp_path / "out")
    assert result.time[-1] == 0.3
    assert result.summary["scenario"] == "script"


@pytest.mark.usefixtures("quick")
def test_the_verdict_comes_last_and_warnings_take_a_line_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late = ["run", "any", "--out", str(tmp_path), "--no-report", "--set", "balises.expected_speed=1.0"]
    assert main(late) == 0
    brief = capsys.readouterr()
    verdict = brief.out.splitlines()[-1]
    assert verdict.startswith("observer is off by at most ")
    assert re.fullmatch(r"(warning: .* \.\.\.\n)+\(--verbose shows warnings whole\)\n", brief.err)
    assert main([*late, "--verbose"]) == 0
    whole = capsys.readouterr()
    assert whole.out.splitlines()[-1] == verdict
    assert len(whole.out) > len(brief.out)
    assert len(whole.err) > 2 * len(brief.err)
    assert main([*late, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == verdict


def test_a_warning_is_cut_to_the_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    log = logging.getLogger("cosim")
    with warnings_in_lines(whole=False):
        log.warning("The train never moves: train.speed stays below %g m/s up to 10 s. Errors say nothing.", 0.01)
        log.warning("Short.")
        log.info("Not shown.")
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["warning: The train never moves ...", "warning: Short.", "(--verbose shows warnings whole)"]


@pytest.mark.usefixtures("quick")
def test_strict_turns_a_warning_into_exit_code_1(tmp_path: Path) -> None:
    common = ["run", "any", "--out", str(tmp_path), "--no-report", "--quiet", "--strict"]
    assert main([*common, "--set", "balises.expected_speed=10.0"]) == 0  # gaps of 0.15 s: certified
    assert main([*common, "--set", "balises.expected_speed=1.0"]) == 1  # 1.5 s: not


@pytest.mark.usefixtures("quick")
def test_run_as_json_is_one_document(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "any", "--out", str(tmp_path), "--json", "--no-report"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["failure"] is None
    assert data["reached"] == 0.5
    assert not (tmp_path / "report.html").exists()


@pytest.mark.usefixtures("quick")
def test_seeds_add_quartiles_to_print_and_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(_cls: type, _name: str, **_: bool) -> Scenario:
        scenario = small().report(
            phases=[{"name": "all", "start": 0.0, "end": 0.5}], published={"observer": {"all": 0.5}}
        )
        return scenario.set("balises.layout", "aperiodic").set("balises.max_gap", 0.2)

    monkeypatch.setattr(Scenario, "load", classmethod(load))
    assert main(["run", "any", "--out", str(tmp_path), "--seeds", "3"]) == 0
    assert "over 3 seeds" in capsys.readouterr().out
    assert "Over several seeds" in (tmp_path / "report.html").read_text()
    study = read_results(tmp_path).summary["seed_study"]
    row = study["rows"][0]
    assert study["seeds"] == [0, 1, 2]
    assert row["lower quartile"] <= row["median"] <= row["upper quartile"]
    assert row["published"] == 0.5
    table = (tmp_path / "seeds" / "index.csv").read_text().splitlines()
    assert [line.split(",")[1] for line in table] == ["seed", "0", "1", "2"]

    run, failing = Scenario.run, {"seed": 1}

    def lost(self: Scenario, *args: Any, overrides: Any = None, **others: Any) -> Any:
        if overrides == failing:
            raise RunError("the train is lost", "train", 0.1)
        return run(self, *args, overrides=overrides, **others)

    monkeypatch.setattr(Scenario, "run", lost)
    assert main(["run", "any", "--out", str(tmp_path), "--seeds", "3", "--no-report"]) == 1
    printed = capsys.readouterr().out
    assert "over 2 seeds" in printed
    assert "seed 1 failed: the train is lost" in printed


def test_list_names_everything_with_its_source(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {"freight_profile_d", "freight_profile_b", "own_fmu"} <= set(data["scenarios"])
    assert {"locomotive", "odometer", "driver"} <= set(data["models"])
    observers = {"differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio", "slip_indicator"}
    assert observers <= set(data["observers"])
    for name, observer in data["observers"].items():
        assert observer["source"].strip(), name
    assert main(["list", "observers", "--all"]) == 0
    printed = capsys.readouterr().out
    assert "as_published" in printed
    assert "scenarios:" not in printed


def test_list_begins_with_what_is_recommended(capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "guide" / "choosing_an_observer.md").read_text(encoding="utf-8")
    assert len(RECOMMENDED) == 5
    for name in RECOMMENDED:
        assert name in OBSERVERS
        assert f"`{name}`" in page
    for line in (["list"], ["list", "observers"]):
        assert main(line) == 0
        printed = capsys.readouterr().out
        assert [name for name in RECOMMENDED if name in printed] == list(RECOMMENDED)
        assert len(printed.splitlines()) < 15
        assert "cosim list observers --all" in printed


def test_list_finds_what_holds_all_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "Balise", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {"balise_reader"} == set(data["models"])
    assert {"amsterdam_utrecht", "worn_wheel"} <= set(data["scenarios"])
    assert set(RECOMMENDED) <= set(data["observers"])  # not by their words, but by their events
    assert main(["list", "observers", "balise", "covariance", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == {"observers"}
    assert main(["list", "locomotve"]) == 2
    assert "Nothing that ships holds 'locomotve'; did you mean 'locomotive'?" in capsys.readouterr().err


def test_list_for_a_scenario_names_observers_whose_inputs_it_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def fitting(scenario: Scenario) -> dict[str, Any]:
        assert main(["list", "--for", str(scenario.save(tmp_path / "own.toml")), "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    whole = fitting(small())
    assert whole["observers"][:5] == list(RECOMMENDED)
    assert "nothing gives its inputs" in whole["misfits"]["thau"]
    assert len(whole["observers"]) + len(whole["misfits"]) == len(OBSERVERS)
    coasting = Scenario(stop=1.0, step=0.1).add("train", model="longitudinal_train").add("odometer", model="odometer")
    coasting.add("observer", observer="odometer_reset")
    coasting.connect("train.wheel_speed -> odometer.wheel_speed", "odometer.reading -> observer.odometer")
    without = fitting(coasting)
    assert "odometer_reset" in without["misfits"]  # there are no balises
    assert without["misfits"]["quasi_lpv_uio"] == "nothing gives its input effort"
    coasting.balises(layout="spacing", spacing=10.0, track_end=90.0, position="train.position", speed="train.speed")
    assert [name for name in RECOMMENDED if name in fitting(coasting)["observers"]] == ["odometer_reset"]


def test_list_groups_by_room_and_shows_what_options_may_be(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    room = next(i for i, line in enumerate(lines) if line.startswith("# What drives"))
    names = [line.split()[0] for line in lines[room + 1 :] if line[:1].isalpha()]
    assert names[0] == "adrc_controller"
    headings = [line for line in lines if line.startswith("# ")]
    shipped = [heading for heading in headings if not heading.startswith("# Registered by")]  # other tests
    assert len(shipped) == len(plant_models.ROOMS) + len(fmu_observer.ROOMS)
    assert any("order = 2 (0, 1, 2, 3, 4, 5)" in line for line in lines)
    assert any("wagons = 4 (1 to 20)" in line for line in lines)


@pytest.mark.compiler
def test_info_describes_an_fmu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from fmus import build_fmu
    from plant_models import PLANTS

    path = build_fmu(PLANTS["driver"](), tmp_path, fmi_version=2)
    assert main(["info", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "FMI version" in printed
    assert "runs here" in printed
    assert "odometer" in printed
    assert main(["info", str(path), "--json"]) == 0
    names = {v["name"] for v in json.loads(capsys.readouterr().out)["variables"]}
    assert {"odometer", "effort", "effort_limit"} <= names


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a.b=3", ("a.b", 3)),
        ("a.b = 80e3", ("a.b", 80e3)),
        ("a=[1.0, 2.0]", ("a", [1.0, 2.0])),
        ("a=true", ("a", True)),
        ("a=repaired", ("a", "repaired")),
        ('a="x=y"', ("a", "x=y")),
    ],
)
def test_a_setting_is_a_toml_value_where_it_is_one(text: str, expected: tuple[str, object]) -> None:
    assert parse_setting(text) == expected


def test_a_reader_that_leaves_is_no_reason_for_a_traceback() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "cosim.cli", "list", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    process.stdout.close()
    _, reported = process.communicate(timeout=120)
    assert (process.returncode, reported) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_standard_output_on_a_full_disk_is_no_reason_for_a_traceback() -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        command = [sys.executable, "-m", "cosim.cli", "list"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "cosim: standard output cannot be written: No space left on device.\n"


def test_a_usage_error_exits_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    for stated, message in (("0", "at least 1"), ("many", "expected a whole number (got 'many')")):
        with pytest.raises(SystemExit) as error:
            main(["run", "--seeds", stated])
        assert error.value.code == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("seconds", "wall", "said"),
    [
        ([133.0, 0.1], 143.2, " 93 % of the time were steps of ship."),
        ([1.0, 0.1], 1.2, ""),  # short
        ([3.0, 3.0], 9.0, ""),  # of no one alone
        ([], 9.0, ""),
    ],
)
def test_a_long_run_says_where_its_time_went(seconds: list[float], wall: float, said: str) -> None:
    parts = [{"name": name, "seconds": spent} for name, spent in zip(("ship", "allocation"), seconds, strict=False)]
    assert _slowest({"components": parts, "wall_seconds": wall}) == said


@pytest.mark.parametrize("words", [["--workers", "2"], ["--resume"], ["--retry", "--scheduler", "tcp://h:1"]])
def test_what_is_for_several_runs_is_refused_for_one(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """It did nothing before, and said nothing of that."""
    assert main(["run", *words]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words if word.startswith("--"))
    assert "only for several runs; say how many with --seeds N" in said

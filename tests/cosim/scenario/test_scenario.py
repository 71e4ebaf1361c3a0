"""Scenarios: the same from a file and from a script; overrides; what a run says about itself."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario, shipped_scenarios
from cosim.errors import CertificateError, CosimError
from fmus import cached_fmu, recipe

TOML = """
title = "Small"
stop = 0.5
step = 0.01
connections = [
    "driver.effort -> locomotive.effort, observer.effort",
    "locomotive.wheel_speed -> odometer.wheel_speed",
    "odometer.reading -> driver.odometer, observer.odometer",
]
[components.locomotive]
model = "locomotive"
as = "block3"
parameters = { train_speed = 10.0, wheel_rate = 17.39130434782609 }
[components.odometer]
model = "odometer"
as = "block3"
[components.driver]
model = "driver"
as = "block3"
parameters = { profile_speed = 10.0 }
[components.observer]
observer = "takagi_sugeno_cdo"
as = "block3"
parameters = { estimated_speed = 10.0 }
[balises]
position = "locomotive.position"
speed = "locomotive.speed"
odometer = "odometer.reading"
layout = "csv"
file = "balises.csv"
method = "rollback"
"""


OUTCOME_OF = {None: "replayed", "reject": "rejected", "late": "late"}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "balises.csv").write_text("identity,position\nA,1.0\nB,2.5\nC,4.0\n")
    path = tmp_path / "small.toml"
    path.write_text(TOML)
    return path


def test_a_file_and_a_script_give_the_identical_run(file: Path) -> None:
    from_file, from_script = Scenario.load(file).run(), small().run()
    np.testing.assert_array_equal(from_file.result.table, from_script.result.table)
    assert [e.stamp for e in from_file.result.events] == [e.stamp for e in from_script.result.events]


def test_paths_are_relative_to_the_file_not_to_the_user(
    file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert len(Scenario.load(file).run().result.events) == 3


def test_an_override_acts_on_its_run_only() -> None:
    scenario = small()
    heavy = scenario.run(overrides={"locomotive.mass": 180e3, "locomotive.davis_a": 50e3})
    light = scenario.run(overrides={"locomotive.davis_a": 50e3})
    plain = scenario.run()
    assert heavy.result.summary["components"][0]["parameters"]["mass"] == 180e3
    # Without effort worth mentioning (the driver only begins to react), the deceleration is davis_a / mass.
    assert plain["locomotive.speed"][-1] > heavy["locomotive.speed"][-1] > light["locomotive.speed"][-1]


def test_set_reaches_every_kind_of_key() -> None:
    scenario = small().set("stop", 0.2).set("balises.method", "interpolate").set("observer.preset", "as_published")
    scenario.set("observer.options.premise", "live").set("report.evaluate_after", 0.1).set(
        "observer.innovation_decay", 5.0
    )
    table = scenario.table()
    assert (table.stop, table.balises.method, table.report.evaluate_after) == (0.2, "interpolate", 0.1)
    observer = table.components["observer"]
    assert (observer.preset, observer.options) == ("as_published", {"premise": "live"})
    assert observer.parameters["innovation_decay"] == 5.0


def test_a_number_for_a_vector_parameter_sets_all_its_elements_and_a_list_each() -> None:
    outcome = small().set("driver.profile_speed", [10.0, 10.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0]).run()
    starts = next(c for c in outcome.result.summary["components"] if c["name"] == "driver")["parameters"]
    assert (starts["profile_speed[1]"], starts["profile_speed[3]"], starts["profile_speed[8]"]) == (10.0, 9.0, 9.0)
    assert small().run().result.summary["components"][2]["parameters"] == {
        f"profile_speed[{i}]": 10.0 for i in range(1, 9)
    }


def test_the_summary_says_how_the_run_was_made() -> None:
    summary = small().run().result.summary
    assert summary["localisation"]["method"] == "rollback"
    assert summary["order"] == ["locomotive", "odometer", "driver", "observer"]
    assert summary["probe"]["restores"] == "exact"
    assert summary["redo_differences"] == 0
    assert summary["reached"] == 0.5
    assert set(summary["seconds"]) == {"locomotive", "odometer", "driver", "observer", "master", "recording"}
    assert {"fmu-observer", "fmpy", "casadi", "python"} <= set(summary["versions"])


def test_balises_do_not_touch_the_plant() -> None:
    with_balises, without = small(), small()
    del without._data["balises"]
    a, b = with_balises.run(), without.run()
    grid = np.isin(a["time"], b["time"]) & ~np.isin(a["time"], [e.stamp for e in a.result.events])
    for signal in ("locomotive.position", "locomotive.speed", "driver.effort"):
        np.testing.assert_array_equal(a[signal][grid], b[signal])


def test_a_run_with_the_other_fmi_version_is_identical() -> None:
    two = small()
    for name in ("locomotive", "odometer", "driver", "observer"):
        two.set(f"{name}.as", "block2")
    a, b = small().run(), two.run()
    assert a["observer.speed"][-1] == b["observer.speed"][-1]
    assert a["locomotive.position"][-1] == b["locomotive.position"][-1]


def test_gaps_beyond_the_certificate_warn_before_the_run_or_refuse_it() -> None:
    scenario = small().set("balises.expected_speed", 1.0)  # 1.5 m at 1 m/s: 1.5 s, certified are 0.779 s
    outcome = scenario.run()
    assert any("UNSTABLE" in w and "1.5" in w for w in outcome.warnings)
    assert outcome.result.summary["certificates"]["observer"]["holds"] is False
    with pytest.raises(CertificateError, match="require"):
        scenario.run(overrides={"certificates": "require"})
    calm = scenario.run(overrides={"balises.expected_speed": 10.0})
    assert calm.result.summary["certificates"]["observer"]["holds"] is True
    assert not any("UNSTABLE" in w for w in calm.warnings)


def test_the_certificate_is_of_the_very_gains_in_use() -> None:
    # eta 3 at 0.6 s: unstable
    scenario = small().set("balises.expected_speed", 2.5).set("observer.innovation_decay", 3.0)
    assert scenario.run().result.summary["certificates"]["observer"]["constant_limit"] == pytest.approx(0.286, rel=0.01)


def test_gaps_that_turn_out_too_long_are_reported_afterwards() -> None:
    outcome = small(start=0.0).set("balises.positions", [1.0, 4.9]).set("observer.innovation_decay", 1.0).run()
    # 3.9 m at about 10 m/s is 0.39 s; with eta = 1 the published gains are certified for less than that (0.25 s at eta
    # = 2).
    assert any("longest gap" in w for w in outcome.warnings)


@pytest.mark.parametrize("name", shipped_scenarios())
def test_what_ships_is_valid(name: str) -> None:
    table = Scenario.load(name).table()
    assert table.title
    assert table.description


@pytest.mark.compiler
@pytest.mark.parametrize("backend", ["fmu2", "fmu3"])
@pytest.mark.parametrize("policy", [None, "reject", "late"])
def test_sealed_receivers_treat_late_telegrams_as_blocks_do(backend: str, policy: str | None) -> None:
    """By the FMU's own parameter; the block of the same FMI version does the same, but for roundings of a divided
    cell.
    """
    changes: dict[str, Any] = {"stop": 0.8, "balises.latency": 0.1, "balises.latency_jitter": 0.1}
    changes |= {} if policy is None else {"observer.late_policy": policy, "observer.replay_horizon": 4.0}
    runs, fates, counts = [], [], []
    for kind in (backend, backend.replace("fmu", "block")):
        outcome = small().run(overrides=changes | {"observer.as": kind})
        assert outcome.failure is None
        assert not any("late" in w for w in outcome.warnings if "rejected" not in w)
        runs.append(outcome.result.table)
        fates.append([e.outcomes["observer"] for e in outcome.result.events])
        counts.append(outcome.result.summary["components"][-1]["events"])
    sealed, block = runs
    assert fates[0] == fates[1]
    assert counts[0] == counts[1]
    assert set(fates[0]) - {"undelivered"} == {OUTCOME_OF[policy]}
    assert counts[0][OUTCOME_OF[policy]] > 0
    for name in ("observer.position", "observer.speed"):
        np.testing.assert_allclose(sealed[name], block[name], rtol=1e-12, atol=1e-12)
    reported = small().run(overrides={"stop": 0.8}).result.table
    equal = np.allclose(sealed["observer.position"][-1], reported["observer.position"][-1], rtol=1e-9, atol=0.0)
    assert equal == (policy is None)


@pytest.mark.compiler
@pytest.mark.parametrize("value", ["reject", 2])
def test_an_enumeration_is_set_by_the_name_or_the_number_of_an_item(value: str | int) -> None:
    changes = {"observer.as": "fmu3", "balises.latency": 0.1}
    by_key = small().run(overrides=changes | {"observer.late_policy": "reject"}).result.table
    by_parameter = small().run(
        overrides=changes | {"observer.parameters": {"late_policy": value, "estimated_speed": 10.0}}
    )
    np.testing.assert_array_equal(by_parameter.result.table["observer.position"], by_key["observer.position"])


@pytest.mark.compiler
def test_an_fmu_that_does_not_say_what_it_does_with_late_telegrams_is_warned_about(file: Path) -> None:
    """As a vendor's: the parameter is hidden in the description."""
    vendor = file.parent / "vendor.fmu"
    with zipfile.ZipFile(cached_fmu(recipe("takagi_sugeno_cdo"), 3)) as source, zipfile.ZipFile(vendor, "w") as target:
        for entry in source.infolist():
            content = source.read(entry)
            if entry.filename == "modelDescription.xml":
                content = re.sub(rb'<Enumeration name="late_policy".*?/>', b"", content, flags=re.DOTALL)
            target.writestr(entry, content)
    file.write_text(TOML.replace('observer = "takagi_sugeno_cdo"\nas = "block3"', 'fmu = "vendor.fmu"'))
    scenario = Scenario.load(file)
    warnings = scenario.run(overrides={"balises.latency": 0.1}).warnings
    assert any("observer: a sealed FMU without a parameter late_policy" in w for w in warnings)
    assert not any("late_policy" in w for w in scenario.run().warnings)  # nothing is late
    with pytest.raises(CosimError, match="this FMU has no parameter late_policy"):
        scenario.run(overrides={"observer.late_policy": "reject"})


def test_doubts_are_reported_before_the_first_step() -> None:
    reported: list[str] = []

    def progress(t: float, _stop: float) -> None:
        reported.append(f"reached {t}")

    outcome = small().set("balises.expected_speed", 1.0).run(progress=progress, warn=reported.append)
    assert "UNSTABLE" in reported[0]
    assert reported[1].startswith("reached")
    assert outcome.warnings == [t for t in reported if not t.startswith("reached")]


def test_a_script_that_asks_for_nothing_finds_the_doubts_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    small().set("balises.expected_speed", 1.0).run()
    assert any("UNSTABLE" in record.message for record in caplog.records if record.name == "cosim")

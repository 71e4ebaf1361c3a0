"""The tolerance that FMUs are told: the component's, the scenario's, the declared one; refused values, FMUs that refuse
it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_fmus.adaptive import adaptive_fmu

from cosim import Scenario
from cosim.components.loading import load_fmu
from cosim.errors import CosimError, ScenarioError
from fmus.check.checked_instance import make_slave

pytestmark = pytest.mark.compiler


def scenario(fmu: Path, **component: Any) -> Scenario:
    return Scenario(stop=0.2, step=0.1).add("plant", fmu=str(fmu), **component)


def reported(one: Scenario) -> float:
    outcome = one.run()
    assert outcome.failure is None
    value = float(outcome["plant.reported"][-1])
    assert (outcome.result.summary["components"][0]["tolerance"] or 0.0) == value
    return value


@pytest.mark.parametrize("version", [2, 3])
def test_the_nearest_tolerance_is_named(tmp_path: Path, version: Any) -> None:
    plain = adaptive_fmu(tmp_path, "plain", version=version)
    declaring = adaptive_fmu(tmp_path, "declaring", version=version, declared=1e-5)
    assert reported(scenario(plain)) == 0.0
    assert reported(scenario(declaring)) == 1e-5
    assert reported(scenario(declaring).set("tolerance", 1e-6)) == 1e-6
    assert reported(scenario(declaring, tolerance=1e-7).set("tolerance", 1e-6)) == 1e-7
    assert reported(scenario(declaring, tolerance="none").set("tolerance", 1e-6)) == 0.0
    assert reported(scenario(declaring).set("tolerance", "none")) == 0.0


def test_fmi_1_has_no_call_for_it_and_that_is_said(tmp_path: Path) -> None:
    fmu = adaptive_fmu(tmp_path, version=1, declared=1e-5)
    assert reported(scenario(fmu)) == 0.0
    outcome = scenario(fmu, tolerance=1e-6).run()
    assert any("no call that takes a tolerance; it does nothing for plant" in text for text in outcome.warnings)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_that_refuses_the_tolerance_says_so_with_a_hint(tmp_path: Path, version: Any) -> None:
    fmu = adaptive_fmu(tmp_path, version=version, finest=1e-4, declared=1e-6)
    words = r"with the tolerance 1e-06 \(.*'tolerance', or 'none'\) failed: .*a tolerance of 1e-06 is too fine"
    try:
        failure = scenario(fmu).run().failure
    except CosimError as error:
        failure = str(error)
    assert failure is not None
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(failure)
    assert reported(scenario(fmu, tolerance=1e-3)) == 1e-3
    assert reported(scenario(fmu, tolerance="none")) == 0.0


@pytest.mark.parametrize("value", [0.0, -1e-6, float("nan"), float("inf"), "fine", True, [1e-6]])
def test_what_is_no_tolerance_is_refused(value: Any) -> None:
    refused = pytest.raises(ScenarioError, match="expected a relative tolerance, a number above 0, or 'none'")
    with refused:
        scenario(Path("any.fmu"), tolerance=value)
    with refused:
        Scenario(stop=0.2, step=0.1).set("tolerance", value)


def test_shipped_models_have_an_internal_step_instead() -> None:
    with pytest.raises(ScenarioError, match="'tolerance' belongs to an FMU"):
        Scenario(stop=0.2, step=0.1).add("plant", model="locomotive", tolerance=1e-6).run()


@pytest.mark.parametrize("version", [2, 3])
def test_the_check_names_the_declared_one(tmp_path: Path, version: Any) -> None:
    import fmpy

    fmu = adaptive_fmu(tmp_path, version=version, declared=1e-5)
    folder = fmpy.extract(str(fmu), str(tmp_path / "unpacked"))
    slave = make_slave(Path(folder), fmpy.read_model_description(str(fmu)))
    slave.instantiate()
    slave.enter_initialization(0.0, 1.0)
    slave.exit_initialization()
    assert slave.read(["reported"])[0] == slave.tolerance == load_fmu(fmu, "one").tolerance == 1e-5
    slave.free()

"""A state may be an output: its start is set where the description says so, alike by whoever sets start values."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import lying_fmus
import pytest

import cosim
from cosim.cli import main
from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.settings import FilterTable
from cosim.fmu_model.linearise import linearise_fmu
from fmus.cli import main as fmus_main
from fmus.fmi.types import why_not_set


def _run(path: Path) -> float:
    scenario = cosim.Scenario(folder=path.parent, stop=0.2, step=0.1)
    scenario.add("plant", fmu=path.name, parameters={"speed": 2.0})
    return float(scenario.run(warn=lambda _: None)["plant.speed"][0])


def _filtered(kind: str, path: Path) -> float:
    deviations = {"measurements": {"speed": 0.1}, "start_deviation": {"speed": 1e-9}, "members": 4}
    filter_ = FmuFilterModel(path, FilterTable.model_validate({"kind": kind, **deviations}), {"speed": 2.0})
    inputs = {signal.name: 0.0 for signal in filter_.inputs}
    return float(filter_.step(0.0, inputs | {"measured_speed": 2.0}, 1e-9)["speed"])


def _calibrated(path: Path) -> float:
    table = path.parent / "table.csv"
    table.write_text("time,speed,force\n" + "".join(f"{k / 10},{2.0 * 0.9512294245007140**k},0\n" for k in range(20)))
    words = ["--parameters", "speed=1.5", "--toml", str(path.parent / "fitted.toml")]
    if main(["calibrate", str(path), str(table), *words]) == 2:
        raise cosim.CosimError("refused")
    return float(tomllib.loads((path.parent / "fitted.toml").read_text())["parameters"]["speed"])


def _checked(path: Path) -> float:
    if fmus_main(["check", str(path), "--start", "speed=2"]) == 2:
        raise cosim.CosimError("refused")
    return 2.0


SETTERS: dict[str, Callable[[Path], float]] = {
    "run": _run,
    **{kind: (lambda path, kind=kind: _filtered(kind, path)) for kind in ("ekf", "ukf", "ensemble", "particle")},  # type: ignore[misc]
    "linearise": lambda path: float(linearise_fmu(path, parameters={"speed": 2.0}).x[1]),
    "calibrate": _calibrated,
    "check": _checked,
}


@pytest.mark.parametrize("setter", SETTERS)
def test_it_is_set_where_it_is_exact_and_refused_where_it_is_calculated(
    setter: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert SETTERS[setter](lying_fmus.build(tmp_path / "exact")) == pytest.approx(2.0, abs=1e-6)
    xml = lying_fmus.description()
    at = xml.index('name="speed"')
    later = xml[at:].replace('initial="exact"', 'initial="calculated"', 1).replace('<Real start="1"/>', "<Real/>", 1)
    calculated = lying_fmus.build(tmp_path / "calculated", xml=xml[:at] + later)
    capsys.readouterr()
    with pytest.raises(cosim.CosimError) as error:
        SETTERS[setter](calculated)
    said = str(error.value) + capsys.readouterr().err
    assert "cannot be set: it has causality 'output' and is calculated" in said


def _variable(**words: Any) -> Any:
    return SimpleNamespace(**({"type": "Real", "variability": "continuous", "start": None} | words))


def test_what_the_standard_lets_be_set_is() -> None:
    """The table of causality, variability and initial of FMI 2.0.5, 2.2.7; locals are taken as the FMU takes them."""
    for initial, free in (("exact", True), ("approx", True), ("calculated", False)):
        assert (not why_not_set(_variable(causality="output", initial=initial))) == free
        assert (not why_not_set(_variable(causality="calculatedParameter", initial=initial))) == free
    assert not why_not_set(_variable(causality="output", initial=None, start="1"))  # FMI 1.0 has no such word
    assert why_not_set(_variable(causality="output", initial=None))
    assert why_not_set(_variable(causality="independent", initial=None))
    assert why_not_set(_variable(causality="output", variability="constant", initial="exact"))
    for causality in ("parameter", "input", "local"):
        assert not why_not_set(_variable(causality=causality, initial=None))

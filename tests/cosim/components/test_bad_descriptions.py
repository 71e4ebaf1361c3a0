"""Descriptions that cannot be meant: refused in words before anything of the FMU runs, through the command line."""

from __future__ import annotations

import ctypes
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from test_fmus.build import linear_fmu
from test_fmus.events import periodic_fmu
from test_fmus.typed import typed_fmu

from cosim.cli import main
from cosim.components.loading import load_fmu
from cosim.errors import RunError

SCENARIO = 'stop = 0.2\nstep = 0.1\n[components.a]\nfmu = "bad.fmu"\n'


def changed(fmu: Path, old: str, new: str, member: str = "modelDescription.xml") -> Path:
    """A copy named ``bad.fmu`` with a text replaced in a member, or in its library."""
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    found = [name for name in files if name.startswith(member) and old.encode() in files[name]]
    assert found, old
    files[found[0]] = files[found[0]].replace(old.encode(), new.encode())
    path = fmu.parent / "bad.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def mass(folder: Path, version: Any = 2) -> Path:
    """A mass, force in, position out."""
    return linear_fmu(
        folder, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], version=version, inputs=["f"], outputs=["x"]
    )


def refused(folder: Path, capsys: pytest.CaptureFixture[str], text: str = SCENARIO, command: str = "run") -> str:
    """What the command line says of the scenario; it ends with 2."""
    (folder / "s.toml").write_text(text)
    more = {"run": ["--out", str(folder / "out"), "--no-report"], "export": [str(folder / "s.ssp")], "show": []}[
        command
    ]
    assert main([command, str(folder / "s.toml"), *more]) == 2
    return capsys.readouterr().err


MOOD = '<Item name="calm" value="1"/>'
N, TWO = 'Dimension valueReference="1"', 'Dimension start="2"'
TICK = 'intervalVariability="constant"'
CASES = {
    "two of a name": (mass, 'name="x0[1]"', 'name="x"', r"two variables are named 'x', value references 2 and 3"),
    "reference too large": (
        mass,
        'valueReference="1"',
        'valueReference="4294967296"',
        "reference 4294967296, expected 0 to",
    ),
    "reference negative": (mass, 'valueReference="1"', 'valueReference="-1"', "value reference -1, expected 0 to"),
    "reference missing": (mass, ' valueReference="1"', "", "attribute 'valueReference' is required but missing"),
    "version missing": (mass, ' fmiVersion="2.0"', "", "an attribute is missing, or a reference leads nowhere"),
    "item without value": (
        typed_fmu,
        MOOD,
        '<Item name="calm"/>',
        "item 'calm' of enumeration 'Mood' has the value None",
    ),
    "item with a text": (
        typed_fmu,
        MOOD,
        '<Item name="calm" value="one"/>',
        "item 'calm' .* has the value 'one', expected",
    ),
    "dimension unknown": (typed_fmu, f"<{N}/>", '<Dimension valueReference="77"/>', "leads nowhere: .*77"),
    "dimension negative": (
        typed_fmu,
        f"<{TWO}/>",
        '<Dimension start="-2"/>',
        r"shape \(-2, 3\); no dimension may be neg",
    ),
    "dimension huge": (typed_fmu, f"<{TWO}/>", '<Dimension start="1000000000"/>', "too large: an input has at most"),
    "clock unknown": (
        periodic_fmu,
        TICK,
        'intervalVariability="weekly"',
        "clock 'tick' has the intervalVariability 'weekly'",
    ),
}


@pytest.mark.compiler
@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_meant_is_named(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make, old, new, message = CASES[case]
    changed(make(tmp_path), old, new)
    error = refused(tmp_path, capsys)
    assert error.startswith("cosim: ")
    assert "bad.fmu" in error
    assert re.search(message, error), error


@pytest.mark.compiler
def test_one_variable_stated_twice_is_one_variable(tmp_path: Path) -> None:
    changed(mass(tmp_path), 'name="x[1]" valueReference="5"', 'name="x" valueReference="2"')
    (tmp_path / "s.toml").write_text(SCENARIO)
    assert main(["run", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--no-report"]) == 0


@pytest.mark.compiler
@pytest.mark.parametrize("command", ["run", "show", "export"])
def test_a_structural_parameter_cannot_make_an_array_without_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    typed_fmu(tmp_path, "bad")
    error = refused(tmp_path, capsys, SCENARIO + "parameters = { n = 1000000000 }\n", command)
    assert "With n = 1000000000: array 'u_vector' of shape (1000000000,) is too large" in error


@pytest.mark.compiler
@pytest.mark.parametrize(("version", "function"), [(2, "fmi2CancelStep"), (3, "fmi3GetClock")])
def test_a_missing_function_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], version: Any, function: str
) -> None:
    changed(mass(tmp_path, version), f"\0{function}\0", f"\0X{function[1:]}\0", "binaries")
    error = refused(tmp_path, capsys)
    assert "its library lacks a function that FMI demands of every FMU: " in error
    assert function in error


@pytest.mark.compiler
@pytest.mark.parametrize(("version", "flag"), [(2, "canGetAndSetFMUstate"), (3, "canGetAndSetFMUState")])
def test_states_that_are_promised_and_not_delivered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], version: Any, flag: str
) -> None:
    plain = linear_fmu(tmp_path, "mass", [[0]], [[1]], [[1]], [[0]], version=version, state=False)
    changed(plain, "<CoSimulation ", f'<CoSimulation {flag}="true" ')
    error = refused(tmp_path, capsys, SCENARIO + '[master]\ncontrol = "doubling"\n')
    assert "which its description promises; without it: algorithm gauss-seidel or jacobi, control fixed" in error
    assert (tmp_path / "out" / "table.csv").exists()


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_a_state_that_is_a_null_pointer_is_not_taken_for_one(tmp_path: Path, version: Any) -> None:
    component = load_fmu(mass(tmp_path, version), "mass")
    component.instantiate()
    name = "getFMUstate" if version == 2 else "getFMUState"
    setattr(component.slave, name, ctypes.c_void_p)
    try:
        with pytest.raises(RunError, match=f"{name} .* failed: the slave gave no state"):
            component.save()
    finally:
        component.free()


def test_more_steps_than_anybody_can_wait_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = SCENARIO.replace("stop = 0.2", "stop = 1e308").replace("step = 0.1", "step = 1e-10")
    assert "step 1e-10 s from 0.0 s to 1e+308 s: more than 1e+12 steps" in refused(tmp_path, capsys, text)


@pytest.mark.compiler
@pytest.mark.parametrize("value", [-129, 128, 2.0**70])
def test_integers_beyond_their_type_are_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], value: float
) -> None:
    typed_fmu(tmp_path, "bad")
    for command in ("run", "export"):
        error = refused(tmp_path, capsys, SCENARIO + f"parameters = {{ u_int8 = {value} }}\n", command)
        assert f"a.u_int8: expected -128 to 127 for a Int8 (got {int(value)})" in error

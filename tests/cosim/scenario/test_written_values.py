"""What a user writes for a variable becomes the same value, or the same refusal, on every way to the FMU."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.typed import MOODS, typed_fmu

import cosim
from cosim.components.component import Component
from cosim.components.loading import describe_fmu
from cosim.components.start_values import declared_start, start_values
from cosim.errors import CosimError, CouplingError
from cosim.starter.starter_file import StarterWishes, write_starter

WRITTEN: tuple[Any, ...] = (True, 0, 1, 2, -1, 3.0, 2.5, 127, 300, 2**31, 2**64 - 1, -(2**63), 1e300)
WRITTEN += ("busy", "calmm", "00ff", "0f0", "", "3", "Zürich")
VERSIONS = (1, 2, 3)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return {version: typed_fmu(tmp_path_factory.mktemp("typed"), version=version) for version in VERSIONS}  # type: ignore[arg-type]


def expected(kind: str, value: Any) -> Any:
    """What a type makes of a written value, by NumPy's own types; None where it is refused."""
    number = None if isinstance(value, str) else value
    if kind in ("String", "Binary"):
        return value if kind == "String" and number is None else _hexadecimal(value)
    if kind == "Enumeration" and value in MOODS:
        return MOODS.index(value) + 1
    if number is None:
        return None
    if kind in ("Real", "Float64", "Float32"):
        return None if kind == "Float32" and abs(number) > float(np.finfo(np.float32).max) else float(number)
    if kind == "Boolean":
        return bool(number) if number in (0, 1) else None
    limits = (1, len(MOODS)) if kind == "Enumeration" else _limits(kind)
    return int(number) if number == int(number) and limits[0] <= number <= limits[1] else None


def _hexadecimal(value: Any) -> bytes | None:
    digits = isinstance(value, str) and len(value) % 2 == 0 and set(value) <= set("0123456789abcdef")
    return bytes(int(value[i : i + 2], 16) for i in range(0, len(value), 2)) if digits else None


def _limits(kind: str) -> tuple[int, int]:
    info = np.iinfo("int32" if kind == "Integer" else kind.lower())
    return int(info.min), int(info.max)


def taken(component: Component, name: str, value: Any) -> Any:
    """The typed value, or the words of the refusal."""
    try:
        return start_values(component, {name: value})[name]
    except CouplingError as error:
        return error


def inputs(component: Component) -> list[Any]:
    return [v for v in component.variables.values() if v.name.startswith("u_") and v.name != "u_negated"]


@pytest.mark.compiler
@pytest.mark.parametrize("version", VERSIONS)
def test_every_type_takes_what_it_can_hold_and_refuses_the_rest_by_name(files: dict[int, Path], version: int) -> None:
    component = describe_fmu(files[version], "a")
    for variable in inputs(component):
        for value in WRITTEN:
            found, right = taken(component, variable.name, value), expected(variable.type, value)
            if right is None:
                assert isinstance(found, CouplingError), (variable.type, value, found)
                assert str(found).startswith(f"a.{variable.name}: "), found
            else:
                every = found if variable.shape else [found]
                assert every == [right] * max(1, int(np.prod(variable.shape or (1,)))), (variable.type, value)
                assert {type(one) for one in every} == {type(right)}


@pytest.mark.compiler
@given(data=st.data())
def test_a_run_and_a_package_take_equal_values_and_refuse_in_equal_words(
    files: dict[int, Path], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    component = describe_fmu(files[data.draw(st.sampled_from(VERSIONS))], "a")
    variable, value = data.draw(st.sampled_from(inputs(component))), data.draw(st.sampled_from(WRITTEN))
    parameters = {variable.name: value}
    found = taken(component, variable.name, value)
    package = tmp_path_factory.mktemp("ssp") / "a.ssp"
    plain = cosim.Scenario(stop=0.1, step=0.1)
    if isinstance(found, CouplingError):
        unchecked = plain.copy().add("a", fmu=component.source).with_settings({f"a.{variable.name}": value})
        stated = partial(plain.add, "a", fmu=component.source, parameters=parameters)
        for refused in (stated, unchecked.run, partial(unchecked.export_ssp, package)):
            with pytest.raises(CosimError) as raised:
                refused()
            assert str(found) in str(raised.value)
        return
    s = plain.add("a", fmu=component.source, parameters=parameters)
    assert in_summary(s) == {variable.name: shown(found)}
    if component.fmi_version > 1:  # SSP knows no FMI 1.0
        assert in_summary(cosim.Scenario.load(str(s.export_ssp(package)))) == {variable.name: shown(found)}


@pytest.mark.compiler
@pytest.mark.parametrize("version", VERSIONS)
def test_a_starter_states_what_the_fmu_declares(files: dict[int, Path], tmp_path: Path, version: int) -> None:
    component = describe_fmu(files[version], "a")
    declared = {v.name: declared_start(v) for v in component.variables.values() if v.causality == "input"}
    declared = {name: value for name, value in declared.items() if value is not None}
    path = tmp_path / "starter.toml"
    write_starter(files[version], path, StarterWishes(probe=False))
    assert len(declared) > 3
    assert declared == {name: {"u_string": "", "u_enumeration": 1}.get(name, 0) for name in declared}
    assert in_summary(cosim.Scenario.load(str(path))) == start_values(component, declared)


def shown(value: Any) -> Any:
    if isinstance(value, list):
        return [shown(entry) for entry in value]
    return value.hex() if isinstance(value, bytes) else value


def in_summary(scenario: cosim.Scenario) -> Any:
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None, outcome.failure
    return outcome.result.summary["components"][0]["parameters"]

"""Law: a number that is written as in a spreadsheet is refused in one line that names the place and what to write, for
every option and for every key of a scenario that is a number.
"""

from __future__ import annotations

import argparse
import re
import tomllib
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from fmpy.model_description import ModelVariable
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from cosim.cli import PROGRAM as COSIM
from cosim.components.start_values import _typed
from cosim.errors import ScenarioError
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable, IterationTable, MasterTable, ReportTable
from cosim.scenario.schema import ScenarioTable, parse_part
from fmus.cli import PROGRAM as FMUS
from fmus.cli.commands import find_commands
from plant_models.meant_number import meant_number

PROGRAMS = {program.name: program for program in (COSIM, FMUS)}
WRITTEN = {"0,01": "0.01", "1.000,5": "1000.5", "1e-2 s": "0.01", "10 %": "10"}
"""What is typed, and what is to be read in the answer."""


def options() -> Iterator[tuple[str, list[str], str, bool]]:
    """Program, words and flag of each option that takes a number, and whether that is a whole one."""
    for name, program in PROGRAMS.items():
        for command in find_commands(program.package):
            yield from ((name, *found) for found in below(program.parser([command.name]), []))


def below(parser: argparse.ArgumentParser, words: list[str]) -> Iterator[tuple[list[str], str, bool]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, inner in action.choices.items():
                yield from below(inner, [*words, word])
        elif action.option_strings and callable(action.type) and isinstance(read(action.type, "1"), int | float):
            yield words, action.option_strings[-1], read(action.type, "0.5") is None


def read(kind: Any, text: str) -> Any:
    try:
        return kind(text)
    except (ValueError, argparse.ArgumentTypeError):
        return None


@pytest.mark.parametrize(("program", "words", "flag", "whole"), list(options()), ids=str)
def test_an_option(program: str, words: list[str], flag: str, whole: bool, capsys: pytest.CaptureFixture[str]) -> None:
    for typed, meant in WRITTEN.items():
        with pytest.raises(SystemExit) as ended:
            PROGRAMS[program].run([*words, flag, typed])
        shown = capsys.readouterr().err
        assert (ended.value.code, shown.count("\n")) == (2, 1)
        assert f"{flag}" in shown
        assert f"expected a {'whole ' * whole}number" in shown
        assert meant in shown.replace(typed, "") or meant == "10"
        assert typed in shown


ABOVE_ZERO = ("--step", "--call-timeout", "--gap", "--period", "--error", "--workers", "--every", "--delay")
"""Steps, spacings, limits and counts; the last two may be 0."""


@pytest.mark.parametrize(
    ("words", "flag"),
    [(words, flag) for name, words, flag, _ in options() if name == "cosim" and flag in ABOVE_ZERO],
    ids=str,
)
def test_an_option_that_cannot_be_negative(words: list[str], flag: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Nor no number at all: said before anything is done, in one line."""
    for typed in ("-1", "nan", "inf", *(["0"] if flag in ABOVE_ZERO[:-2] else [])):
        with pytest.raises(SystemExit) as ended:
            COSIM.run([*words, f"{flag}={typed}"])
        shown = capsys.readouterr().err
        assert (ended.value.code, shown.count("\n")) == (2, 1)
        assert f"argument {flag}: " in shown
        assert f"(got {typed})" in shown or f"(got '{typed}')" in shown


def keys() -> Iterator[tuple[tuple[str, ...], str]]:
    """Each key of a scenario that is a number: the path of its table, and its name."""
    tables: dict[tuple[str, ...], type[BaseModel]] = {
        (): ScenarioTable,
        ("components", "train"): ComponentTable,
        ("balises",): BalisesTable,
        ("network",): NetworkTable,
        ("master",): MasterTable,
        ("master", "iteration"): IterationTable,
        ("report",): ReportTable,
    }
    for path, table in tables.items():
        for name, field in table.model_fields.items():
            if set(flat(field.annotation)) & {int, float} and bool not in flat(field.annotation):
                yield path, name


def flat(kind: Any) -> list[Any]:
    """The types that an annotation joins."""
    return [kind, *(found for part in get_args(kind) for found in flat(part))] if "[" not in str(kind) else union(kind)


def union(kind: Any) -> list[Any]:
    return [found for part in get_args(kind) for found in flat(part)] if not re.search("list|dict", str(kind)) else []


@pytest.mark.parametrize(("path", "key"), list(keys()), ids=str)
def test_a_key_of_a_scenario(path: tuple[str, ...], key: str) -> None:
    for typed, meant in WRITTEN.items():
        tables: dict[str, Any] = {key: typed}
        for name in reversed(path):
            tables = {name: tables}
        with pytest.raises(ScenarioError) as refused:
            parse_part(tables, "own.toml", at=(*path, key))
        text = str(refused.value)
        assert "\n" not in text
        assert ".".join([*path, key]) in text
        assert "number" in text
        assert meant in text.replace(typed, "") or meant == "10"


LINES = {
    "sweep freight_profile_d --vary takagi_sugeno_cdo.mass=.05,.1": "mass: expected a number; write 0.05 (got '.05')",
    "run freight_profile_d --set seed=1,5": "; with its comma it means 1.5",
    "run freight_profile_d --set stop=1.000,5": "stop: expected a number; write 1000.5, with a point",
    "sweep freight_profile_d --vary step=0,01": "--vary: 0,01: a comma stands between values; write 0.01 with a point.",
    "sweep freight_profile_d --vary step=0,1..0,2": "expected a range of two numbers, such as 70e3..90e3, with points",
    "tune freight_profile_d --parameters a.b=0,5:2": "--parameters a.b: expected a number; write a point",
    "tune freight_profile_d --parameters a.b=1:2 --option population=2,0": "population: expected a number; write",
    "calibrate own_fmu own.csv --drive a=80,5": "--drive a: expected a number; write a point",
    "linearise locomotive --set mass=80,5": "--set mass: expected a number; write a point in place of the comma: 80.5",
    "compare a b --set-tolerance speed=0,5": "--set-tolerance speed: expected a number; write a point",
    "certify takagi_sugeno_cdo --set innovation_decay=0,5": "--set innovation_decay: expected a number; write a point",
}


@pytest.mark.parametrize("line", LINES)
def test_a_value_beside_a_name(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert COSIM.run(line.split()) == 2
    shown = capsys.readouterr()
    assert (shown.out, shown.err.count("\n")) == ("", 1)
    assert LINES[line] in shown.err


@given(
    st.sampled_from(["", "-", "+"]),
    st.sampled_from([("", "05"), ("7", ""), ("", "5"), ("120", "")]),
    st.sampled_from([".", ","]),
    st.sampled_from(["", "e3", "E-2"]),
)
def test_a_number_without_a_digit_on_one_side_of_its_mark(
    sign: str, parts: tuple[str, str], mark: str, power: str
) -> None:
    """What to write is one number of TOML, and the one that was meant; no mark alone is a number."""
    answer = meant_number(sign + mark.join(parts) + power)
    assert answer.startswith("; write ")
    meant = tomllib.loads(f"x = {answer.removeprefix('; write ')}")["x"]
    assert meant == float(sign + ".".join(parts) + power)
    assert meant_number(sign + mark + power) == ""


def test_a_whole_parameter_of_a_model() -> None:
    variable = ModelVariable("cycles", valueReference=1, type="Int32", causality="parameter")
    with pytest.raises(ValueError, match="expected a whole number for a Int32; write 2 without its comma"):
        _typed(variable, "2,0")

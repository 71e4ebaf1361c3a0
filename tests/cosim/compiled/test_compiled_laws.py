"""The compiled stepper does what the Python stepper does, bit by bit."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from compiled_runs import assert_equal, both, chain, random_linear, steps_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from test_fmus.events import triggered_fmu
from test_fmus.typed import typed_fmu

from cosim import Scenario


@settings(max_examples=6)
@given(
    versions=st.lists(st.sampled_from([1, 2, 3]), min_size=2, max_size=5),
    start=st.floats(-3.0, 3.0),
    step=st.sampled_from([0.01, 0.1, 1.0 / 3.0]),
    algorithm=st.sampled_from(["gauss-seidel", "jacobi"]),
    count=st.integers(1, 700),
    offset=st.sampled_from([0.0, 0.3]),
)
def test_rings_of_linear_fmus(
    tmp_path_factory: pytest.TempPathFactory,
    versions: list[int],
    start: float,
    step: float,
    algorithm: str,
    count: int,
    offset: float,
) -> None:
    folder = tmp_path_factory.mktemp("ring")
    rng = np.random.default_rng(7)  # few different libraries: they are compiled once and kept
    fmus = [random_linear(folder, f"ring_{place}", rng, version) for place, version in enumerate(versions)]
    scenario = chain(folder, fmus, start=start, stop=start + count * step, step=step, master={"algorithm": algorithm})
    scenario.add("watcher", fmu=str(fmus[0]))
    scenario._data["connections"] = [
        *scenario._data["connections"],
        {"from": "c1.y1", "to": "watcher.u1", "factor": 0.7, "offset": offset},
    ]
    python, compiled = both(scenario)
    assert python.failure is None
    assert steps_compiled(compiled) == count
    assert_equal(python, compiled)


NUMBERS = {
    2: ("float64", "int32", "boolean", "enumeration"),
    3: ("float64", "float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "boolean"),
}
WITH_VECTOR = ("vector[1]", "vector[2]", "vector[3]")


@pytest.mark.parametrize("version", [2, 3])
def test_every_numeric_type(tmp_path: Path, version: Literal[2, 3]) -> None:
    """FMUs whose outputs are their inputs with a twist, in a row."""
    scenario = Scenario(folder=tmp_path, stop=3.0, step=0.01)
    kinds = [*NUMBERS[version], *(WITH_VECTOR if version == 3 else ())]
    starts = {
        f"u_{kind}": 2.0 if kind == "enumeration" else float(kind == "boolean") or 100.0 for kind in NUMBERS[version]
    }
    for name, values in (("a", starts), ("b", {}), ("c", {})):
        scenario.add(name, fmu=str(typed_fmu(tmp_path, version=version)), parameters=values)
    scenario.connect(*(f"{x}.y_{k} -> {y}.u_{k}" for x, y in ("ab", "bc") for k in kinds))
    python, compiled = both(scenario)
    assert python.failure is None
    assert steps_compiled(compiled) == 300
    assert python.result.table["c.y_int32"][-1] == 101  # the last bit flipped three times
    assert_equal(python, compiled)


def counted(folder: Path, factor: float) -> Scenario:
    """A count of the crossings of a ramp, multiplied, into a whole number of 32 bits."""
    scenario = Scenario(folder=folder, stop=3.0, step=0.01)
    scenario.add("ramp", fmu=str(triggered_fmu(folder, event_mode=False)))
    scenario.add("typed", fmu=str(typed_fmu(folder, version=2)))
    scenario._data["connections"] = [{"from": "ramp.count", "to": "typed.u_int32", "factor": factor}]
    return scenario


def test_a_value_that_does_not_fit_its_type(tmp_path: Path) -> None:
    python, compiled = both(counted(tmp_path, 1e9))
    assert python.failure is not None
    assert "typed" in python.failure
    assert steps_compiled(compiled) > 1
    assert_equal(python, compiled)


def test_whole_numbers_are_rounded_to_even(tmp_path: Path) -> None:
    """Half a count is 0.5, 1.5, 2.5, ...: rounded to 0, 2, 2, ..."""
    python, compiled = both(counted(tmp_path, 0.5))
    assert python.failure is None
    assert python.result.table["ramp.count"][-1] > 5
    assert_equal(python, compiled)


def test_recording_every_other_point_and_to_disk(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    fmus = [random_linear(tmp_path, f"part_{i}", rng, v) for i, v in enumerate((2, 3))]
    scenario = chain(tmp_path, fmus, stop=100.0, step=0.01)
    assert_equal(*both(scenario, **{"master.record_every": 7}))
    python, compiled = both(scenario, **{"master.record_memory": 0.01})
    assert_equal(python, compiled)
    assert len(compiled.result.table) == 10001

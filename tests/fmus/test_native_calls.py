"""Prepared calls of native FMUs do what fmpy's own calls do: the same values, failures, log of calls and replaced
functions.
"""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import extract
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from lying_fmus import build

from fmus import build_fmu, recipe
from fmus.fmi.native_calls import JoinedCalls, prepared_call

pytestmark = pytest.mark.compiler
FORCE, POSITION, SPEED = 1, 2, 3


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("native-calls")
    return extract(str(build(folder)), str(folder / "unpacked"))


@pytest.fixture
def slave(unpacked: str) -> Iterator[Any]:
    made = FMU2Slave(guid="1", unzipDirectory=unpacked, modelIdentifier="liar", instanceName="slave")
    made.instantiate()
    made.setupExperiment()
    made.enterInitializationMode()
    made.exitInitializationMode()
    yield made
    made.freeInstance()


def references(*numbers: int) -> Any:
    return (ctypes.c_uint32 * len(numbers))(*numbers)


def pointer(values: np.ndarray) -> Any:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def test_values_and_steps_are_those_of_fmpys_calls(slave: Any) -> None:
    values, force = np.zeros(2), np.zeros(1)
    start, length = ctypes.c_double(), ctypes.c_double(0.1)
    push = prepared_call(slave, "fmi2SetReal", slave.component, references(FORCE), 1, pointer(force))
    step = prepared_call(slave, "fmi2DoStep", slave.component, start, length, ctypes.c_int(0))
    read = prepared_call(slave, "fmi2GetReal", slave.component, references(POSITION, SPEED), 2, pointer(values))
    gc.collect()  # what the calls point to lives as long as they do
    before = slave.getFMUstate()
    seen = []
    for k in range(5):
        force[0], start.value = k, 0.1 * k
        push(), step(), read()
        seen.append(values.tolist())
    slave.setFMUstate(before)
    for k in range(5):
        slave.setReal([FORCE], [float(k)])
        slave.doStep(0.1 * k, 0.1, False)
        assert slave.getReal([POSITION, SPEED]) == seen[k]
    assert seen[4][1] > seen[0][1]
    slave.freeFMUstate(before)


def test_results_by_reference_arrive(tmp_path: Path) -> None:
    fmu = build_fmu(recipe("odometer"), tmp_path / "odometer.fmu", 3)
    folder = extract(str(fmu), str(tmp_path / "unpacked"))
    from fmpy import read_model_description

    description = read_model_description(str(fmu), validate=False)
    slave = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier="odometer", instanceName="o")
    slave.instantiate()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    flags, reached = [ctypes.c_bool(True) for _ in range(3)], ctypes.c_double()
    results = [ctypes.byref(x) for x in (*flags, reached)]
    prepared_call(
        slave,
        "fmi3DoStep",
        slave.component,
        ctypes.c_double(0.0),
        ctypes.c_double(0.25),
        ctypes.c_bool(False),
        *results,
    )()
    slave.terminate()
    slave.freeInstance()
    assert reached.value == 0.25
    assert [flag.value for flag in flags] == [False, False, False]


def test_a_failure_is_fmpys_exception(slave: Any) -> None:
    step = prepared_call(
        slave, "fmi2DoStep", slave.component, ctypes.c_double(0.0), ctypes.c_double(0.1), ctypes.c_int(0)
    )
    step()
    with pytest.raises(FMICallException) as ours:
        step()  # from a time that is over
    with pytest.raises(FMICallException) as theirs:
        slave.doStep(0.0, 0.1, False)
    assert (ours.value.function, ours.value.status, str(ours.value)) == (
        theirs.value.function,
        theirs.value.status,
        str(theirs.value),
    )


def test_a_logger_of_calls_sees_them_also_when_it_comes_later(slave: Any) -> None:
    start, length = ctypes.c_double(), ctypes.c_double(0.25)
    step = prepared_call(slave, "fmi2DoStep", slave.component, start, length, ctypes.c_int(0))
    lines: list[str] = []
    slave.fmiCallLogger = lines.append
    step()
    slave.doStep(0.25, 0.25, False)
    slave.fmiCallLogger, start.value = None, 0.5
    step()
    assert len(lines) == 2
    assert lines[0].replace("Point=0.0", "Point=0.25").replace("Point=0)", "Point=False)") == lines[1]
    assert "fmi2DoStep" in lines[0]


def test_who_responds_in_place_of_the_library_is_asked(slave: Any) -> None:
    values, real = np.zeros(1), slave._functions["fmi2GetReal"]
    call = prepared_call(slave, "fmi2GetReal", slave.component, references(SPEED), 1, pointer(values))

    def other(*_arguments: Any) -> int:
        values[0] = 42.0
        return 0

    other.restype = ctypes.c_int  # type: ignore[attr-defined]
    slave._functions["fmi2GetReal"] = other
    call()
    assert values[0] == 42.0
    slave._functions["fmi2GetReal"] = real
    call()
    assert values[0] == 1.0


def test_JoinedCalls_do_what_each_does(slave: Any) -> None:
    values, force, seen = np.zeros(2), np.array([3.0]), list[float]()
    start, length = ctypes.c_double(), ctypes.c_double(0.1)
    push = prepared_call(slave, "fmi2SetReal", slave.component, references(FORCE), 1, pointer(force))
    step = prepared_call(slave, "fmi2DoStep", slave.component, start, length, ctypes.c_int(0))
    read = prepared_call(slave, "fmi2GetReal", slave.component, references(POSITION, SPEED), 2, pointer(values))
    both = JoinedCalls(slave, [push, step, lambda: seen.append(start.value), read])
    before = slave.getFMUstate()
    both()
    slave.setFMUstate(before)
    slave.setReal([FORCE], [3.0])
    slave.doStep(0.0, 0.1, False)
    assert slave.getReal([POSITION, SPEED]) == values.tolist()
    assert seen == [0.0]
    with pytest.raises(FMICallException, match="fmi2DoStep failed with status 3"):
        both()  # from a time that is over
    assert seen == [0.0]  # what follows a failure is not called
    slave.freeFMUstate(before)


def test_JoinedCalls_respect_who_hangs_himself_in(slave: Any) -> None:
    values, lines, real = np.zeros(1), list[str](), slave._functions["fmi2GetReal"]
    read = prepared_call(slave, "fmi2GetReal", slave.component, references(SPEED), 1, pointer(values))
    both = JoinedCalls(slave, [read, read])

    def other(*_arguments: Any) -> int:
        values[0] += 21.0
        return 0

    other.restype = ctypes.c_int  # type: ignore[attr-defined]
    slave._functions["fmi2GetReal"] = other
    both()
    assert values[0] == 42.0
    slave._functions["fmi2GetReal"], slave.fmiCallLogger = real, lines.append
    both()
    assert values[0] == 1.0
    assert len(lines) == 2

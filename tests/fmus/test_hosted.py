"""Python-hosted FMUs do what the block does, bit for bit, and keep and restore all of their state."""

from __future__ import annotations

import ctypes
import json
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import hosted_runs
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Terminated
from fmpy.validation import validate_fmu
from hosted_models import Gatekeeper, Lister
from hosted_runs import H, Loaded, drive, initialize

from fmu_observer.block import make_block
from fmus.hosted import build_hosted_fmu

pytestmark = pytest.mark.compiler

MODELS = Path(__file__).with_name("hosted_models.py")
STEPS = 20


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_hosted_fmu(f"{MODELS}:Gatekeeper", tmp_path_factory.mktemp("hosted"))


@pytest.fixture
def loaded(fmu: Path, tmp_path: Path) -> Iterator[Loaded]:
    opened = Loaded(fmu, tmp_path / "unpacked")
    yield opened
    opened.close()


def block() -> Any:
    made = make_block(Gatekeeper(), 2, instance_name="one")
    made.instantiate()
    return made


def child(fmu: Path, folder: Path, first: int, last: int, *state: str) -> list[float]:
    """`drive` in a process of its own."""
    command = [sys.executable, hosted_runs.__file__, str(fmu), str(folder), str(first), str(last), *state]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return [float.fromhex(text) for text in json.loads(done.stdout.splitlines()[-1])]


def test_the_fmu_is_valid(fmu: Path) -> None:
    assert validate_fmu(str(fmu)) == []


def test_a_fresh_process_gets_the_block_s_values_bit_for_bit(fmu: Path, tmp_path: Path) -> None:
    reference = initialize(block())
    assert child(fmu, tmp_path, 0, STEPS) == drive(reference, 0, STEPS)
    counters = reference.counters
    assert (counters.accepted, counters.replayed, counters.rejected) == (5, 1, 0)  # the run is worth comparing


def test_fmpy_simulates_it(fmu: Path) -> None:
    result = simulate_fmu(str(fmu), stop_time=0.5, output_interval=0.1, start_values={"speed": 0.05, "place": 3.0})
    np.testing.assert_array_equal(result["doubled"], 6.0)  # so slow that the loop never runs: the train stands


def test_restored_state_continues_exactly(loaded: Loaded) -> None:
    slave = initialize(loaded.make())
    drive(slave, 0, 8)  # one event waits for 0.62 s, and 0.31 s is still to be replayed
    saved = slave.getFMUstate()
    first = drive(slave, 8, STEPS)
    slave.setFMUstate(saved)
    assert drive(slave, 8, STEPS) == first
    slave.freeFMUstate(saved)
    assert first == drive(_driven_block(8), 8, STEPS)


def test_state_moves_to_another_instance_another_process_and_the_block(
    loaded: Loaded, fmu: Path, tmp_path: Path
) -> None:
    slave, other = initialize(loaded.make()), initialize(loaded.make(), limit=0.5)
    drive(slave, 0, 8)
    content = slave.serializeFMUstate(slave.getFMUstate())
    assert content == _driven_block(8).serializeFMUstate(_driven_block(8).getFMUstate())
    (tmp_path / "state").write_bytes(content)
    expected = drive(slave, 8, STEPS)
    other.setFMUstate(other.deSerializeFMUstate(content))
    assert drive(other, 8, STEPS) == expected
    assert child(fmu, tmp_path / "child", 8, STEPS, str(tmp_path / "state")) == expected
    python = block()
    python.setFMUstate(python.deSerializeFMUstate(content))
    assert drive(python, 8, STEPS) == expected


def _driven_block(steps: int) -> Any:
    made = initialize(block())
    drive(made, 0, steps)
    return made


def test_registered_variables_alone_would_not_be_the_state(loaded: Loaded) -> None:
    """What pythonfmu saves by itself: the values of the variables. The waiting event and the past are lost with it."""
    slave, naive = initialize(loaded.make()), initialize(loaded.make())
    drive(slave, 0, 8)
    settable = [
        v.valueReference for v in loaded.description.modelVariables if v.name in ("place", "passed", "sample", "last")
    ]
    naive.reset()
    naive.setReal(settable, slave.getReal(settable))
    initialize(naive)
    with pytest.raises(FMICallException):  # it does not even know what time it is
        drive(naive, 8, STEPS)


def test_reset_begins_anew(loaded: Loaded) -> None:
    slave = initialize(loaded.make(), limit=0.5)
    drive(slave, 0, 12)
    slave.reset()
    assert drive(initialize(slave), 0, STEPS) == drive(initialize(block()), 0, STEPS)


def test_two_instances_do_not_disturb_each_other(loaded: Loaded) -> None:
    one, two = initialize(loaded.make()), initialize(loaded.make(), limit=0.5)
    mixed: tuple[list[float], list[float]] = ([], [])
    for k in range(STEPS):
        mixed[0].extend(drive(one, k, k + 1))
        mixed[1].extend(drive(two, k, k + 1))
    assert mixed[0] == drive(initialize(block()), 0, STEPS)
    assert mixed[1] == drive(initialize(block(), limit=0.5), 0, STEPS)
    assert mixed[0] != mixed[1]


def test_many_lives_in_one_process(loaded: Loaded) -> None:
    for _ in range(200):  # pythonfmu alone loses a reference to the module at each
        slave = loaded.make()
        slave.reset()
        slave.freeInstance()
        slave.component = None
        loaded._made.clear()
    slave = initialize(loaded.make())
    assert drive(slave, 0, 5) == drive(initialize(block()), 0, 5)


# -- failures
# -----------------------------------------------------------------------------------------------------------


def test_an_error_in_the_model_is_fmi2_error_with_function_line_and_time(loaded: Loaded) -> None:
    slave = initialize(loaded.make())
    drive(slave, 0, 3)
    saved = slave.getFMUstate()
    slave.setReal([hosted_runs.references(loaded.description)["speed"]], [-1.0])
    with pytest.raises(FMICallException, match=r"status 3 \(error\)"):
        slave.doStep(3 * H, H)
    line = MODELS.read_text().splitlines().index("            mean(())  # FAILS HERE, and deeper inside a library") + 1
    ((status, text),) = loaded.log
    assert status == 3
    assert "doStep: one at t = 0.15" in text
    assert "StatisticsError: mean requires at least one data point" in text
    assert f"(in flow, line {line} of hosted_models.py)" in text
    slave.setFMUstate(saved)  # the instance is still sound
    assert drive(slave, 3, 8) == drive(_driven_block(3), 3, 8)


def test_a_step_that_comes_to_no_number_is_discarded_and_undone(loaded: Loaded) -> None:
    slave = initialize(loaded.make())
    drive(slave, 0, 3)
    refs = hosted_runs.references(loaded.description)
    saved, terminated = slave.getFMUstate(), fmi2Terminated
    slave.setReal([refs["balise_position"]], [math.nan])
    slave.setInteger([refs["balise_count"]], [7])
    with pytest.raises(FMICallException, match=r"status 2 \(discard\)"):
        slave.doStep(3 * H, H)
    assert "finite" in loaded.log[-1][1]
    assert slave.getBooleanStatus(terminated)
    slave.setFMUstate(saved)
    assert not slave.getBooleanStatus(terminated)
    assert drive(slave, 3, 8) == drive(_driven_block(3), 3, 8)


def too_little_room(slave: Any) -> None:
    slave.fmi2SerializeFMUstate(slave.component, slave.getFMUstate(), ctypes.create_string_buffer(3), 3)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.getReal([999]), "there is no variable with value reference 999"),
        (lambda s: s.setReal([1], [1.0]), "time"),
        (lambda s: s.setString([1], ["x"]), "fmi2SetString"),
        (lambda s: s.doStep(5.0, H), "currentCommunicationPoint = 5.0"),
        (lambda s: s.doStep(0.0, -H), "communicationStepSize"),
        (lambda s: s.deSerializeFMUstate(b"no state"), "not the serialised state"),
        (lambda s: s.enterInitializationMode(), "not allowed in mode 'step'"),
        (lambda s: s.setFMUstate(None), "there is no FMU state"),
        (too_little_room, "there is room for 3"),
        (lambda s: s.fmi2GetDirectionalDerivative(s.component, None, 0, None, 0, None, None), "not supported"),
    ],
)
def test_refused_calls_are_fmi2_error_with_a_reason(loaded: Loaded, call: Any, words: str) -> None:
    slave = initialize(loaded.make())
    with pytest.raises(FMICallException, match=r"status 3 \(error\)"):
        call(slave)
    assert len(loaded.log) == 1
    assert words in loaded.log[0][1]
    assert drive(slave, 0, 3) == drive(initialize(block()), 0, 3)


def test_another_guid_is_refused(loaded: Loaded) -> None:
    loaded.description.guid = "{another}"
    with pytest.raises(Exception, match="instantiate"):
        loaded.make()
    assert "GUID" in loaded.log[0][1]


# -- hand-written objects
# -------------------------------------------------------------------------------------------------


def test_an_object_with_the_calls_of_a_block(tmp_path: Path) -> None:
    loaded = Loaded(build_hosted_fmu(Lister, tmp_path), tmp_path / "unpacked")
    assert validate_fmu(str(tmp_path / "lister.fmu")) == []
    slave = loaded.make()
    slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.setReal([0], [2.0])
    slave.doStep(0.0, 0.5)
    saved = slave.getFMUstate()
    slave.doStep(0.5, 0.5)
    assert slave.getReal([1]) == [2.0]
    slave.setFMUstate(slave.deSerializeFMUstate(slave.serializeFMUstate(saved)))
    assert slave.getReal([0, 1]) == [2.0, 1.0]
    with pytest.raises(FMICallException):
        slave.setInteger([0], [1])
    assert "fmi2SetInteger: AttributeError: 'Lister' object has no attribute 'setInteger'" in loaded.log[0][1]
    loaded.close()


def test_the_description_begins_with_what_it_needs(fmu: Path) -> None:
    with ZipFile(fmu) as archive:
        xml, page = archive.read("modelDescription.xml").decode(), archive.read("documentation/index.html").decode()
    assert 'description="NEEDS PYTHON: this FMU runs Python code and needs Python 3.11 or later with the package' in xml
    assert 'needsExecutionTool="true"' in xml
    assert all(
        words in page
        for words in ("FMU_OBSERVER_LIBPYTHON", "Not for real-time targets", "balise_count", "hosted_models.py")
    )

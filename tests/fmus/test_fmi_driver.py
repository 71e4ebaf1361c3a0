"""One FMI driver: ``fmus check`` and the components of the master step FMUs by the same code, with the same numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import fmpy
import numpy as np
import pytest
from test_fmus.build import linear_fmu
from test_fmus.events import periodic_fmu, periodic_ticks, timed_fmu

from cosim.components.component import Component
from cosim.components.described import DescribedComponent
from cosim.components.fmi3 import FMI3Component
from cosim.components.loading import FMI1Component, FMI2Component, load_fmu
from fmus.check.checked_instance import FmuInstance, FmuSlave2, FmuSlave3, make_slave
from fmus.check.exchange_model import FmuModel, FmuModel2, FmuModel3
from fmus.fmi.description import read_description
from fmus.fmi.library import MissingFunctionError, _Missing
from fmus.fmi.native_calls import prepared_call

CHECKED = (FmuInstance, FmuSlave2, FmuSlave3, FmuModel, FmuModel2, FmuModel3)
STEPPED = (DescribedComponent, Component, FMI1Component, FMI2Component, FMI3Component)
OWN_WORDS = {"failure", "note"}
"""How an error reads and where messages go is for each side to say."""


def own_methods(classes: tuple[type, ...]) -> set[str]:
    found = {name for cls in classes for name, value in vars(cls).items() if callable(value)}
    counted = {name for name in found if hasattr(getattr(FMI3Component, name, None), "counted_as")}
    return {name for name in found - counted if not name.startswith("__")}


def test_nothing_of_fmi_is_written_twice() -> None:
    assert own_methods(CHECKED) & own_methods(STEPPED) == OWN_WORDS
    for ours, theirs in ((FmuSlave2, FMI2Component), (FmuSlave3, FMI3Component)):
        for name in ("enter_initialization", "exit_initialization", "advance", "settle", "terminate", "_remember"):
            assert getattr(ours, name) is getattr(theirs, name), name


def lag(folder: Path, version: Any) -> Path:
    return linear_fmu(folder, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=version, x0=[1.0])


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("build", "outputs"),
    [
        (lambda folder: lag(folder, 2), ["y1"]),
        (lambda folder: lag(folder, 3), ["y1"]),
        (periodic_fmu, ["count", "when", "sample"]),
        (timed_fmu, ["level", "jumps"]),
    ],
    ids=["lag-2", "lag-3", "periodic", "timed"],
)
def test_both_step_to_equal_numbers(build: Callable[[Path], Path], outputs: list[str], tmp_path: Path) -> None:
    fmu = build(tmp_path)
    folder = Path(fmpy.extract(str(fmu), str(tmp_path / "unpacked")))
    rows = []
    for made in (make_slave(folder, read_description(folder)), load_fmu(fmu, "one")):
        made.instantiate()
        made.enter_initialization(0.0, 1.0)
        made.exit_initialization()
        values = np.zeros(len(outputs))
        read, seen = made.reader(outputs, values), []
        for k in range(40):
            made.advance(0.025 * k, 0.025 * (k + 1))
            read()
            seen.append(values.copy())
        made.terminate()
        made.free()
        rows.append(np.array(seen))
    np.testing.assert_array_equal(*rows)
    assert np.ptp(rows[0][:, 0]) > 0.0  # something moved
    if fmu.name == "periodic.fmu":
        assert rows[0][-1, 0] == len(periodic_ticks(1.0))


def test_a_function_that_the_library_lacks_fails_when_it_is_called() -> None:
    missing = _Missing("fmi3SetClock")
    slave = SimpleNamespace(_functions={"fmi3SetClock": missing}, fmi3SetClock=missing, fmiCallLogger=None)
    call = prepared_call(slave, "fmi3SetClock", None)
    with pytest.raises(MissingFunctionError, match="does not export fmi3SetClock"):
        call()

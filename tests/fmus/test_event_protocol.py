"""The event protocol chosen at the build stands in the FMU: in its description, its library and its behaviour."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmpy import read_model_description
from fmpy.fmi3 import FMU3Slave

from fmu_observer.block import make_block
from fmu_observer.description import describe
from fmu_observer.event_protocol import EventProtocol
from fmus.build import build_fmu
from fmus.cli import main
from fmus.recipes import recipe


@pytest.mark.compiler
def test_counts_in_fmi_3_announce_events_as_in_fmi_2(component: Any, tmp_path: Path) -> None:
    observer = recipe("takagi_sugeno_cdo")
    counting = component(build_fmu(observer, tmp_path, 3, protocol=EventProtocol("counts")), 3)
    usual = component("takagi_sugeno_cdo", 2)
    rows = []
    for one in (counting, usual):
        assert not one.event_mode
        one.initialize()
        for k in range(10):
            one.set(effort=2e4, odometer=5.0)
            if k in (3, 7):
                reference, slave = one.references(["balise_count"]), one.slave
                get, put = (
                    (slave.getInteger, slave.setInteger) if one.version == 2 else (slave.getInt32, slave.setInt32)
                )
                one.set(balise_position=k * 0.3, balise_time=k * 0.01 + 0.004 - 0.02 * (k == 7))
                put(reference, [get(reference)[0] + 1])
            one.step(k * 0.01, 0.01)
        rows.append(one.get("position", "speed", "innovation").tolist())
    assert rows[0] == rows[1]
    assert rows[0][0] != 0.0


@pytest.mark.compiler
@pytest.mark.parametrize(("policy", "number"), [("replay", 1), ("reject", 2), ("late", 3)])
def test_the_command_line_sets_the_policy(policy: str, number: int, tmp_path: Path, component: Any) -> None:
    assert main(["build", "takagi_sugeno_cdo", "--late-policy", policy, "-o", str(tmp_path)]) == 0
    fmu = tmp_path / "takagi_sugeno_cdo.fmu"
    variables = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    assert variables["late_policy"].start == str(number)
    made = component(fmu, 3)
    assert made.slave.getInt64([variables["late_policy"].valueReference]) == [number]


def test_clocks_in_fmi_2_are_refused_before_anything_is_built(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", "takagi_sugeno_cdo", "--fmi", "both", "--events", "clocks", "-o", str(tmp_path / "out")]) == 2
    assert "FMI 2 has no clocks" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.compiler
def test_event_mode_has_nothing_to_do_where_events_are_counted(
    tmp_path: Path, unpacked: Callable[[Path], Path]
) -> None:
    """An importer that uses event mode everywhere is not turned away, by the FMU or the block."""
    observer, protocol = recipe("takagi_sugeno_cdo"), EventProtocol("counts")
    description = describe(observer, 3, protocol=protocol)
    folder = unpacked(build_fmu(observer, tmp_path, 3, protocol=protocol))
    native = FMU3Slave(
        guid=description.guid, unzipDirectory=str(folder), modelIdentifier=observer.name, instanceName="native"
    )
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    rows = []
    for slave in (native, make_block(observer, 3, announcement="counts")):
        slave.instantiate(eventModeUsed=True)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        changed = slave.updateDiscreteStates()
        slave.enterStepMode()
        slave.doStep(0.0, 0.01)
        rows.append((list(changed), slave.getFloat64(outputs)))
    native.freeInstance()
    assert rows[0] == rows[1]

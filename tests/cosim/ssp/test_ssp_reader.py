"""Exported systems tell their observers of balises in any tool, and read back they are told by the master again,
once.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from small_scenarios import small

from cosim import Scenario
from cosim.run.outcome import Outcome
from cosim.ssp.document import NAMESPACES

pytestmark = pytest.mark.compiler
REPORTED = {("balise_reader.balise_" + field, "observer.balise_" + field) for field in ("count", "time", "position")}


def run(scenario: Scenario) -> Outcome:
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None
    return outcome


def without_annotations(path: Path) -> Path:
    """The package as a tool that knows nothing of ours would write it again."""
    bare = path.with_name(f"bare_{path.name}")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(bare, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.endswith(".ssd"):
                root = etree.fromstring(content)
                for node in list(root.iter(f"{{{NAMESPACES['ssd']}}}Annotations")):
                    node.getparent().remove(node)
                content = etree.tostring(root)
            new.writestr(name, content)
    return bare


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_the_system_finds_its_balises_without_our_master(version: str, tmp_path: Path) -> None:
    scenario = small().master(algorithm="jacobi")
    path = scenario.export_ssp(tmp_path / "small.ssp", version)
    bare = Scenario.load(without_annotations(path)).set("step", 0.01).master(algorithm="jacobi")
    table = bare.table()
    assert table.balises is None
    assert {
        tuple(re.split(" -> ", line)) for line in table.connections if "balise_reader.balise" in str(line)
    } == REPORTED
    first, second = run(scenario), run(bare)
    assert len(first.result.events) == 3
    assert second["balise_reader.balise_count"][-1] == 3.0
    assert second["balise_reader.lost_count"][-1] == 0.0
    # Told a step or two late, and exact from there on: at the end, half a second after the last one.
    for name in ("position", "speed"):
        assert first[f"locomotive.{name}"][-1] == pytest.approx(second[f"locomotive.{name}"][-1], abs=1e-11)
        assert first[f"observer.{name}"][-1] == pytest.approx(second[f"observer.{name}"][-1], abs=1e-7)


def test_read_back_every_balise_is_delivered_once(tmp_path: Path) -> None:
    scenario = small()
    again = Scenario.load(scenario.export_ssp(tmp_path / "small.ssp", "1.0"))
    assert set(again.table().components) == set(scenario.table().components)
    first, second = run(scenario), run(again)
    assert len(second.result.events) == len(first.result.events) == 3
    assert np.array_equal(first.result.table, second.result.table)


def test_balises_by_instants_have_no_reader_and_that_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scenario = small().balises(
        position="locomotive.position",
        speed="locomotive.speed",
        layout="instants",
        instants=[0.1, 0.2],
        method="rollback",
    )
    again = Scenario.load(scenario.export_ssp(tmp_path / "small.ssp", "1.0"))
    assert "balise_reader" not in again.table().components
    assert "layout 'instants' says when balises are passed and not where" in caplog.text


def test_parameters_have_no_unit_of_their_own(tmp_path: Path) -> None:
    """OMSimulator does not read a Float64 with a unit; the standard takes that of the variable where none is
    written.
    """
    path = small().export_ssp(tmp_path / "small.ssp", "2.0")
    with zipfile.ZipFile(path) as archive:
        sets = [archive.read(name) for name in archive.namelist() if name.endswith(".ssv")]
    values = [node for text in sets for node in etree.fromstring(text).iter(f"{{{NAMESPACES['ssv']}}}Float64")]
    assert values
    assert not any("unit" in node.attrib for node in values)

"""Values of every type through an SSP and back; what SSP cannot hold is refused when it is written, not when it is
read.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from lxml import etree
from ssp_files import UNITS, connector, package, ramp_fmu, ssd, sum_fmu, wire
from test_fmus.typed import typed_fmu

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError, ScenarioError
from cosim.ssp.common import ValueMap
from cosim.ssp.document import SCHEMAS
from cosim.ssp.pipe import Pipe

PARAMETERS: dict[str, Any] = {
    "n": 2,
    "u_float64": 0.1,
    "u_int8": -128,
    "u_uint64": 2**64 - 1,
    "u_int64": -(2**63),
    "u_boolean": True,
    "u_string": "ü <&> \"x'",
    "u_binary": "00ff",
    "u_enumeration": "busy",
    "u_vector": [0.5, -1.5],
    "u_matrix": [[1.0, 2.0], [3.0, 4.0]],
    "u_pair_string": ["a b", ""],
    "u_pair_binary": ["00", "ffee"],
    "u_pair_boolean": [True, False],
    "u_pair_uint64": [2**64 - 1, 0],
}


def typed(folder: Path, **parameters: Any) -> Scenario:
    """A scenario of one FMU with all types."""
    return Scenario(stop=0.2, step=0.1).add("a", fmu=str(typed_fmu(folder)), parameters=parameters)


def flat(value: Any) -> list[Any]:
    return [leaf for entry in value for leaf in flat(entry)] if isinstance(value, list) else [value]


@pytest.mark.compiler
def test_values_of_every_type_come_back(tmp_path: Path) -> None:
    path = typed(tmp_path, **PARAMETERS).export_ssp(tmp_path / "typed.ssp")
    with zipfile.ZipFile(path) as archive:
        for name, schema in (("SystemStructure.ssd", "Description"), ("resources/a.ssv", "ParameterValues")):
            checker = etree.XMLSchema(file=str(SCHEMAS / "2.0" / f"SystemStructure{schema}.xsd"))
            checker.assertValid(etree.fromstring(archive.read(name)))
    again = Scenario.load(path)
    found = again.table().components["a"].parameters
    assert {name: flat(value) for name, value in found.items()} == {
        name: flat(value) for name, value in PARAMETERS.items()
    }
    assert again.run(warn=lambda _text: None).failure is None


@pytest.mark.compiler
def test_arrays_are_written_with_the_shapes_that_structural_parameters_give(tmp_path: Path) -> None:
    path = typed(tmp_path, n=5).export_ssp(tmp_path / "typed.ssp")
    with zipfile.ZipFile(path) as archive:
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    sizes = [d.get("size") for d in root.iterfind(".//{*}Connector[@name='u_matrix']/{*}Dimension")]
    assert sizes == ["2", "5"]


REFUSED = {
    "text for a number": ({"u_float64": "soon"}, "a.u_float64: expected a number"),
    "truth": ({"u_boolean": "yes"}, "a.u_boolean: expected true or false"),
    "item": ({"u_enumeration": 9}, "a.u_enumeration: 9 is no item"),
    "rows": ({"u_matrix": [[1.0, 2.0], [3.0]]}, "rows of equal length"),
    "shape": ({"u_matrix": [1.0, 2.0]}, r"expected 6 values for a Float64 array of shape \(2, 3\)"),
    "output": ({"y_float64": 1.0}, "a.y_float64 cannot be set: it has causality 'output'"),
    "element": ({"u_matrix[1,2]": 1.0}, r"'u_matrix\[1,2\]' is an element of an array; SSP sets whole arrays only"),
    "control character": ({"u_string": "\x01"}, "cannot be written as XML"),
}


@pytest.mark.compiler
@pytest.mark.parametrize("case", REFUSED)
def test_what_would_not_come_back_is_not_written(case: str, tmp_path: Path) -> None:
    parameters, message = REFUSED[case]
    with pytest.raises(CosimError, match=message):
        typed(tmp_path, **parameters).export_ssp(tmp_path / "typed.ssp")
    assert not (tmp_path / "typed.ssp").exists()


@pytest.mark.compiler
def test_an_enumeration_without_items_passes_as_a_number(tmp_path: Path) -> None:
    fmu = typed_fmu(tmp_path)
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    files["modelDescription.xml"] = re.sub(rb"<Item [^>]*/>", b"", files["modelDescription.xml"])
    package(tmp_path / "bare.fmu", files)
    scenario = Scenario(stop=0.2, step=0.1).add("a", fmu=str(tmp_path / "bare.fmu"), parameters={"u_enumeration": 2})
    outcome = Scenario.load(scenario.export_ssp(tmp_path / "bare.ssp")).run(warn=lambda _text: None)
    assert outcome["a.y_enumeration"][-1] == 3.0  # the FMU answers with the next item


@pytest.mark.compiler
def test_an_fmu_that_cannot_be_read_is_not_called_an_unwritable_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "junk.fmu").write_bytes(b"junk")
    (tmp_path / "s.toml").write_text('stop = 1.0\nstep = 0.1\n[components.a]\nfmu = "junk.fmu"\n')
    assert main(["export", str(tmp_path / "s.toml"), str(tmp_path / "s.ssp")]) == 2
    error = capsys.readouterr().err
    assert "junk.fmu is not a readable FMU" in error
    assert "cannot be written" not in error


def structure(folder: Path, tail: str, unit: str = "m/s") -> Path:
    """A ramp and an adder, connected; `tail` is what stands behind the system."""
    elements = "".join(
        f'<ssd:Component name="{name}" '
        f'source="resources/{name}.fmu"><ssd:Connectors>{connector(*interface)}</ssd:Connectors>'
        "</ssd:Component>"
        for name, interface in (("ramp", ("speed", "output", unit)), ("sum", ("u", "input", "m/s")))
    )
    wires = f"<ssd:Connections>{wire('ramp.speed', 'sum.u')}</ssd:Connections>"
    text = ssd(f"<ssd:Elements>{elements}</ssd:Elements>{wires}", tail=tail)
    fmus = {f"resources/{fmu.name}": fmu for fmu in (ramp_fmu(folder), sum_fmu(folder))}
    return package(folder / "x.ssp", {"SystemStructure.ssd": text, **fmus})


@pytest.mark.compiler
@pytest.mark.parametrize("stop", ["INF", "NaN"])
def test_a_run_without_end_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], stop: str) -> None:
    path = structure(tmp_path, f'{UNITS}<ssd:DefaultExperiment startTime="0" stopTime="{stop}"/>')
    assert main(["show", str(path)]) == 2
    assert "stop: expected a finite number" in capsys.readouterr().err


@pytest.mark.compiler
@pytest.mark.parametrize("factor", ["0", "INF"])
def test_a_unit_that_measures_nothing_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], factor: str
) -> None:
    path = structure(tmp_path, UNITS.replace("0.2777777777777778", factor), "km/h")
    assert main(["show", str(path)]) == 2
    error = capsys.readouterr().err
    assert re.search(r"x.ssp: SystemStructure.ssd, line \d+: units .* measures nothing", error), error


def test_names_of_items_pass_tables_of_names_and_no_others() -> None:
    node = etree.Element("Binding")
    items, numbers = ValueMap("Enumeration", {"low": "high"}), ValueMap("Integer", {"1": "2"})
    assert Pipe(maps=(items,)).item("low", node) == "high"
    assert Pipe(maps=(items,)).item("off", node) == "off"
    assert Pipe(maps=(numbers,)).number(1.0, node) == 2.0
    for pipe in (Pipe(maps=(numbers,)), Pipe(factor=2.0)):
        with pytest.raises(ScenarioError, match="'low' is a name; a transformation of numbers cannot"):
            pipe.item("low", node)
    with pytest.raises(ScenarioError, match="a table of item names can only connect enumerations"):
        Pipe(maps=(items,)).number(1.0, node)

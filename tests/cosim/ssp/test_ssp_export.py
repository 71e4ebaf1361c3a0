"""SSP export: back to the same run bit for bit, valid by the schemas, and readable for somebody else's reader and
master.
"""

from __future__ import annotations

import gc
import json
import re
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import Any

import fmpy.ssp.simulation
import fmpy.ssp.ssd
import numpy as np
import pytest
from lxml import etree
from small_scenarios import small
from ssp_files import connector, described_fmu, ramp_fmu, sum_fmu
from test_fmus.exchange import exchange_fmu

from cosim import Scenario
from cosim.cli import main
from cosim.results.results_folder import read_results
from cosim.scenario.scenario_tables import ConnectionTable

SCHEMAS = {"ssd": "Description", "ssv": "ParameterValues"}


def texts(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def assert_valid(path: Path, version: str) -> None:
    """All its XML files are valid by the schemas of the standard."""
    for name, text in texts(path).items():
        kind = name.rpartition(".")[2]
        if kind in SCHEMAS:
            file = files("cosim") / "ssp" / "schema" / version / f"SystemStructure{SCHEMAS[kind]}.xsd"
            etree.XMLSchema(file=str(file)).assertValid(etree.fromstring(text))


def pair(folder: Path, version: Any = 2) -> Scenario:
    """A ramp and an adder as FMUs."""
    scenario = Scenario(stop=1.0, step=0.125, title="pair")
    scenario.add("ramp", fmu=str(ramp_fmu(folder, version)), parameters={"x0[1]": 0.1})
    scenario.add("sum", fmu=str(sum_fmu(folder, version)), parameters={"w": 1.0 / 3.0}, record=["w"])
    return scenario.connect("ramp.speed -> sum.u")


@pytest.mark.compiler
@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize("interface", ["model-exchange", None])
def test_a_model_exchange_fmu_runs_equally_after_the_round_trip(
    tmp_path: Path, version: str, interface: str | None
) -> None:
    """Also from a package of others, which states what it asks for in the standard's words alone."""
    scenario = Scenario(stop=1.0, step=0.125, title="ball")
    keys = {} if interface is None else {"interface": interface}
    scenario.add("ball", fmu=str(exchange_fmu(tmp_path, "BALL", 2)), **keys)
    path = scenario.export_ssp(tmp_path / "ball.ssp", version)
    assert_valid(path, version)
    assert (b'implementation="ModelExchange"' in texts(path)["SystemStructure.ssd"]) == (interface is not None)
    plain = re.sub(rb"<ssd:Annotations>.*?</ssd:Annotations>", b"", texts(path)["SystemStructure.ssd"], flags=re.DOTALL)
    with zipfile.ZipFile(tmp_path / "plain.ssp", "w") as archive:
        for name, text in (texts(path) | {"SystemStructure.ssd": plain}).items():
            archive.writestr(name, text)
    expected = scenario.run().result.table
    for package in (path, tmp_path / "plain.ssp"):
        again = Scenario.load(package).set("stop", 1.0).set("step", 0.125).run().result.table
        assert np.array_equal(again, expected)


@pytest.mark.compiler
@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_a_scenario_with_balises_runs_equally_after_the_round_trip(tmp_path: Path, version: str) -> None:
    scenario = small().set("observer.late_policy", "reject").set("observer.label", "S2")
    (tmp_path / "track.csv").write_text("position,identity\n1.0,a\n2.5,b\n4.0,c\n")
    scenario.folder = tmp_path
    scenario.set("balises.layout", "csv").set("balises.file", "track.csv")
    path = scenario.export_ssp(tmp_path / "small.ssp", version)
    assert_valid(path, version)
    again = Scenario.load(path)
    assert again.table().components["observer"] == scenario.table().components["observer"]
    first, second = (s.run(warn=lambda _text: None) for s in (scenario, again))
    assert first.failure is None
    assert len(first.result.events) == 3
    assert first.result.table.dtype == second.result.table.dtype
    assert np.array_equal(first.result.table, second.result.table)
    assert first.spec == second.spec


@pytest.mark.compiler
@pytest.mark.parametrize("fmi", [1, 2, 3])
def test_fmus_by_path_run_equally_after_the_round_trip(tmp_path: Path, fmi: int) -> None:
    scenario = pair(tmp_path, fmi)
    scenario._data["connections"] = [{"from": "ramp.speed", "to": "sum.u", "factor": 0.1, "offset": 1.0 / 7.0}]
    path = scenario.export_ssp(tmp_path / "pair.ssp")
    assert_valid(path, "2.0")
    again = Scenario.load(path)
    first, second = scenario.table(), again.table()
    assert list(second.components) == ["ramp", "sum"]
    assert [c.parameters for c in second.components.values()] == [c.parameters for c in first.components.values()]
    assert second.components["sum"].record == ["w"]
    assert (second.title, second.start, second.stop, second.step) == ("pair", 0.0, 1.0, 0.125)
    (connection,) = second.connections
    assert isinstance(connection, ConnectionTable)
    assert (connection.factor, connection.offset) == (0.1, 1.0 / 7.0)
    tables = [s.run(warn=lambda _text: None).result.table for s in (scenario, again)]
    assert np.array_equal(*tables)
    assert tables[0]["sum.y"][0] == pytest.approx(2.0 * (0.1 * 0.1 + 1.0 / 7.0) + 1.0 / 3.0, rel=1e-14)
    assert texts(again.export_ssp(tmp_path / "again.ssp"))["resources/ramp.ssv"] == texts(path)["resources/ramp.ssv"]


def test_values_that_are_not_real_numbers_survive(tmp_path: Path) -> None:
    types = """<TypeDefinitions><SimpleType name="Gear"><Enumeration><Item name="none" value="0"/><Item name="low" value="10"/>
</Enumeration></SimpleType></TypeDefinitions>"""  # noqa: E501
    kinds = {"on": "<Boolean{}/>", "count": "<Integer{}/>", "gear": '<Enumeration declaredType="Gear"{}/>'}
    ends = {"send": ("output", ""), "take": ("input", ' start="0"')}
    scenario = Scenario(stop=1.0, step=0.5)
    for name, (causality, start) in ends.items():
        variables = "".join(
            f'<ScalarVariable name="{v}" valueReference="{i}" causality="{causality}" variability="discrete">'
            f"{kind.format(start)}</ScalarVariable>"
            for i, (v, kind) in enumerate(kinds.items())
        )
        scenario.add(name, fmu=str(described_fmu(tmp_path, name, variables, types)))
    for name, value in (("on", 1.0), ("count", -3.0), ("gear", "low")):
        scenario.set(f"take.{name}", value)
    not_, table = {"factor": -1.0, "offset": 1.0}, {"values": [[1.0, 7.0], [2.0, 0.0]]}
    ways = {"on": not_, "count": table, "gear": {"factor": -1.0, "offset": 10.0}}
    stated = [{"from": f"send.{v}", "to": f"take.{v}", "units": "ignore", **ways[v]} for v in kinds]
    scenario._data["connections"] = stated
    for version in ("1.0", "2.0"):
        path = scenario.export_ssp(tmp_path / "discrete.ssp", version)
        assert_valid(path, version)
        again = Scenario.load(path).table()
        assert again.connections == scenario.table().connections
        assert again.components["take"].parameters == {"on": 1.0, "count": -3.0, "gear": "low"}


@pytest.mark.compiler
def test_another_fmu_in_the_place_of_a_model_is_used(tmp_path: Path) -> None:
    scenario = Scenario(stop=0.1, step=0.05).add("odometer", model="odometer", label="wheel")
    path = scenario.export_ssp(tmp_path / "a.ssp")
    members = texts(path)
    other = ramp_fmu(tmp_path).read_bytes()
    structure = members["SystemStructure.ssd"].decode()
    start, end = structure.index("<ssd:Connectors>"), structure.index("</ssd:Connectors>")
    members["SystemStructure.ssd"] = (
        structure[:start] + "<ssd:Connectors>" + connector("speed", "output") + structure[end:]
    ).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, other if name.endswith(".fmu") else content)
    loaded = Scenario.load(path)
    table = loaded.table().components["odometer"]
    assert (table.model, table.label) == (None, "wheel")
    reported: list[str] = []
    assert loaded.run(warn=reported.append)["odometer.speed"][0] == 10.0
    assert "is not the FMU that the annotation speaks of" in reported[0]


def test_one_name_for_two_units_becomes_two(tmp_path: Path) -> None:
    definition = '<UnitDefinitions><Unit name="u"><BaseUnit m="1" factor="{}"/></Unit></UnitDefinitions>'
    variable = '<ScalarVariable name="y" valueReference="0" causality="output"><Real unit="u"/></ScalarVariable>'
    scenario = Scenario(stop=1.0, step=0.5)
    for name, factor in (("a", "1"), ("b", "0.5"), ("c", "0.5")):
        scenario.add(name, fmu=str(described_fmu(tmp_path, name, variable, definition.format(factor))))
    text = texts(scenario.export_ssp(tmp_path / "units.ssp"))["SystemStructure.ssd"].decode()
    assert text.count("<ssc:Unit ") == 2
    assert [text.count(f'Real unit="{name}"') + text.count(f'Float64 unit="{name}"') for name in ("u", "u (2)")] == [
        1,
        2,
    ]


# -- other tools ----------------------------------------------------------------------------------------------------


@pytest.mark.compiler
def test_the_reader_of_fmpy_reads_it(tmp_path: Path) -> None:
    structure = fmpy.ssp.ssd.read_ssd(str(small().export_ssp(tmp_path / "small.ssp", "1.0")))
    assert [c.name for c in fmpy.ssp.ssd.find_components(structure.system)] == [
        "locomotive",
        "odometer",
        "driver",
        "observer",
        "balise_reader",
    ]
    assert len(structure.system.connections) == 10
    assert {u.name for u in structure.units} >= {"m", "m/s", "N"}


@pytest.mark.compiler
def test_the_master_of_fmpy_runs_it(tmp_path: Path) -> None:
    scenario = Scenario(stop=1.0, step=0.125)
    scenario.add("ramp", fmu=str(ramp_fmu(tmp_path))).add("sum", fmu=str(sum_fmu(tmp_path)))
    scenario.connect("ramp.speed -> sum.u, sum.w")  # it cannot leave an input open
    path = scenario.export_ssp(tmp_path / "pair.ssp", "1.0")
    theirs = fmpy.ssp.simulation.simulate_ssp(str(path), stop_time=1.0, step_size=0.125)
    ours = Scenario.load(path).run()
    # it labels the values of t + h as t, so its row k holds our row k + 1; it exchanges nothing before the first step,
    # and its adder, without states, sees the ramp one step late: its row k is our row k from the second on
    assert np.array_equal(theirs["time"], ours["time"][:-1])
    assert np.abs(theirs["ramp.speed"] - ours["ramp.speed"][1:]).max() < 1e-13
    assert np.abs(theirs["sum.y"] - ours["sum.y"][:-1])[1:].max() < 1e-13
    assert theirs["sum.y"][0] == 0.0


# -- command line ---------------------------------------------------------------------------------------------------


def test_what_was_unpacked_stays_as_long_as_a_copy_of_the_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pair(tmp_path)
    made = Scenario(stop=0.25, step=0.125).add("ramp", fmu="ramp.fmu")
    made.export_ssp(tmp_path / "alone.ssp")
    changed = Scenario.load(tmp_path / "alone.ssp").with_settings({"ramp.x0[1]": 3.0})
    gc.collect()  # the one that was loaded is gone
    assert changed.run(progress=False).failure is None


def test_export_info_list_and_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pair(tmp_path)
    Path("pair.toml").write_text(
        'title = "A pair"\nstop = 1.0\nstep = 0.125\nconnections = ["ramp.speed -> sum.u"]\n'
        '[components.ramp]\nfmu = "ramp.fmu"\n[components.sum]\nfmu = "sum.fmu"\n'
    )
    assert main(["export", "pair.toml", "pair.ssp", "--ssp-version", "1.0", "--set", "ramp.x0[1]=3.0"]) == 0
    assert capsys.readouterr().out == "pair.ssp\n"
    assert main(["list", "pair.ssp"]) == 0
    assert "SystemStructure  A pair" in capsys.readouterr().out
    assert main(["info", "pair.ssp"]) == 0
    printed = capsys.readouterr().out
    assert "ramp (resources/ramp.fmu): outputs speed" in printed
    assert "ramp.speed -> sum.u" in printed
    assert main(["info", "pair.ssp", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["step"] == 0.125
    assert main(["run", "pair.ssp", "--out", "out", "--no-report", "--quiet"]) == 0
    assert "A pair: 1 s simulated" in capsys.readouterr().out
    result = read_results(tmp_path / "out")
    assert result.summary["scenario"] == "pair"
    assert result["ramp.speed"][0] == 3.0

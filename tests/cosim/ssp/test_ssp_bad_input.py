"""SSP files with something wrong: one clear message each, with file and line, exit code 2, no traceback."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from ssp_files import UNITS, connector, package, ramp_fmu, real, ssd, ssm, ssv, sum_fmu, wire

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError

RAMP = f"""<ssd:Component name="ramp" source="resources/ramp.fmu">
<ssd:Connectors>{connector("speed", "output", "m/s")}</ssd:Connectors></ssd:Component>"""
ADDER = f"""<ssd:Component name="sum" source="resources/sum.fmu">
<ssd:Connectors>{connector("u", "input", "m/s")}{connector("w", "input", "kg")}{connector("y", "output")}</ssd:Connectors>
</ssd:Component>"""  # noqa: E501
GOOD = ssd(
    f"<ssd:Elements>{RAMP}\n{ADDER}</ssd:Elements>\n<ssd:Connections>\n{wire('ramp.speed', 'sum.u')}</ssd:Connections>"
)


@pytest.fixture(scope="session")
def fmus_of(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {"resources/ramp.fmu": ramp_fmu(folder), "resources/sum.fmu": sum_fmu(folder)}


def refused(path: Path | str, *expected: str) -> str:
    """The one message, which holds all of `expected`."""
    with pytest.raises(CosimError) as caught:
        Scenario.load(path)
    message = str(caught.value)
    for text in expected:
        assert text in message
    assert len(message.splitlines()) == 1
    return message


def bindings(values: str, mapping: str = "") -> str:
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>{ssv(values, UNITS)}</ssd:ParameterValues>"
        f"{mapping}</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def changed(old: str, new: str, text: str = GOOD) -> str:
    assert old in text
    return text.replace(old, new)


def with_bindings(inner: str) -> str:
    """The good one with parameter bindings on its root system."""
    return GOOD.replace("<ssd:Elements>", inner + "<ssd:Elements>", 1)


def with_parameter(values: str, mapping: str = "") -> str:
    return with_bindings(bindings(values, mapping))


ENTRY = '<ssm:MappingEntry source="a" target="sum.uu"/>'
MAPPED = f"<ssd:ParameterMapping>{ssm(ENTRY)}</ssd:ParameterMapping>"
EXTERNAL = '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/a.ssv"/></ssd:ParameterBindings>'
OURS = '<ssd:Annotations><ssc:Annotation type="fmu-observer.scenario"><x/></ssc:Annotation></ssd:Annotations>'
ROOT_END = "</ssd:SystemStructureDescription>"
TWICE = wire("sum.y", "sum.u") + "</ssd:Connections>"
UNSOURCED = changed('version="1.0"', 'version="2.0"', changed(' source="resources/ramp.fmu"', ""))

WRONG = {
    "broken XML": (changed("</ssd:Elements>", ""), "SystemStructure.ssd, line 10: not readable as XML"),
    "unknown element": (changed("ssd:Connections>", "ssd:Wires>"), "Element 'Wires': This element is not expected"),
    "unknown attribute": (changed("startElement", "from"), "line 9: Element 'Connection', attribute 'from'"),
    "missing attribute": (changed(' startConnector="speed"', ""), "'startConnector' is required but missing"),
    "wrong namespace": (
        changed("SSP1/SystemStructureDescription", "SSP9/Other"),
        "line 1: element 'SystemStructureDescription'",
    ),
    "wrong root": (ssm(""), "element 'ParameterMapping'", "expected 'SystemStructureDescription'"),
    "unknown version": (
        changed('version="1.0"', 'version="3.0"'),
        "line 1: version '3.0' of SSP is not known; 1.0 and 2.0",
    ),
    "document type": ("<!DOCTYPE a [<!ENTITY b 'c'>]>" + GOOD, "document type declaration"),
    "undefined unit where numbers go": (
        changed('name="u" kind="input"><ssc:Real unit="m/s"', 'name="u" kind="input"><ssc:Real unit="kn"'),
        "nothing defines the unit 'kn', so numbers cannot be brought from 'm/s' to 'kn'",
    ),
    "unit defined twice": (changed('Unit name="kg"', 'Unit name="km/h"'), "unit 'km/h' is defined twice"),
    "missing FMU": (
        changed("ramp.fmu", "rmap.fmu"),
        "line 3: source 'resources/rmap.fmu'",
        "did you mean 'resources/ramp.fmu'",
    ),
    "source outside": (changed("resources/ramp", "../ramp"), "source '../ramp.fmu' leads out of the package"),
    "source by URL": (changed("resources/ramp", "https://example.org/ramp"), "only files within the package"),
    "source is no FMU": (
        changed("resources/ramp.fmu", "SystemStructure.ssd"),
        "line 3: ramp: SystemStructure.ssd is not a readable FMU",
    ),
    "no source": (UNSOURCED, "component 'ramp' has no source"),
    "other type": (changed('name="ramp"', 'name="ramp" type="text/x-modelica"'), "is of type 'text/x-modelica'"),
    "scheduled execution": (
        changed('name="ramp"', 'name="ramp" implementation="ScheduledExecution"'),
        "ScheduledExecution",
    ),
    "two elements of one name": (
        changed('name="sum"', 'name="ramp"'),
        "line 5: system 'root' has two elements named 'ramp'",
    ),
    "two connectors of one name": (changed('name="w"', 'name="u"'), "'sum' has two connectors named 'u'"),
    "connector without variable": (changed('name="y"', 'name="z"'), "has no variable 'z'", "known:"),
    "connector of another kind": (
        changed('name="y" kind="output"', 'name="y" kind="input"'),
        "kind 'input'",
        "causality 'output'",
    ),
    "connector of another type": (changed("<ssc:Real/>", "<ssc:Boolean/>"), "of type Boolean", "of type Real"),
    "unknown end": (
        changed('Element="sum"', 'Element="smu"'),
        "line 9: connection: system 'root' has no element 'smu'",
    ),
    "unknown connector": (changed('Connector="u"', 'Connector="v"'), "'sum' has no connector 'v'"),
    "output to output": (
        changed('endConnector="u"', 'endConnector="y"'),
        "kinds 'output' and 'output'",
        "is not one that SSP allows",
    ),
    "two sources": (changed("</ssd:Connections>", TWICE), "sum.u has two sources, ramp.speed and sum.y"),
    "units that do not fit": (
        changed('endConnector="u"', 'endConnector="w"'),
        "line 9: units 'm/s' and 'kg' do not fit",
    ),
    "nothing to run": (ssd(""), "line 2: the system holds no component"),
    "no parameter set": (changed("ssv:Parameters>", "ssv:Values>", with_parameter("")), "Element 'Values'"),
    "parameter that is no number": (with_parameter(real("sum.w", "two")), "'two' is not a valid value"),
    "parameter twice": (with_parameter(real("a", "1") * 2), "parameter 'a' is given twice"),
    "parameter in an undefined unit": (with_parameter(real("sum.u", "1", "mph")), "nothing defines the unit 'mph'"),
    "parameter in a unit that does not fit": (
        with_parameter(real("sum.u", "1", "kg")),
        "units 'kg' and 'm/s' do not fit",
    ),
    "mapping without target": (
        with_parameter(real("a", "1"), MAPPED),
        "'a' is mapped to 'sum.uu', nothing of the root system (did you mean 'sum.u'",
    ),
    "missing parameter file": (with_bindings(EXTERNAL), "source 'resources/a.ssv': the package has no such file"),
    "annotation that is none of ours": (changed(ROOT_END, OURS + ROOT_END), "'fmu-observer.scenario' is not JSON"),
}


@pytest.mark.parametrize("case", WRONG)
def test_one_message_with_the_place(case: str, tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    text, *expected = WRONG[case]
    path = package(tmp_path / "system.ssp", {"SystemStructure.ssd": text, **fmus_of})
    message = refused(path, *expected)
    assert message.startswith(f"{path}: SystemStructure.ssd")


def test_the_good_one_is_good(tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    assert (
        Scenario.load(package(tmp_path / "system.ssp", {"SystemStructure.ssd": GOOD, **fmus_of})).run().failure is None
    )


def test_several_faults_of_the_schema_are_named_together(tmp_path: Path) -> None:
    text = GOOD.replace("ssc:Real", "ssc:Float64")  # of 2.0, in a file of 1.0
    with pytest.raises(CosimError) as caught:
        Scenario.load(package(tmp_path / "system.ssp", {"SystemStructure.ssd": text}))
    assert len(str(caught.value).splitlines()) == 4  # three, and that there are more
    assert "line 4: Element 'Float64': This element is not expected. Expected is one of ( Real," in str(caught.value)


# -- structures within themselves -----------------------------------------------------------------------------------


def test_a_structure_within_itself(tmp_path: Path) -> None:
    nested = '<ssd:Component name="again" type="application/x-ssp-definition" source="{}"/>'
    files = {"SystemStructure.ssd": ssd(f"<ssd:Elements>{nested.format('b.ssd')}</ssd:Elements>")}
    files["b.ssd"] = ssd(f"<ssd:Elements>{nested.format('SystemStructure.ssd')}</ssd:Elements>")
    refused(
        package(tmp_path / "a.ssp", files), "b.ssd, line 3: component 'again' nests 'SystemStructure.ssd' within itself"
    )
    inner = f'<ssd:System name="loop" id="loop"><ssd:Elements>{nested.format("#loop")}</ssd:Elements></ssd:System>'
    text = ssd(f"<ssd:Elements>{inner}</ssd:Elements>")
    refused(package(tmp_path / "c.ssp", {"SystemStructure.ssd": text}), "nests the system '#loop' within itself")


def test_connections_in_a_circle(tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    ends = connector("a", "input") + connector("b", "output")
    within = f"<ssd:Connectors>{ends}</ssd:Connectors><ssd:Connections>{wire('a', 'b')}</ssd:Connections>"
    through = "".join(f'<ssd:System name="{name}">{within}</ssd:System>' for name in "pq")
    wires = wire("p.b", "q.a") + wire("q.b", "p.a") + wire("p.b", "sum.u")
    text = ssd(f"<ssd:Elements>{ADDER}{through}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>")
    refused(
        package(tmp_path / "a.ssp", {"SystemStructure.ssd": text, **fmus_of}),
        "the connections to sum.u lead in a circle",
    )


# -- archives -------------------------------------------------------------------------------------------------------


def test_archives_that_are_none_or_dangerous(tmp_path: Path) -> None:
    refused(tmp_path / "missing.ssp", "missing.ssp does not exist")
    (tmp_path / "folder.ssp").mkdir()
    refused(tmp_path / "folder.ssp", "is a folder, expected an .ssp file")
    (tmp_path / "text.ssp").write_text("no archive")
    refused(tmp_path / "text.ssp", "not a zip archive")
    refused(
        package(tmp_path / "other.ssp", {"readme.txt": "x"}),
        "it has no SystemStructure.ssd at its top level; it holds readme.txt",
    )
    refused(
        package(tmp_path / "slip.ssp", {"SystemStructure.ssd": GOOD, "../evil": "x"}), "'../evil', which leads outside"
    )


def test_an_archive_that_would_fill_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bomb = tmp_path / "bomb.ssp"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", GOOD)
        for number in range(4):
            archive.writestr(f"resources/{number}", bytes(1 << 20))
    monkeypatch.setattr("cosim.ssp.package.MAX_UNPACKED_BYTES", 1 << 20)
    refused(bomb, "would unpack to")


def test_a_damaged_member(tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    path = package(tmp_path / "system.ssp", {"SystemStructure.ssd": GOOD, **fmus_of})
    content = bytearray(path.read_bytes())
    place = content.index(b"resources/sum.fmu") + 400
    content[place : place + 50] = bytes(50)
    path.write_bytes(content)
    refused(path, "resources/sum.fmu is damaged")


# -- command line ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command", [["run", "{}", "--quiet"], ["info", "{}"], ["list", "{}"], ["export", "{}", "out.ssp"]]
)
def test_the_command_line_says_it_and_exits_with_2(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = package(tmp_path / "system.ssp", {"SystemStructure.ssd": WRONG["broken XML"][0]})
    assert main([part.format(path) for part in command]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("cosim: ")
    assert "not readable as XML" in captured.err
    assert "Traceback" not in captured.err


def test_what_a_version_cannot_say(tmp_path: Path) -> None:
    scenario = Scenario(stop=1.0, step=0.1).add("ramp", fmu=str(ramp_fmu(tmp_path, 3)))
    with pytest.raises(
        CosimError, match=r"ramp\.fmu is an FMU of FMI 3\.0, which SSP 1\.0 does not know; export with version 2\.0"
    ):
        scenario.export_ssp(tmp_path / "a.ssp", version="1.0")
    with pytest.raises(CosimError, match=r"SSP '3\.0' cannot be written; 1\.0 and 2\.0 can"):
        scenario.export_ssp(tmp_path / "a.ssp", version="3.0")
    with pytest.raises(CosimError, match=r"ends in \.ssp"):
        scenario.export_ssp(tmp_path / "a.zip")
    with pytest.raises(CosimError, match=r"no variable 'x0\[7\]'; did you mean"):
        scenario.with_settings({"ramp.x0[7]": 1.0}).export_ssp(tmp_path / "a.ssp")
    assert not (tmp_path / "a.ssp").exists()

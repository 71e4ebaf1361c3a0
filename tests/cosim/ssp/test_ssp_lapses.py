"""Form that public packages get wrong: read with a warning that says how, refused by --strict; never another number by
it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ssp_files import EXPERIMENT, connector, described_fmu, package, ramp_fmu, real, ssd, ssm, ssv, sum_fmu, wire

from cosim import Scenario
from cosim.cli import main
from cosim.components.description import read_description
from cosim.errors import ScenarioError
from cosim.ssp.package_loading import load_package

RAMP = f"""<ssd:Component name="ramp" source="resources/ramp.fmu">
<ssd:Connectors>{connector("speed", "output", "m/s")}</ssd:Connectors></ssd:Component>"""
ADDER = f"""<ssd:Component name="sum" source="resources/sum.fmu">
<ssd:Connectors>{connector("u", "input", "m/s")}{connector("w", "input", "m/s")}{connector("y", "output", "m/s")}</ssd:Connectors>
</ssd:Component>"""  # noqa: E501
ELEMENTS = f"{connector('all', 'output', 'm/s')}</ssd:Connectors><ssd:Elements>{RAMP}{ADDER}</ssd:Elements>"
WIRES = f"<ssd:Connections>{wire('ramp.speed', 'sum.u')}{wire('sum.y', 'all')}</ssd:Connections>"
GOOD = ssd(f"<ssd:Connectors>{ELEMENTS}{WIRES}")
STEP = """<ssd:DefaultExperiment startTime="0" stopTime="1"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform">
<osp:Algorithm xmlns:osp="urn:osp">{}</osp:Algorithm></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>"""  # noqa: E501

U_IN_METRES, NO_SSC = (
    'name="u" kind="input"><ssc:Real unit="m/s"',
    ' xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"',
)
LAPSES: dict[str, tuple[str, str, str]] = {
    "no unit": (U_IN_METRES, U_IN_METRES.replace("m/s", ""), "unit '' is not defined in this file; taken as no unit"),
    "unit in brackets": (
        '"output"><ssc:Real unit="m/s"',
        '"output"><ssc:Real unit="[m/s]"',
        "unit '[m/s]' is not defined",
    ),
    "unit by its name alone": (
        '<ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>',
        "",
        "unit 'm/s' is not defined",
    ),
    "element without name": (
        'endConnector="all"',
        'endElement="" endConnector="all"',
        'endElement="" names no element',
    ),
    "parameters without a variable": (
        connector("w", "input", "m/s"),
        connector("w", "input", "m/s") + "".join(connector(f"medium.p{i}", "parameter") for i in range(22)),
        "22 connectors of kind 'parameter' of component 'sum' (resources/sum.fmu) have no variable and no connection, "
        "and are left out: medium.p0, medium.p1, medium.p2, medium.p3, medium.p4, medium.p5 and 16 more.",
    ),
    "undeclared prefix": (
        EXPERIMENT,
        STEP.format("").replace(' xmlns:osp="urn:osp"', ""),
        "prefix 'osp' is used and not",
    ),
    "undeclared prefix of SSP": (NO_SSC, "", "prefix 'ssc' is used and not declared"),
}


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A package with this structure."""
    folder = tmp_path_factory.mktemp("lapses")
    fmus = {"resources/ramp.fmu": ramp_fmu(folder), "resources/sum.fmu": sum_fmu(folder)}
    return lambda text: package(folder / "system.ssp", {"SystemStructure.ssd": text, **fmus})


def run(path: Path) -> tuple[np.ndarray, list[str]]:
    reported: list[str] = []
    outcome = Scenario.load(path).run(warn=reported.append)
    assert outcome.failure is None
    assert [w for w in outcome.warnings if w in reported] == outcome.warnings
    return outcome["sum.y"], reported


@pytest.mark.parametrize("case", LAPSES)
def test_a_lapse_is_reported_and_changes_no_number(
    case: str, packed: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    right, wrong, words = LAPSES[case]
    assert right in GOOD
    good, _ = run(packed(GOOD))
    path = packed(GOOD.replace(right, wrong))
    found, reported = run(path)
    if case != "undeclared prefix":  # whose annotation is another one as well
        np.testing.assert_array_equal(found, good)
    assert len([line for line in reported if words in line]) == 1
    with pytest.raises(ScenarioError, match="Read strictly; without --strict this is a warning"):
        Scenario.load(path, strict=True)
    assert main(["run", str(path), "--strict", "--quiet", "--no-report", "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert words in printed.err
    assert not printed.out


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (wire("ramp.speed", "sum.u"), wire("ramp.speed", "sum.lost")),
        (connector("lost", "parameter"), connector("lost", "input")),
        (connector("lost", "parameter"), connector("lost", "output")),
    ],
    ids=["connected", "input", "output"],
)
def test_what_carries_a_signal_needs_a_variable(old: str, new: str, packed: Callable[[str], Path]) -> None:
    carried = GOOD.replace(connector("w", "input", "m/s"), connector("w", "input") + connector("lost", "parameter"))
    with pytest.raises(ScenarioError, match="has no variable 'lost'"):
        Scenario.load(packed(carried.replace(old, new)))


def test_a_parameter_that_no_mapping_takes_is_reported(tmp_path: Path) -> None:
    files = {"resources/ramp.fmu": ramp_fmu(tmp_path), "resources/sum.fmu": sum_fmu(tmp_path)}
    entry = '<ssm:MappingEntry source="other" target="x0[2]"/>'
    binding = """<ssd:ParameterBindings><ssd:ParameterBinding source="a.ssv">
    <ssd:ParameterMapping source="a.ssm"/></ssd:ParameterBinding></ssd:ParameterBindings></ssd:Component>"""
    files |= {"a.ssm": ssm(entry), "a.ssv": ssv(real("other", "3") + real("slope", "5") + real("more", "7"))}
    text = GOOD.replace(RAMP, RAMP.replace("</ssd:Component>", binding))
    scenario = Scenario.load(package(tmp_path / "mapped.ssp", {"SystemStructure.ssd": text, **files}))
    reported: list[str] = []
    outcome = scenario.run(warn=reported.append)
    assert any("no entry of the parameter mapping takes slope, more, so they are not set" in w for w in reported)
    assert outcome["ramp.speed"][-1] == pytest.approx(10.0 + 3.0 * outcome.time[-1])


def test_a_lapse_at_many_places_is_one_line(packed: Callable[[str], Path]) -> None:
    inputs = GOOD.replace('"input"><ssc:Real unit="m/s"', '"input"><ssc:Real unit=""')
    inputs = inputs.replace("<ssd:Connector name=", "\n<ssd:Connector name=")
    _, reported = run(packed(inputs))
    (line,) = (text for text in reported if "unit ''" in text)
    assert "(and 1 more place): unit ''" in line


def test_a_good_package_is_read_strictly(packed: Callable[[str], Path]) -> None:
    assert Scenario.load(packed(GOOD), strict=True).run(warn=lambda _text: None).failure is None


def test_an_unknown_unit_goes_to_no_other(packed: Callable[[str], Path]) -> None:
    """The one leniency that would change numbers."""
    with pytest.raises(
        ScenarioError, match="nothing defines the unit 'kn', so numbers cannot be brought from 'm/s' to 'kn'"
    ):
        Scenario.load(packed(GOOD.replace(U_IN_METRES, U_IN_METRES.replace("m/s", "kn"))))


def test_an_odd_definition_of_a_unit_is_reported(packed: Callable[[str], Path]) -> None:
    litres = '<ssc:Unit name="L/min"><ssc:BaseUnit m="3" s="-1" factor="0.0006"/></ssc:Unit></ssd:Units>'
    _, reported = run(packed(GOOD.replace("</ssd:Units>", litres)))
    (line,) = (text for text in reported if "L/min" in text)
    assert (
        "is defined as 0.0006 m3.s-1, usually it is 1.66667e-05 m3.s-1; values are converted by the definition" in line
    )
    assert not any("km/h" in text for text in reported)


@pytest.mark.parametrize(
    ("written", "step", "words"),
    [
        ('<osp:FixedStepAlgorithm baseStepSize="0.05"/>', 0.05, None),
        (
            '<osp:SimulationInformation><osp:FixedStepMaster description="" '
            'stepSize="0.02"/></osp:SimulationInformation>',
            0.02,
            None,
        ),
        (
            '<osp:FixedStepAlgorithm baseStepSize="often"/>',
            0.001,
            "FixedStepAlgorithm has the step 'often', expected seconds",
        ),
        ('<osp:FixedStepAlgorithm baseStepSize="-1"/>', 0.001, "has the step '-1', expected seconds"),
        (
            '<osp:VariableStepMaster initialStepSize="0.1"/>',
            0.001,
            "asks for VariableStepMaster, which is not carried out",
        ),
    ],
)
def test_the_step_in_an_annotation_is_read(
    packed: Callable[[str], Path], written: str, step: float, words: str | None
) -> None:
    scenario = Scenario.load(packed(GOOD.replace(EXPERIMENT, STEP.format(written))))
    table = scenario.table()
    assert table.step == pytest.approx(step, rel=1e-12)
    assert ("communication step of" in str(table.source)) == (words is None)
    reported: list[str] = []
    scenario.run(warn=reported.append)
    assert any(words in line for line in reported) if words else not any("annotation" in line for line in reported)


def test_internal_variables_of_one_name_are_distinguished(tmp_path: Path) -> None:
    variables = '<ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>' + "".join(
        f'<ScalarVariable name="error" valueReference="{reference}"><Real/></ScalarVariable>' for reference in (20, 27)
    )
    fmu = described_fmu(tmp_path, "twins", variables)
    names = [v.name for v in read_description(fmu).modelVariables]
    assert names == ["y", "error (value reference 20)", "error (value reference 27)"]
    element = '<ssd:Elements><ssd:Component name="twins" source="resources/twins.fmu"/></ssd:Elements>'
    path = package(tmp_path / "system.ssp", {"SystemStructure.ssd": ssd(element), "resources/twins.fmu": fmu})
    words = "the name 'error' is given to more than one internal variable"
    assert words in "".join(load_package(str(path)).warnings)
    with pytest.raises(ScenarioError, match=words):
        load_package(str(path), strict=True)

"""SSP import: nested systems, units, transformations, parameters and mappings against numbers computed by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ssp_files import UNITS, array_fmu, connector, described_fmu, package, ramp_fmu, real, ssd, ssm, ssv, sum_fmu, wire

from cosim import Scenario
from cosim.scenario.scenario_tables import ConnectionTable

EXACT = 1e-13
"""A handful of roundings of numbers of size 100."""

Load = Callable[..., Scenario]

RAMP = f"""<ssd:Component name="ramp" source="resources/ramp.fmu">
<ssd:Connectors>{connector("speed", "output", "m/s")}</ssd:Connectors></ssd:Component>"""
ADDER = f"""<ssd:Component name="sum" source="resources/sum.fmu">
<ssd:Connectors>{connector("u", "input", "m/s")}{connector("w", "input")}{connector("y", "output")}</ssd:Connectors>
</ssd:Component>"""
INNER_ENDS = connector("v", "input", "km/h") + connector("bias", "input", "km/h") + connector("out", "output", "km/h")


def nested(inner_wires: str = "", outer_wires: str = "", bindings: str = "") -> str:
    """A ramp, and a system `onboard` with the adder in it; `v`, `bias` and `out` are its connectors, in km/h."""
    wires = inner_wires or wire("v", "sum.u") + wire("bias", "sum.w") + wire("sum.y", "out")
    return f"""{bindings}<ssd:Elements>{RAMP}
<ssd:System name="onboard"><ssd:Connectors>{INNER_ENDS}</ssd:Connectors>
<ssd:Elements>{ADDER}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections></ssd:System></ssd:Elements>
<ssd:Connections>{outer_wires or wire("ramp.speed", "onboard.v")}</ssd:Connections>"""


def bound(values: str, units: str = UNITS, prefix: str = "", mapping: str = "") -> str:
    """Parameter bindings with one inline set."""
    attribute = f' prefix="{prefix}"' if prefix else ""
    mapped = f"<ssd:ParameterMapping>{mapping}</ssd:ParameterMapping>" if mapping else ""
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding{attribute}><ssd:ParameterValues>{ssv(values, units)}"
        f"</ssd:ParameterValues>{mapped}</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


@pytest.fixture(scope="session")
def fmus_of(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    return {"resources/ramp.fmu": ramp_fmu(folder), "resources/sum.fmu": sum_fmu(folder)}


@pytest.fixture
def load(tmp_path: Path, fmus_of: dict[str, Path]) -> Load:
    def loaded(structure: str, **files: str) -> Scenario:
        more = {f"resources/{name.replace('_', '.')}": text for name, text in files.items()}
        return Scenario.load(package(tmp_path / "system.ssp", {"SystemStructure.ssd": structure, **fmus_of, **more}))

    return loaded


def outputs(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    outcome = scenario.run(warn=lambda _text: None)
    assert outcome.failure is None
    return outcome["ramp.speed"], outcome["onboard__sum.y"]


# -- structure ------------------------------------------------------------------------------------------------------


def test_nested_systems_become_flat_components_and_direct_connections(load: Load) -> None:
    scenario = load(ssd(nested()))
    table = scenario.table()
    assert list(table.components) == ["ramp", "onboard__sum"]
    assert table.connections == ["ramp.speed -> onboard__sum.u"]
    assert (table.title, table.start, table.stop, table.step) == ("by hand", 0.0, 1.0, 0.001)
    speed, y = outputs(scenario)
    assert len(speed) == 1001
    assert np.abs(speed - (10.0 + 2.0 * np.arange(1001) / 1000.0)).max() < EXACT * 100
    assert np.array_equal(y, 2.0 * speed)  # through km/h and back in the structure, non_numeric in the run


def test_the_direction_of_a_connection_is_that_of_its_kinds(load: Load) -> None:
    reversed_wires = wire("sum.u", "v") + wire("out", "sum.y")
    table = load(ssd(nested(reversed_wires, wire("onboard.v", "ramp.speed")))).table()
    assert table.connections == ["ramp.speed -> onboard__sum.u"]


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_the_linear_transformation_works_in_the_unit_of_the_far_end(load: Load, version: str) -> None:
    linear = '<ssc:LinearTransformation factor="0.5" offset="1"/>'
    speed, y = outputs(load(ssd(nested(wire("v", "sum.u", linear)), version=version)))
    assert np.abs(y - 2.0 * (0.5 * speed + 1.0)).max() < EXACT * 100  # km/h -> m/s, then 0.5 v + 1 [m/s]
    outer = wire("ramp.speed", "onboard.v", linear)
    speed, y = outputs(load(ssd(nested(outer_wires=outer), version=version)))
    assert np.abs(y - 2.0 * (0.5 * 3.6 * speed + 1.0) / 3.6).max() < EXACT * 100  # m/s -> km/h, 0.5 v + 1 [km/h], back


def test_suppressed_units_pass_the_number(load: Load) -> None:
    speed, y = outputs(load(ssd(nested(outer_wires=wire("ramp.speed", "onboard.v", suppressUnitConversion="true")))))
    assert np.abs(y - 2.0 * speed / 3.6).max() < EXACT * 100  # 10 m/s is taken for 10 km/h
    linear = '<ssc:LinearTransformation factor="3.6"/>'
    speed, y = outputs(
        load(ssd(nested(outer_wires=wire("ramp.speed", "onboard.v", linear, suppressUnitConversion="1"))))
    )
    assert np.abs(y - 2.0 * speed).max() < EXACT * 100


def test_a_table_of_values_stands_alone(load: Load) -> None:
    linear = '<ssc:LinearTransformation factor="2"/>'
    table = '<ssc:IntegerMappingTransformation><ssc:MapEntry source="1" target="2"/></ssc:IntegerMappingTransformation>'
    for outer, inner, says in (
        (table, linear, "a linear transformation behind a table of values cannot be carried out"),
        (linear, table, "a table of values behind a unit conversion or a linear transformation cannot be carried out"),
    ):
        wires = (
            wire("v", "sum.u", inner, suppressUnitConversion="true"),
            wire("ramp.speed", "onboard.v", outer, suppressUnitConversion="true"),
        )
        with pytest.raises(ValueError, match=says):
            load(ssd(nested(*wires)))


def test_a_connector_in_another_unit_than_the_variable_is_converted(load: Load) -> None:
    shown = RAMP.replace('unit="m/s"', 'unit="km/h"')
    direct = f"<ssd:Elements>{shown}{ADDER}</ssd:Elements>"
    plain = direct + f"<ssd:Connections>{wire('ramp.speed', 'sum.u')}</ssd:Connections>"
    (connection,) = load(ssd(plain)).table().connections
    assert isinstance(connection, ConnectionTable)
    assert connection.factor == pytest.approx(1.0, rel=1e-15)
    suppressed = (
        direct + f"<ssd:Connections>{wire('ramp.speed', 'sum.u', suppressUnitConversion='true')}</ssd:Connections>"
    )
    (connection,) = load(ssd(suppressed)).table().connections
    assert connection.factor == pytest.approx(3.6, rel=1e-15)  # the number that is shown, in km/h


def test_a_signal_dictionary_is_a_bus(load: Load) -> None:
    bus = "".join(
        f'<ssd:SignalDictionaryReference name="{name}" '
        f'dictionary="bus"><ssd:Connectors>{connector("velocity", "inout")}'
        "</ssd:Connectors></ssd:SignalDictionaryReference>"
        for name in ("here", "there", "third")
    )
    entry = '<ssb:DictionaryEntry name="velocity"><ssc:Real/></ssb:DictionaryEntry>'
    dictionary = f'<ssb:SignalDictionary version="1.0">{entry}</ssb:SignalDictionary>'
    structure = ssd(
        f"<ssd:Elements>{RAMP}{ADDER}{bus}</ssd:Elements>"
        f"<ssd:Connections>{wire('ramp.speed', 'here.velocity')}{wire('there.velocity', 'sum.u')}</ssd:Connections>"
        f"<ssd:SignalDictionaries><ssd:SignalDictionary "
        f'name="bus">{dictionary}</ssd:SignalDictionary></ssd:SignalDictionaries>'
    )
    assert load(structure).table().connections == ["ramp.speed -> sum.u"]
    with pytest.raises(ValueError, match=r"dictionary 'bus' has no entry 'velocity'; did you mean 'velocities'"):
        load(structure.replace('DictionaryEntry name="velocity"', 'DictionaryEntry name="velocities"'))
    both = wire("ramp.speed", "there.velocity") + wire("third.velocity", "sum.u")
    with pytest.raises(ValueError, match=r"the signal 'velocity' of 'bus' has two sources, at here.* and there"):
        load(structure.replace(wire("there.velocity", "sum.u"), both))
    with pytest.raises(ValueError, match="no system around 'here' has a signal dictionary 'bahn'"):
        load(structure.replace('dictionary="bus"', 'dictionary="bahn"'))


def test_structures_within_structures(tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    inner = ssd(
        f"<ssd:Connectors>{connector('v', 'input', 'm/s')}</ssd:Connectors><ssd:Elements>{ADDER}</ssd:Elements>"
        f"<ssd:Connections>{wire('v', 'sum.u')}</ssd:Connections>"
    )
    package(tmp_path / "inner.ssp", {"SystemStructure.ssd": inner, "resources/sum.fmu": fmus_of["resources/sum.fmu"]})
    kinds = {"inner.ssd": "application/x-ssp-definition", "resources/inner.ssp": "application/x-ssp-package"}
    parts = "".join(f'<ssd:Component name="n{i}" type="{t}" source="{s}"/>' for i, (s, t) in enumerate(kinds.items()))
    wires = wire("ramp.speed", "n0.v") + wire("ramp.speed", "n1.v")
    outer = ssd(f"<ssd:Elements>{RAMP}{parts}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>")
    files = {"SystemStructure.ssd": outer, "inner.ssd": inner, "resources/inner.ssp": tmp_path / "inner.ssp", **fmus_of}
    table = Scenario.load(package(tmp_path / "outer.ssp", files)).table()
    assert table.connections == ["ramp.speed -> n0__sum.u", "ramp.speed -> n1__sum.u"]


def test_variants_by_file_and_by_name(tmp_path: Path, fmus_of: dict[str, Path]) -> None:
    alone = ssd(f"<ssd:Elements>{RAMP}</ssd:Elements>", name="only a ramp")
    files = {"SystemStructure.ssd": ssd(nested()), "Alone.ssd": alone, **fmus_of}
    path = package(tmp_path / "system.ssp", files)
    for variant in ("Alone", "Alone.ssd", "only a ramp"):
        assert list(Scenario.load(f"{path}#{variant}").table().components) == ["ramp"]
    assert Scenario.load(f"{path}#Alone").name == "system_Alone"
    with pytest.raises(ValueError, match=r"no variant 'Alne'; did you mean 'Alone'"):
        Scenario.load(f"{path}#Alne")


# -- parameters -----------------------------------------------------------------------------------------------------


def test_a_connector_without_driver_takes_a_start_value_in_its_own_unit(load: Load) -> None:
    scenario = load(ssd(nested(bindings=bound(real("onboard.bias", "7.2", "km/h")))))
    assert scenario.table().components["onboard__sum"].parameters == {"w": pytest.approx(2.0, rel=1e-15)}
    speed, y = outputs(scenario)
    assert np.abs(y - (2.0 * speed + 2.0)).max() < EXACT * 100


def test_outer_bindings_come_before_inner_ones_and_later_before_earlier(load: Load) -> None:
    own = RAMP.replace("</ssd:Component>", bound(real("x0[1]", "5")) + "</ssd:Component>")
    alone = ssd(f"<ssd:Elements>{own}</ssd:Elements>")
    assert load(alone).table().components["ramp"].parameters == {"x0[1]": 5.0}
    two = bound(real("ramp.x0[1]", "6")).replace("</ssd:ParameterBindings>", "") + bound(
        real("x0[1]", "7") + real("x0[2]", "1"), prefix="ramp."
    ).replace("<ssd:ParameterBindings>", "")
    both = ssd(f"{two}<ssd:Elements>{own}</ssd:Elements>")
    assert load(both).table().components["ramp"].parameters == {"x0[1]": 7.0, "x0[2]": 1.0}


def test_files_of_parameters_and_mappings(load: Load) -> None:
    binding = """<ssd:ParameterBindings><ssd:ParameterBinding source="resources/a.ssv">
<ssd:ParameterMapping source="resources/a.ssm"/></ssd:ParameterBinding></ssd:ParameterBindings>"""
    values = ssv(real("v_start", "36", "km/h") + real("unused", "1"), UNITS)
    linear = '<ssc:LinearTransformation factor="2" offset="1"/>'
    entries = (
        f'<ssm:MappingEntry source="v_start" target="onboard.bias">{linear}</ssm:MappingEntry>'
        '<ssm:MappingEntry source="v_start" target="onboard.sum.u" suppressUnitConversion="true"/>'
        '<ssm:MappingEntry source="v_start" target="ramp.x0[1]"/>'
    )
    table = load(ssd(nested(bindings=binding)), a_ssv=values, a_ssm=ssm(entries)).table()
    parameters = table.components["onboard__sum"].parameters
    assert parameters["w"] == pytest.approx((2.0 * 36.0 + 1.0) / 3.6, rel=1e-15)  # in km/h, the unit of the connector
    assert parameters["u"] == 36.0
    assert table.components["ramp"].parameters == {"x0[1]": 36.0}  # without a unit of its own


def test_an_array_of_values_for_a_split_vector(load: Load) -> None:
    values = '<ssv:Parameter name="x0"><ssv:Float64 value="4 0.5"/><ssc:Dimension size="2"/></ssv:Parameter>'
    binding = bound(values, prefix="ramp.").replace('version="1.0" name="set"', 'version="2.0" name="set"')
    scenario = load(ssd(f"{binding}<ssd:Elements>{RAMP}</ssd:Elements>"))
    assert scenario.table().components["ramp"].parameters == {"x0": [4.0, 0.5]}
    outcome = scenario.run()
    assert outcome["ramp.speed"][-1] == pytest.approx(4.5, rel=1e-12)


def test_what_is_nothing_of_the_system_is_ignored_and_reported(load: Load) -> None:
    scenario = load(ssd(nested(bindings=bound(real("ramp.x0[3]", "1")))))
    reported: list[str] = []
    outcome = scenario.run(warn=reported.append)
    assert "parameter 'ramp.x0[3]' is nothing of the root system (did you mean" in reported[0]
    assert reported[0].startswith(str(scenario.where))
    assert ", line " in reported[0]
    assert outcome.warnings == reported


# -- values that are not real numbers -------------------------------------------------------------------------------


def enumeration(name: str, **items: int) -> str:
    entries = "".join(f'<Item name="{item}" value="{value}"/>' for item, value in items.items())
    return f'<SimpleType name="{name}"><Enumeration>{entries}</Enumeration></SimpleType>'


def variable(name: str, reference: int, causality: str, kind: str) -> str:
    variability = "fixed" if causality == "parameter" else "discrete"
    attributes = f'name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}"'
    return f"<ScalarVariable {attributes}>{kind}</ScalarVariable>"


LAMP, GEAR = enumeration("Lamp", off=1, dim=2, full=3), enumeration("Gear", none=0, low=10, high=20)
KINDS = f"<TypeDefinitions>{LAMP}{GEAR}</TypeDefinitions>"
SENDER = "".join(
    (
        variable("on", 1, "output", "<Boolean/>"),
        variable("count", 2, "output", "<Integer/>"),
        variable("lamp", 3, "output", '<Enumeration declaredType="Lamp"/>'),
    )
)
TAKER = "".join(
    (
        variable("on", 1, "input", '<Boolean start="false"/>'),
        variable("count", 2, "input", '<Integer start="0"/>'),
        variable("gear", 3, "input", '<Enumeration declaredType="Gear" start="0"/>'),
        variable("label", 4, "parameter", '<String start=""/>'),
    )
)


def discrete(tmp_path: Path, wires: str, bindings: str = "") -> Scenario:
    elements = ""
    for name, kind, third in (("send", "output", "lamp"), ("take", "input", "gear")):
        connectors = connector("on", kind, type_="Boolean") + connector("count", kind, type_="Integer")
        connectors += f'<ssd:Connector name="{third}" kind="{kind}"/>'
        elements += f"""<ssd:Component name="{name}" source="resources/{name}.fmu">
<ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>"""
    structure = ssd(f"{bindings}<ssd:Elements>{elements}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>")
    members = {
        f"resources/{n}.fmu": described_fmu(tmp_path, n, v, KINDS) for n, v in (("send", SENDER), ("take", TAKER))
    }
    return Scenario.load(package(tmp_path / "discrete.ssp", {"SystemStructure.ssd": structure, **members}))


def mapping(kind: str, *pairs: tuple[str, str]) -> str:
    entries = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in pairs)
    return f"<ssc:{kind}MappingTransformation>{entries}</ssc:{kind}MappingTransformation>"


@pytest.mark.parametrize(
    ("pairs", "expected"),
    [
        ([("true", "false"), ("false", "true")], (-1.0, 1.0)),
        ([("true", "false")], (0.0, 0.0)),
        ([("false", "1")], (0.0, 1.0)),
        ([("0", "false")], (1.0, 0.0)),
    ],
)
def test_boolean_mappings_are_linear(
    tmp_path: Path, pairs: list[tuple[str, str]], expected: tuple[float, float]
) -> None:
    (table,) = discrete(tmp_path, wire("send.on", "take.on", mapping("Boolean", *pairs))).table().connections
    assert (table.factor, table.offset, table.values) == (*expected, [])


def test_integer_mappings_are_tables(tmp_path: Path) -> None:
    (table,) = (
        discrete(tmp_path, wire("send.count", "take.count", mapping("Integer", ("1", "7"), ("2", "2"))))
        .table()
        .connections
    )
    assert table.values == [(1.0, 7.0)]


def test_enumerations_are_mapped_by_the_names_of_their_items(tmp_path: Path) -> None:
    pairs = [("off", "none"), ("dim", "low"), ("full", "high")]
    (table,) = discrete(tmp_path, wire("send.lamp", "take.gear", mapping("Enumeration", *pairs))).table().connections
    assert (table.factor, table.offset) == (10.0, -10.0)  # 1, 2, 3 -> 0, 10, 20
    pairs[2] = ("full", "low")
    (table,) = discrete(tmp_path, wire("send.lamp", "take.gear", mapping("Enumeration", *pairs))).table().connections
    assert table.values == [(1.0, 0.0), (2.0, 10.0), (3.0, 10.0)]
    pairs[2] = ("full", "hgh")
    with pytest.raises(
        ValueError, match=r"line \d+: item 'full' is mapped to 'hgh', which is no item .* did you mean 'high'"
    ):
        discrete(tmp_path, wire("send.lamp", "take.gear", mapping("Enumeration", *pairs)))


def test_parameters_of_every_type(tmp_path: Path) -> None:
    values = (
        '<ssv:Parameter name="take.on"><ssv:Boolean value="true"/></ssv:Parameter>'
        '<ssv:Parameter name="take.count"><ssv:Integer value="-3"/></ssv:Parameter>'
        '<ssv:Parameter name="take.gear"><ssv:Enumeration value="low"/></ssv:Parameter>'
        '<ssv:Parameter name="take.label"><ssv:String value="Übung 1"/></ssv:Parameter>'
    )
    table = discrete(tmp_path, wire("send.on", "take.on"), bound(values)).table()
    assert table.components["take"].parameters == {"on": 1.0, "count": -3.0, "gear": "low", "label": "Übung 1"}
    with pytest.raises(ValueError, match=r"take\.gear has no item 'lwo'; did you mean 'low'"):
        discrete(tmp_path, wire("send.on", "take.on"), bound(values.replace('"low"', '"lwo"')))
    with pytest.raises(ValueError, match=r"parameter 'take\.count' is a Real, take\.count is a Integer"):
        discrete(tmp_path, wire("send.on", "take.on"), bound(real("take.count", "1.5")))


# -- arrays and parameters of systems -------------------------------------------------------------------------------


def test_elements_of_arrays_by_indices(tmp_path: Path) -> None:
    sizes = {"send": ("output", 3), "whole": ("input", 3), "first": ("input", 2)}
    members = {f"resources/{name}.fmu": array_fmu(tmp_path, name, *stated) for name, stated in sizes.items()}
    parts = {}
    for name, (kind, size) in sizes.items():
        end = f'<ssd:Connector name="x" kind="{kind}"><ssc:Float64/><ssc:Dimension size="{size}"/></ssd:Connector>'
        source = f"resources/{name}.fmu"
        parts[name] = (
            f'<ssd:Component name="{name}" source="{source}"><ssd:Connectors>{end}</ssd:Connectors></ssd:Component>'
        )
    through = '<ssd:Connectors><ssd:Connector name="bus" kind="output"/></ssd:Connectors>'
    within = f"<ssd:Elements>{parts['send']}</ssd:Elements><ssd:Connections>{wire('send.x', 'bus')}</ssd:Connections>"
    elements = f'<ssd:System name="in">{through}{within}</ssd:System>{parts["whole"]}{parts["first"]}'
    wires = wire("in.bus", "whole.x") + wire("in.bus", "first.x", startIndices="3", endIndices="1")
    structure = ssd(f"<ssd:Elements>{elements}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>", version="2.0")
    scenario = Scenario.load(package(tmp_path / "arrays.ssp", {"SystemStructure.ssd": structure, **members}))
    assert scenario.table().connections == ["in__send.x -> whole.x", "in__send.x[3] -> first.x[1]"]
    again = Scenario.load(scenario.export_ssp(tmp_path / "again.ssp"))
    assert again.table().connections == scenario.table().connections


def test_a_parameter_of_the_system_reaches_the_components(load: Load) -> None:
    own = RAMP.replace("<ssd:Connectors>", "<ssd:Connectors>" + connector("x0[1]", "parameter"))
    start = f"<ssd:Connectors>{connector('start', 'parameter')}</ssd:Connectors>"
    linear = '<ssc:LinearTransformation factor="2.5"/>'
    wires = wire("start", "ramp.x0[1]", linear)
    structure = ssd(
        f"{start}{bound(real('start', '4'))}<ssd:Elements>{own}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>"  # noqa: E501
    )
    assert load(structure).table().components["ramp"].parameters == {"x0[1]": 10.0}


def test_times_come_from_the_structure_or_else_from_the_fmus(load: Load, tmp_path: Path) -> None:
    table = load(ssd(nested(), tail=UNITS + '<ssd:DefaultExperiment startTime="2" stopTime="3.5"/>')).table()
    assert (table.start, table.stop, table.step) == (2.0, 3.5, 0.0015)
    table = load(ssd(nested(), tail=UNITS)).table()
    assert (table.start, table.stop, table.step) == (0.0, 1.0, 0.001)

    def one(experiment: str) -> Scenario:
        fmu = described_fmu(tmp_path, "one", variable("y", 1, "output", "<Real/>"), experiment)
        structure = ssd('<ssd:Elements><ssd:Component name="one" source="one.fmu"/></ssd:Elements>', tail="")
        return Scenario.load(package(tmp_path / "one.ssp", {"SystemStructure.ssd": structure, "one.fmu": fmu}))

    table = one('<DefaultExperiment stopTime="1.0" stepSize="0.3"/>').table()
    assert (table.stop, table.step) == (1.0, 0.25)  # the longest that divides the run and is not longer
    with pytest.raises(ValueError, match=r"stop: is missing"):
        one("").table()
    assert one("").set("stop", 2.0).set("step", 0.5).table().step == 0.5

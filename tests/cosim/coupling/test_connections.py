"""Connections: names, causalities, sources and units, with messages that say what to do."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Listener, block, prepare
from fmpy.model_description import BaseUnit, ModelVariable, SimpleType, VariableAlias
from mock_slaves import Mock, component, variable

from cosim.coupling.connection import connect, split_name, unconnected_inputs
from cosim.errors import CouplingError


class Speedometer(Mock):
    outputs: ClassVar[dict[str, Any]] = {
        "speed": (36.0, "km/h"),
        "plain": 1.0,
        "text_like": (1.0, "furlong"),
        "warm": (20.0, "degC"),
    }

    def more_variables(self) -> list[Any]:
        return [
            variable("label", "output", 50, "String"),
            variable("table", "output", 51, "Float64", shape=(3,)),
            variable("count", "output", 52, "Int32"),
        ]


class Reader(Mock):
    inputs: ClassVar[dict[str, Any]] = {
        "speed": (0.0, "m/s"),
        "force": (0.0, "N"),
        "length": (0.0, "furlong"),
        "temperature": (0.0, "K"),
        "free": 5.0,
    }
    outputs: ClassVar[dict[str, Any]] = {"heard": 0.0}
    parameters: ClassVar[dict[str, Any]] = {"gain": 1.0}


def pair(source: Mock | None = None, target: Mock | None = None) -> dict[str, Any]:
    return {"meter": component(source or Speedometer(), "meter"), "reader": component(target or Reader(), "reader")}


def connected(output: str, name: str, **slaves: Any) -> Any:
    return connect([(output, name)], pair(**slaves))[0]


def test_units_are_converted() -> None:
    made = connected("meter.speed", "reader.speed")
    assert made.factor == pytest.approx(1.0 / 3.6, rel=1e-15)
    assert made.offset == 0.0
    warm = connected("meter.warm", "reader.temperature")
    assert warm.factor * 20.0 + warm.offset == pytest.approx(293.15, rel=1e-15)


def test_a_converted_value_arrives() -> None:
    slave = Reader()
    parts = [component(Speedometer(), "meter"), component(slave, "reader")]
    master = prepare(parts, [("meter.speed", "reader.speed"), ("meter.warm", "reader.temperature")], 0.1, 1)
    master.run()
    assert slave.v["speed"] == pytest.approx(10.0, rel=1e-15)
    assert slave.v["temperature"] == pytest.approx(293.15, rel=1e-15)
    assert slave.v["free"] == 5.0


def test_a_unit_is_what_the_fmu_itself_says_it_is() -> None:
    """Two FMUs name their unit 'v'; one means knots, the other metres a second. A library of unit names cannot know
    that.
    """

    class Ship(Speedometer):
        outputs: ClassVar[dict[str, Any]] = {"speed": (10.0, "v")}
        units: ClassVar[dict[str, Any]] = {"v": BaseUnit(m=1, s=-1, factor=1852.0 / 3600.0)}

    class Shore(Reader):
        inputs: ClassVar[dict[str, Any]] = {"speed": (0.0, "v")}
        units: ClassVar[dict[str, Any]] = {"v": BaseUnit(m=1, s=-1)}

    assert connected("meter.speed", "reader.speed", source=Ship(), target=Shore()).factor == pytest.approx(
        0.514444, rel=1e-5
    )


def test_a_unit_may_come_from_the_declared_type() -> None:
    class Typed(Speedometer):
        outputs: ClassVar[dict[str, Any]] = {"speed": 36.0}

        def _describe(self) -> Any:
            description = super()._describe()
            description.modelVariables[0].declaredType = SimpleType(name="Speed", unit="km/h")
            return description

    assert connected("meter.speed", "reader.speed", source=Typed()).factor == pytest.approx(1.0 / 3.6, rel=1e-15)


def test_a_temperature_difference_has_no_offset() -> None:
    class Difference(Speedometer):
        outputs: ClassVar[dict[str, Any]] = {"warm": (20.0, "degC")}

        def _describe(self) -> Any:
            description = super()._describe()
            description.modelVariables[0].relativeQuantity = True
            return description

    class Rise(Reader):
        def _describe(self) -> Any:
            description = super()._describe()
            next(v for v in description.modelVariables if v.name == "temperature").relativeQuantity = True
            return description

    made = connected("meter.warm", "reader.temperature", source=Difference(), target=Rise())
    assert (made.factor, made.offset) == (1.0, 0.0)


def test_units_that_nobody_explains_fit_only_their_own_name() -> None:
    assert connected("meter.text_like", "reader.length").factor == 1.0
    with pytest.raises(
        CouplingError, match=r"meter.text_like -> reader.speed: units 'furlong' and 'm/s' do not fit: .*furlong"
    ):
        connected("meter.text_like", "reader.speed")


def test_no_unit_on_one_side_is_taken_as_it_is() -> None:
    assert connected("meter.plain", "reader.speed").factor == 1.0


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("meter.speed", "reader.force", r"units 'km/h' and 'N' do not fit: different dimensions"),
        ("meter.sped", "reader.speed", r"meter: no variable 'sped'; did you mean 'speed'\?"),
        ("metre.speed", "reader.speed", r"Connection source 'metre.speed'.*did you mean 'meter'\?"),
        ("meter.speed", "reader", r"Connection target 'reader': expected 'component.signal'; which signal of reader\?"),
        (
            "meter.speed",
            "reader.heard",
            r"reader.heard has causality 'output', expected input; such variables: speed, force",
        ),
        ("reader.speed", "meter.speed", r"reader.speed has causality 'input', expected output"),
        ("meter.speed", "reader.gain", r"reader.gain has causality 'parameter', expected input"),
        (
            "meter.label",
            "reader.speed",
            r"meter.label is a String, reader.speed is a Float64; only equal types fit here",
        ),
        (
            "meter.table",
            "reader.speed",
            r"meter.table is an array of shape \(3,\), reader.speed is a scalar; connect arrays of",
        ),
        (
            "meter.table[0]",
            "reader.speed",
            r"meter: no element 'table\[0\]' in a Float64 array of shape \(3,\); the first is 1",
        ),
        ("meter.table[4]", "reader.speed", r"meter: no element 'table\[4\]' in a Float64 array of shape \(3,\)"),
    ],
)
def test_what_cannot_be_connected_is_named(source: str, target: str, message: str) -> None:
    with pytest.raises(CouplingError, match=message):
        connected(source, target)


def test_an_input_takes_one_source() -> None:
    with pytest.raises(CouplingError, match=r"reader.speed has two sources, meter.speed and meter.plain.*Remove one"):
        connect([("meter.speed", "reader.speed"), ("meter.plain", "reader.speed")], pair())


@pytest.mark.parametrize("version", [2, 3])
def test_the_variables_of_an_event_belong_to_the_master(version: Any) -> None:
    parts = {"meter": component(Speedometer(), "meter"), "listener": block(Listener(), "listener", version)}
    assert parts["listener"].names("input") == ["speed"]
    with pytest.raises(CouplingError, match=r"listener.balise_position belongs to an event"):
        connect([("meter.plain", "listener.balise_position")], parts)


def test_an_array_without_any_source_is_named_once() -> None:
    class Table(Reader):
        def more_variables(self) -> list[Any]:
            arrays = [
                variable(n, "input", 60 + i, "Float64", shape=(3,)) for i, n in enumerate(("one", "some", "whole"))
            ]
            return [*arrays, variable("text", "input", 70, "String")]

    pairs = [("meter.table[2]", "reader.some[1]"), ("meter.table", "reader.whole"), ("meter.speed", "reader.speed")]
    parts = pair(target=Table())
    free = unconnected_inputs(connect(pairs, parts), [parts["reader"]])
    assert free[-4:] == ["reader.one", "reader.some[2]", "reader.some[3]", "reader.text"]
    with pytest.raises(
        CouplingError, match=r"Input reader.some\[1\] has two sources, meter.table\[2\] and meter.table"
    ):
        connect([*pairs, ("meter.table", "reader.some")], parts)


def test_names_with_dots_and_what_is_left_free() -> None:
    assert split_name("a.body.v", ["a"], "x") == ("a", "body.v")
    connections = connect([("meter.speed", "reader.speed")], pair())
    assert str(connections[0]) == "meter.speed -> reader.speed"
    free = unconnected_inputs(connections, pair().values())
    assert free == ["reader.force", "reader.length", "reader.temperature", "reader.free"]
    assert np.all([c.factor > 0 for c in connections])


def test_an_alias_is_no_unconnected_input() -> None:
    """FMI 3 gives one variable several names; a source of any of them is a source of the variable."""
    own = ModelVariable(
        name="force", valueReference=1, type="Float64", causality="input", aliases=[VariableAlias(name="flange.f")]
    )
    alias = ModelVariable(name="flange.f", valueReference=1, type="Float64", causality="input", alias=own)
    described = SimpleNamespace(modelVariables=[own, alias])
    part: Any = SimpleNamespace(name="plant", description=described, event_references=set)
    assert unconnected_inputs([], [part]) == ["plant.force"]
    for name in ("force", "flange.f"):
        source: Any = SimpleNamespace(target=("plant", name))
        assert unconnected_inputs([source], [part]) == []

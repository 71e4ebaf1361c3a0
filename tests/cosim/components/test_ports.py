"""Prepared reads and writes of every type of variable."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from coupled_runs import Pushed, block
from mock_slaves import FMI2, Mock, component, variable

from fmus.fmi.ports import make_port


class Mixed(Mock):
    """Real, whole and logical variables, interleaved."""

    def more_variables(self) -> list[Any]:
        kinds = ["Float64", "Int32", "Float64", "Boolean", "Enumeration", "UInt8"]
        if self.version == 2:
            kinds = ["Real", "Integer", "Real", "Boolean", "Enumeration", "Integer"]
        return [variable(f"x{i}", "input", 10 + i, kind) for i, kind in enumerate(kinds)]


class Mixed2(FMI2, Mixed):
    """The same with an FMI 2 interface."""


@pytest.mark.parametrize("slave", [Mixed(), Mixed2()])
def test_values_come_back_as_they_were_written(slave: Mock) -> None:
    variables = [slave.model_description.modelVariables[i] for i in (4, 0, 3, 1, 2, 5)]
    buffer = np.array([2.0, 1.5, 1.0, -3.0, 2.5, 7.0])
    make_port(slave, slave.version, "Set", variables, buffer)()
    values = np.zeros(6)
    make_port(slave, slave.version, "Get", variables, values)()
    np.testing.assert_array_equal(values, buffer)


def test_whole_and_logical_inputs_are_rounded() -> None:
    slave = Mixed()
    variables = [slave.model_description.modelVariables[i] for i in (1, 3)]
    make_port(slave, 3, "Set", variables, np.array([2.6, 0.7]))()
    assert (slave.v["x1"], slave.v["x3"]) == (3, True)


def test_no_variables_is_no_call() -> None:
    make_port(object(), 3, "Get", [], np.zeros(0))()
    make_port(object(), 2, "Set", [], np.zeros(0))()


@pytest.mark.parametrize("version", [2, 3])
def test_blocks_are_read_and_written_through_their_prepared_calls(version: Any) -> None:
    made = block(Pushed(), "p", version)
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    write, buffer = made.writer(["push"])
    values = np.zeros(2)
    read = made.reader(["speed", "position"], values)
    made.exit_initialization()
    buffer[0] = 2.0
    write()
    made.advance(0.0, 0.5)
    read()
    np.testing.assert_allclose(values, [11.0, 5.25], rtol=1e-12)


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_native_slaves_read_into_the_callers_array(version: Any) -> None:
    import fmus
    from cosim.components.loading import load_fmu

    made = load_fmu(fmus.cached_fmu(Pushed(), fmi_version=version), "p")
    try:
        made.instantiate()
        made.enter_initialization(0.0, 1.0)
        made.exit_initialization()
        everything = np.full(5, -1.0)
        read = made.reader(["speed", "position"], everything[1:3])
        write, buffer = made.writer(["push"])
        buffer[0] = 2.0
        write()
        made.advance(0.0, 0.5)
        read()
        np.testing.assert_allclose(everything, [-1.0, 11.0, 5.25, -1.0, -1.0], rtol=1e-12)
    finally:
        made.free()


def test_an_unreadable_group_names_its_variables() -> None:
    class Broken(Mixed):
        def getFloat64(self, references: Any) -> list[float]:
            raise KeyError("no such reference")

    made = component(Broken(), "mixed")
    with pytest.raises(Exception, match="Component 'mixed': reading x0, x2 failed: 'no such reference'"):
        made.reader(["x0", "x2"], np.zeros(2))()

"""Variables of every type: start values, reading and writing by element, arrays whose shape the user chooses."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mock_slaves import FMI2, Mock, component, read, set_start, variable
from test_fmus.typed import ARRAYS, LONGEST, MOODS, expected, typed_fmu

from cosim.components.component import Component
from cosim.components.loading import load_fmu
from cosim.components.start_values import start_values
from cosim.errors import CouplingError, RunError
from fmus.fmi.elements import elements_of, layout
from fmus.fmi.exact_ports import make_exact_reader
from fmus.fmi.ports import make_port

INTEGERS = {
    f"{sign}int{bits}": (0 if sign else -(2 ** (bits - 1)), 2 ** (bits - (not sign)) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
}
"""Type -> its least and largest value."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return {version: typed_fmu(tmp_path_factory.mktemp("typed"), version=version) for version in (1, 2, 3)}  # type: ignore[arg-type]


@pytest.fixture(params=[1, 2, 3])
def typed(request: pytest.FixtureRequest, files: dict[int, Path]) -> Iterator[Component]:
    yield from alive(files[request.param])


@pytest.fixture
def typed3(files: dict[int, Path]) -> Iterator[Component]:
    yield from alive(files[3])


def alive(file: Path) -> Iterator[Component]:
    made = load_fmu(file, "typed")
    made.instantiate()
    yield made
    made.free()


def begin(made: Component) -> None:
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()


def exact(made: Component, name: str) -> Any:
    values = made.exact_reader(name)()
    return list(values) if made.variables[name].shape else values[0]


# -- scalars
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("float64", 0.1),
        ("boolean", True),
        ("string", "Zürich, Straße, 渋谷"),
        ("string", ""),
        ("enumeration", 3),
    ],
)
def test_a_start_value_of_each_type_arrives_in_each_version(typed: Component, name: str, value: Any) -> None:
    made = typed
    set_start(made, f"u_{name}", value)
    begin(made)
    assert exact(made, f"u_{name}") == value
    assert exact(made, f"y_{name}") == expected(f"u_{name}", value)
    assert made.starts == {f"u_{name}": value}


@pytest.mark.compiler
@pytest.mark.parametrize("name", list(INTEGERS))
def test_integers_are_exact_to_the_last_bit_and_never_wrapped(typed3: Component, name: str) -> None:
    low, high = INTEGERS[name]
    for value in (low, high, high - 1, 7):
        set_start(typed3, f"u_{name}", value)
        assert exact(typed3, f"y_{name}") == value ^ 1
    for value in (low - 1, high + 1):
        with pytest.raises(CouplingError, match=f"expected {low} to {high} for a .*got {value}"):
            set_start(typed3, f"u_{name}", value)


@pytest.mark.compiler
@given(content=st.binary(max_size=248))
def test_bytes_pass_whatever_they_are(files: dict[int, Path], content: bytes) -> None:
    """248 is what the FMU can hold. Zero bytes, none at all, and what is no text."""
    made = load_fmu(files[3], "typed")
    try:
        made.instantiate()
        set_start(made, "u_binary", content)
        assert exact(made, "y_binary") == content[::-1]
        set_start(made, "u_binary", content.hex())
        assert exact(made, "u_binary") == content
    finally:
        made.free()


@pytest.mark.compiler
def test_a_text_that_is_no_utf_8_survives_byte_by_byte(typed: Component) -> None:
    """Old FMUs write Latin-1: what comes out of one goes into the next unchanged."""
    set_start(typed, "u_string", b"Z\xfcrich".decode("utf-8", "surrogateescape"))
    begin(typed)
    assert exact(typed, "y_string").encode("utf-8", "surrogateescape") == b"Z\xfcrich!"


@pytest.mark.compiler
def test_a_text_with_a_zero_character_is_refused_not_cut(typed: Component) -> None:
    with pytest.raises(RunError, match="holds a zero character, which ends a text in C"):
        set_start(typed, "u_string", "a\0b")


@pytest.mark.compiler
def test_numbers_of_all_types_are_read_and_written_as_doubles(typed3: Component) -> None:
    """Mixed in one call, in an order that has nothing to do with the types."""
    begin(typed3)
    kinds = ["int8", "float64", "boolean", "uint16", "float32", "enumeration", "uint64", "int32", "float64"]
    stated_values = [-5.0, 0.1, 1.0, 65535.0, 0.5, 2.0, 2.0**40, -(2.0**31), 0.1]
    write, buffer = typed3.writer([f"u_{kind}" for kind in kinds])
    buffer[:] = stated_values
    write()
    assert read(typed3, [f"u_{kind}" for kind in kinds]) == stated_values
    back = read(typed3, [f"y_{kind}" for kind in kinds])
    assert back == [-6.0, 1.1, 0.0, 65534.0, 1.5, 3.0, 2.0**40 + 1.0, -(2.0**31) + 1.0, 1.1]


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("name", "value"),
    [("int8", 128.0), ("uint8", -1.0), ("uint32", 2.0**32), ("int32", float("nan")), ("int64", float("inf"))],
)
def test_a_number_that_a_type_cannot_hold_is_refused_not_wrapped(typed3: Component, name: str, value: float) -> None:
    begin(typed3)
    write, buffer = typed3.writer([f"u_{name}"])
    buffer[0] = value
    with pytest.raises(RunError, match=f"writing u_{name} failed"):
        write()


class Sloppy:
    """A library whose truth is 2."""

    dll, component, fmiCallLogger = object(), None, None

    def __init__(self) -> None:
        kinds = ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint32), ctypes.c_size_t, ctypes.POINTER(ctypes.c_int)
        self._function = ctypes.CFUNCTYPE(ctypes.c_int, *kinds)(self._get)
        self._function.argtypes = kinds
        self._functions = {"fmi2GetBoolean": self._function}

    def _get(self, _component: Any, _references: Any, count: int, values: Any) -> int:
        for i in range(count):
            values[i] = 2 * i
        return 0

    def fmi2GetBoolean(self, *arguments: Any) -> int:
        return int(self._function(*arguments))


def test_a_slave_may_say_truth_with_any_number() -> None:
    flags = [variable(name, "output", i, "Boolean") for i, name in enumerate("abc")]
    values = np.zeros(3)
    make_port(Sloppy(), 2, "Get", flags, values)()
    assert values.tolist() == [0.0, 1.0, 1.0]
    assert make_exact_reader(Sloppy(), 2, flags[0])() == (False,)


# -- arrays
# -------------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
def test_elements_are_named_from_one_and_lie_row_by_row(typed3: Component) -> None:
    assert [e.name for e in typed3.elements("u_matrix")] == [f"u_matrix[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]
    assert [e.index for e in typed3.elements("u_matrix")] == list(range(6))
    assert [e.name for e in typed3.elements("u_matrix[ 2, 1 ]")] == ["u_matrix[2,1]"]
    assert typed3.elements("u_float64")[0].index is None
    names = typed3.names("output")
    assert "y_matrix[2,3]" in names
    assert "y_pair_boolean[2]" in names
    assert not {"y_string", "y_binary", "y_pair_string[1]", "y_matrix"} & set(names)


@pytest.mark.compiler
def test_matrices_are_written_and_read_in_order(typed3: Component) -> None:
    begin(typed3)
    names = [e.name for e in typed3.elements("u_matrix")]
    write, buffer = typed3.writer(names)
    buffer[:] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    write()
    rows = [buffer.tolist()[:3], buffer.tolist()[3:]]
    assert exact(typed3, "y_matrix") == np.ravel(expected("u_matrix", rows)).tolist()
    assert read(typed3, ["y_matrix[2,1]", "y_float64", "y_matrix[1,3]"]) == [25.0, 1.0, 16.0]


@pytest.mark.compiler
def test_a_single_element_leaves_the_others_as_they_are(typed3: Component) -> None:
    set_start(typed3, "u_matrix", [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    set_start(typed3, "u_matrix[2,2]", 50.0)
    begin(typed3)
    write, buffer = typed3.writer(["u_matrix[2,3]", "u_vector[1]", "u_matrix[1,1]"])
    buffer[:] = [60.0, 7.0, 10.0]
    write()
    assert exact(typed3, "u_matrix") == [10.0, 2.0, 3.0, 4.0, 50.0, 60.0]
    assert exact(typed3, "u_vector") == [7.0, 0.0, 0.0]


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("pair_int64", [2**63 - 1, -(2**63)]),
        ("pair_uint64", [2**64 - 1, 2**53 + 1]),
        ("pair_boolean", [True, False]),
        ("pair_string", ["ü", ""]),
        ("pair_binary", [b"\0\xff", b""]),
        ("pair_float32", [0.5, -2.0]),
    ],
)
def test_arrays_of_every_type_take_start_values(typed3: Component, name: str, value: Any) -> None:
    assert name in ARRAYS
    set_start(typed3, f"u_{name}", value)
    assert exact(typed3, f"u_{name}") == value
    assert exact(typed3, f"y_{name}") == expected(f"u_{name}", value)
    set_start(typed3, f"u_{name}[2]", value[0])
    assert exact(typed3, f"u_{name}") == [value[0], value[0]]


@pytest.mark.compiler
def test_a_structural_parameter_chooses_the_shape(typed3: Component, files: dict[int, Path]) -> None:
    for n in (1, LONGEST, 2):
        set_start(typed3, "n", n)
        assert typed3.variables["u_matrix"].shape == (2, n)
        assert exact(typed3, "n") == n
        values = list(range(2 * n))
        set_start(typed3, "u_matrix", values)
        assert exact(typed3, "y_matrix") == np.ravel(expected("u_matrix", [values[:n], values[n:]])).tolist()
    configured = load_fmu(files[3], "typed")
    start_values(configured, {"u_float64": 1.0, "n": 5})
    assert len(configured.elements("y_vector")) == 5
    configured.instantiate()
    assert exact(configured, "n") == 5
    configured.reset()
    assert exact(configured, "n") == 5  # a reset slave has its declared shapes, the component still has those asked for
    configured.free()


@pytest.mark.compiler
def test_a_shape_the_slave_refuses_is_an_error(typed3: Component) -> None:
    with pytest.raises(RunError, match=f"setting n = {LONGEST + 1} in Configuration Mode failed"):
        set_start(typed3, "n", LONGEST + 1)
    with pytest.raises(CouplingError, match=r"typed.n: expected a whole number for a UInt64 \(got 2.5\)"):
        set_start(typed3, "n", 2.5)


@given(shape=st.lists(st.integers(1, 4), min_size=1, max_size=3), data=st.data())
def test_a_layout_finds_every_element_again(shape: list[int], data: st.DataObject) -> None:
    """Whatever is picked, in whatever order, from several variables: the positions are those of NumPy's row-major
    arrays.
    """
    array, scalar = variable("a", "input", 1, "Float64", shape=tuple(shape)), variable("s", "input", 2, "Float64")
    everything = [*elements_of(array), *elements_of(scalar)]
    picked = data.draw(st.lists(st.sampled_from(everything), min_size=1, unique=True))
    spread = layout(picked)
    flat = np.concatenate(
        [np.arange((v.shape and np.prod(v.shape)) or 1) + 100 * (v is scalar) for v in spread.variables]
    )
    numbers = np.arange(np.prod(shape)).reshape(shape)
    for element, position in zip(picked, spread.positions, strict=True):
        indices = [int(i) - 1 for i in element.name[2:-1].split(",")] if element.index is not None else []
        assert flat[position] == (numbers[tuple(indices)] if indices else 100)
    assert spread.is_partial == (len(picked) < spread.total)
    assert spread.is_whole == (spread.positions.tolist() == list(range(spread.total)))


# -- what is refused
# ----------------------------------------------------------------------------------------------------


class Kinds(Mock):
    inputs: ClassVar[dict[str, Any]] = {"x": 0.0}

    def more_variables(self) -> list[Any]:
        kinds = (
            ["Int32", "Boolean", "String", "Binary", "UInt8"] if self.version == 3 else ["Integer", "Boolean", "String"]
        )
        return [variable(kind.lower(), "parameter", 20 + i, kind) for i, kind in enumerate(kinds)] + [
            variable("table", "parameter", 40, "Float64" if self.version == 3 else "Real", shape=(2, 2))
        ]


class Kinds2(FMI2, Kinds):
    """The same with an FMI 2 interface."""


@pytest.mark.parametrize(
    ("name", "value", "match"),
    [
        ("x", "fast", r"expected a number, or a list of numbers for a vector \(got 'fast'\)"),
        ("int32", 2.5, r"expected a whole number for a Int32 \(got 2.5\)"),
        ("boolean", 2, r"expected true or false for a Boolean \(got 2\)"),
        ("string", 1.0, r"expected a text for a String \(got 1.0\)"),
        ("binary", "0g", r"expected bytes or a hexadecimal text such as '00ff' for a Binary \(got '0g'\)"),
        (
            "table",
            [1.0, 2.0, 3.0],
            r"expected 4 values for a Float64 array of shape \(2, 2\) \(got 3 in shape \(3,\)\)",
        ),
        ("table", [[1.0, 2.0, 3.0, 4.0]], r"expected 4 values .* \(got 4 in shape \(1, 4\)\)"),
        ("table", [[1.0], [2.0, 3.0, 4.0]], "expected rows of equal length"),
    ],
)
def test_a_value_of_another_type_is_refused_with_what_was_expected(name: str, value: Any, match: str) -> None:
    made = component(Kinds())
    made.instantiate()
    with pytest.raises(CouplingError, match=f"mock.{name}: {match}"):
        set_start(made, name, value)


def test_one_value_fills_an_array_and_lists_may_be_nested_or_flat() -> None:
    made = component(Kinds())
    assert start_values(made, {"table": 3}) == {"table": [3.0] * 4}
    for written in ([1, 2, 3, 4], [[1, 2], [3, 4]], np.array([[1.0, 2.0], [3.0, 4.0]])):
        assert start_values(made, {"table": written}) == {"table": [1.0, 2.0, 3.0, 4.0]}


def test_an_item_goes_by_its_name_or_its_number(typed3: Component) -> None:
    for value in (MOODS[1], 2, 2.0):
        set_start(typed3, "u_enumeration", value)
        assert exact(typed3, "u_enumeration") == 2
    with pytest.raises(CouplingError, match=r"typed.u_enumeration: no item 'cam'; did you mean 'calm'\?$"):
        set_start(typed3, "u_enumeration", "cam")


@pytest.mark.parametrize("slave", [Kinds(), Kinds2()])
def test_python_slaves_have_equal_types(slave: Mock) -> None:
    made = component(slave)
    made.instantiate()
    values = {"x": 0.5, "boolean": True, "string": "ü"}
    for name, value in values.items():
        set_start(made, name, value)
        assert slave.v[name] == value
        assert exact(made, name) == value


def test_a_value_that_a_slave_gives_beside_its_type_comes_through_as_it_is() -> None:
    """An old slave gives bytes for a text, or none."""

    class Loose(Kinds):
        def getString(self, references: Any, nValues: int | None = None) -> list[Any]:
            return [{20: None}.get(r, "Straße".encode()) for r in references]

    made = component(Loose())
    made.instantiate()
    assert exact(made, "string") == "Straße"

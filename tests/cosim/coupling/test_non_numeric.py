"""What travels between components besides numbers: arrays, texts, bytes and integers that doubles cannot hold."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import prepare, run
from mock_slaves import FMI2, Mock, component, variable
from test_fmus.typed import SCALARS, expected, typed_fmu

from cosim.components.component import Component
from cosim.components.loading import load_fmu
from cosim.coupling.connection import connect
from cosim.errors import CouplingError, RunError
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.master import close
from cosim.master.system import System

LONG = {
    "string": "Zürich, Straße, 渋谷",
    "binary": b"\0\xff\0",
    "int64": 2**63 - 4,
    "uint64": 2**64 - 6,
    "pair_int64": [2**53 + 1, -(2**63)],
    "pair_uint64": [2**64 - 1, 2**53 + 1],
    "pair_string": ["ü", ""],
    "pair_binary": [b"\0", b""],
}
"""Values that doubles cannot hold."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    return {version: typed_fmu(tmp_path_factory.mktemp("typed"), version=version) for version in (1, 2, 3)}  # type: ignore[arg-type]


def both(files: dict[int, Path], first: int = 3, second: int = 3) -> list[Component]:
    return [load_fmu(files[first], "one"), load_fmu(files[second], "two")]


def exact(made: Component, name: str) -> Any:
    values = made.exact_reader(name)()
    return list(values) if made.variables[name].shape else values[0]


# -- connections that fit
# -------------------------------------------------------------------------------------------------


@pytest.mark.compiler
def test_whole_arrays_are_joined_element_by_element(files: dict[int, Path]) -> None:
    parts = both(files)
    made = connect([("one.y_matrix", "two.u_matrix")], {c.name: c for c in parts})
    assert [str(c) for c in made] == [
        f"one.y_matrix[{i},{j}] -> two.u_matrix[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)
    ]
    assert made[0].source_variable == ("one", "y_matrix")
    assert made[0].target_variable == ("two", "u_matrix")
    assert not any(c.exact for c in made)
    rows = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    ran = run(parts, [("one.y_matrix", "two.u_matrix")], 0.1, 3, starts={"one": {"u_matrix": rows}})
    twice = expected("u_matrix", expected("u_matrix", rows))
    for i in (0, 1):
        for j in (0, 1, 2):
            np.testing.assert_array_equal(ran[f"two.y_matrix[{i + 1},{j + 1}]"], twice[i][j])


@pytest.mark.compiler
def test_elements_are_joined_with_elements_and_scalars(files: dict[int, Path]) -> None:
    pairs = [
        ("one.y_vector[3]", "two.u_vector[1]"),
        ("one.y_vector[1]", "two.u_float64"),
        ("one.y_float32", "two.u_matrix[2,2]"),
    ]
    ran = run(both(files), pairs, 0.1, 2, starts={"one": {"u_vector": [10.0, 20.0, 30.0]}, "two": {"u_vector": 7.0}})
    assert [ran[f"two.y_vector[{i}]"][-1] for i in (1, 2, 3)] == [33.0 + 1.0, 7.0 + 2.0, 7.0 + 3.0]
    assert ran["two.y_float64"][-1] == 12.0
    assert ran["two.y_matrix[2,2]"][-1] == 1.0 + 22.0


@pytest.mark.compiler
def test_what_no_double_holds_arrives_bit_for_bit(files: dict[int, Path]) -> None:
    """Through two FMUs that both twist it, over the initial exchange and some steps."""
    parts = both(files)
    pairs = [(f"one.y_{name}", f"two.u_{name}") for name in LONG]
    master = prepare(parts, pairs, 0.1, 3, starts={"one": {f"u_{name}": value for name, value in LONG.items()}})
    try:
        master.run()
        for name, value in LONG.items():
            assert exact(parts[1], f"u_{name}") == expected(f"u_{name}", value)
            assert exact(parts[1], f"y_{name}") == expected(f"u_{name}", expected(f"u_{name}", value))
    finally:
        close(master.plan)


@pytest.mark.compiler
@pytest.mark.parametrize(("first", "second"), [(1, 2), (2, 3), (3, 1)])
def test_texts_pass_between_the_versions(files: dict[int, Path], first: int, second: int) -> None:
    parts = both(files, first, second)
    master = prepare(parts, [("one.y_string", "two.u_string")], 0.1, 2, starts={"one": {"u_string": "Köln"}})
    try:
        master.run()
        assert exact(parts[1], "y_string") == "Köln!!"
    finally:
        close(master.plan)


@pytest.mark.compiler
def test_elements_without_a_source_keep_what_they_are(files: dict[int, Path]) -> None:
    parts = both(files)
    pairs = [("one.y_pair_string[1]", "two.u_pair_string[2]"), ("one.y_int64", "two.u_pair_int64[1]")]
    starts = {
        "one": {"u_pair_string": ["a", "b"], "u_int64": 2**60},
        "two": {"u_pair_string": ["x", "y"], "u_pair_int64": [1, 2]},
    }
    master = prepare(parts, pairs, 0.1, 2, starts=starts)
    try:
        master.run()
        assert exact(parts[1], "u_pair_string") == ["x", "b"]
        assert exact(parts[1], "u_pair_int64") == [2**60 + 1, 2]
    finally:
        close(master.plan)


@pytest.mark.compiler
def test_the_shape_asked_for_counts_not_the_declared_one(files: dict[int, Path]) -> None:
    parts = both(files)
    for made in parts:
        made.configure({"n": 2})
    starts = {name: {"n": 2} for name in ("one", "two")}
    ran = run(parts, [("one.y_vector", "two.u_vector")], 0.1, 1, starts=starts)
    assert [ran[f"two.y_vector[{i}]"][-1] for i in (1, 2)] == [2.0, 4.0]
    different = both(files)
    different[0].configure({"n": 2})
    with pytest.raises(
        CouplingError, match=r"one.y_vector is an array of shape \(2,\), two.u_vector is an array of shape \(3,\)"
    ):
        connect([("one.y_vector", "two.u_vector")], {c.name: c for c in different})


# -- the types of both ends
# -----------------------------------------------------------------------------------------------

FLOATS = {"Float64", "Float32"}
TEXTS = {"String", "Binary"}


@pytest.mark.compiler
@pytest.mark.parametrize("target", SCALARS)
@pytest.mark.parametrize("source", SCALARS)
def test_which_types_fit(described: dict[str, Component], source: str, target: str) -> None:
    """Numbers among one another, but nothing with a fraction into something without; texts and bytes to themselves
    only.
    """
    fits = source == target if {source, target} & TEXTS else not (source in FLOATS and target not in FLOATS)
    pair = [(f"one.y_{source.lower()}", f"two.u_{target.lower()}")]
    if not fits:
        with pytest.raises(
            CouplingError, match=f"one.y_{source.lower()} is a {source}, two.u_{target.lower()} is a {target}; "
        ):
            connect(pair, described)
        return
    long = {"Int64", "UInt64", "Enumeration"}
    assert connect(pair, described)[0].exact == (source in TEXTS or {source, target} <= long)


@pytest.fixture(scope="module")
def described(files: dict[int, Path]) -> dict[str, Component]:
    from cosim.components.loading import describe_fmu

    return {name: describe_fmu(files[3], name) for name in ("one", "two")}


# -- loops, copies, mocks
# ---------------------------------------------------------------------------------------------------


class Parrot(Mock):
    """Says at a step what it was told before, and an x more."""

    memory = ("v", "x", "time")
    first = "start"

    def more_variables(self) -> list[Any]:
        return [variable("heard", "input", 1, "String"), variable("said", "output", 2, "String")]

    def begin(self) -> None:
        self.v |= {"heard": "never", "said": self.first}
        self.x: dict[str, Any] = {}

    def move(self, t: float, h: float) -> None:
        self.v["said"] = self.v["heard"] + "x"


class Parrot2(FMI2, Parrot):
    """The same with an FMI 2 interface."""

    first: ClassVar[str] = "second"  # type: ignore[misc]


def test_in_a_loop_a_text_is_held_over_the_step_like_a_number() -> None:
    """Gauss-Seidel: the first hears what the second said a step before, the second what the first says now."""
    slaves = [Parrot(), Parrot2()]
    parts = [component(slave, name) for slave, name in zip(slaves, ("a", "b"), strict=True)]
    master = prepare(parts, [("a.said", "b.heard"), ("b.said", "a.heard")], 1.0, 2)
    master.run()
    assert [slave.v["said"] for slave in slaves] == ["secondxxx", "secondxxxx"]
    assert slaves[0].v["heard"] == "secondxx"


def test_a_text_that_several_hear_means_one_instant() -> None:
    """One is stepped before the source, one after it: both hear what was said at the start of the step."""
    slaves = {name: Parrot() for name in ("before", "source", "after")}
    parts = [component(slave, name) for name, slave in slaves.items()]
    pairs = [("source.said", "before.heard"), ("source.said", "after.heard"), ("before.said", "source.heard")]
    master = prepare(parts, pairs, 1.0, 3, order=("before", "source", "after"))
    master.run()
    assert slaves["before"].v["heard"] == slaves["after"].v["heard"] != slaves["source"].v["said"]


def test_before_anything_was_read_inputs_keep_their_start_values() -> None:
    """The first exchange of a loop has nothing to pass on yet; None must not reach a slave."""

    class Strict(Parrot):
        def setString(self, references: Iterable[int], values: Iterable[Any]) -> None:
            stated = list(values)
            assert all(isinstance(value, str) for value in stated)
            super()._set(references, stated)

    parts = [component(Strict(), name) for name in "ab"]
    prepare(parts, [("a.said", "b.heard"), ("b.said", "a.heard")], 1.0, 1).run()


def test_a_restored_system_has_its_texts_back() -> None:
    slaves = [Parrot(), Parrot2()]
    parts = [component(slave, name) for slave, name in zip(slaves, ("a", "b"), strict=True)]
    master = prepare(parts, [("a.said", "b.heard"), ("b.said", "a.heard")], 1.0, 1)
    master.run()
    system = System(master.plan, GaussSeidel(master.plan))
    kept = system.save()
    seen = []
    for _ in range(3):
        system.advance(1.0, 2.0)
        seen.append([slave.v["said"] for slave in slaves] + master.plan.non_numeric.tolist())
        system.restore(kept)
    assert seen[0] == seen[1] == seen[2] == ["secondxxx", "secondxxxx", "secondxxxx", "secondxxx"]
    system.release(kept)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_too_few_or_too_many_values_of_a_slave_are_an_error_not_a_shift(count: int) -> None:
    class Wrong(Mock):
        def more_variables(self) -> list[Any]:
            return [variable("table", "output", 1, "Float64", shape=(3,))]

        def getFloat64(self, references: Any, nValues: int | None = None) -> list[float]:
            return [1.0] * count

    with pytest.raises(RunError, match=rf"reading table\[1\], .* failed: getFloat64 gave {count} values, expected 3"):
        run([component(Wrong(), "wrong")], [], 1.0, 1)

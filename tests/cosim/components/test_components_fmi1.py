"""FMI 1.0 slaves: a life without Initialization Mode, aliases with the other sign, refused steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import prepare, run
from fmpy.fmi1 import FMICallException
from mock_slaves import Mock, read
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu
from test_fmus.typed import typed_fmu

from cosim.components.component import Component
from cosim.components.loading import FMI1Component, describe_fmu, load_fmu
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.errors import RunError
from fmus.fmi.described import EventPort

LAG: dict[str, Any] = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.5]]}


def lag(folder: Path, name: str = "lag", **more: Any) -> Component:
    return load_fmu(linear_fmu(folder, name, **LAG, version=1, inputs=["u"], outputs=["y"], **more), name)


@pytest.mark.compiler
def test_a_whole_life_follows_the_closed_form(tmp_path: Path) -> None:
    """x' = u - x, y = x + u / 2, started at 3, then the held inputs 1 and -2: exact, so only rounding is left."""
    made = lag(tmp_path)
    made.instantiate()
    made.set_start("x0[1]", 3.0)
    made.enter_initialization(1.0, 10.0)
    write, u = made.writer(["u"])
    u[0] = 1.0
    write()
    # as set, and the output's declared start: nothing can be read yet
    assert read(made, ["u", "x0[1]", "y"]) == [1.0, 3.0, 0.0]
    made.exit_initialization()
    assert read(made, ["y"]) == [3.5]
    made.advance(1.0, 1.4)
    x = 1.0 + 2.0 * np.exp(-0.4)
    np.testing.assert_allclose(read(made, ["y"]), x + 0.5, rtol=1e-14)
    u[0] = -2.0
    write()
    made.advance(1.4, 1.5)
    np.testing.assert_allclose(read(made, ["y"]), (x + 2.0) * np.exp(-0.1) - 3.0, rtol=1e-14)
    assert (made.time, made.calls, made.fmi_version, made.can_save) == (1.5, 2, 1, False)
    made.reset()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    assert read(made, ["y"]) == [0.0]  # back to the declared start of the state and of the input
    made.terminate()
    made.free()


@pytest.mark.compiler
def test_coupled_with_fmi_2_and_3_the_order_of_versions_changes_nothing(tmp_path: Path) -> None:
    """A chain of three equal lags; the states of the first of them are all that the versions could treat
    differently.
    """
    results = []
    for k, versions in enumerate([(1, 2, 3), (3, 2, 1), (1, 1, 1), (3, 3, 3)]):
        parts = [
            load_fmu(
                linear_fmu(
                    tmp_path, f"c{k}_{i}", **LAG | {"D": [[0.0]]}, version=v, x0=[1.0], inputs=["u"], outputs=["y"]
                ),
                f"c{i}",
            )
            for i, v in enumerate(versions)
        ]
        results.append(run(parts, [("c0.y", "c1.u"), ("c1.y", "c2.u")], 0.1, 20)["c2.y"])
    for other in results[1:]:
        np.testing.assert_array_equal(other, results[0])


@pytest.mark.compiler
def test_aliases_are_one_value_and_negated_ones_have_the_other_sign(tmp_path: Path) -> None:
    made = load_fmu(typed_fmu(tmp_path, version=1), "typed")
    assert made.negated == {"y_negated", "u_negated"}
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    write, values = made.writer(["u_negated", "u_float64", "u_boolean"])
    values[:] = [2.0, 0.5, 1.0]
    write()
    assert read(made, ["w", "u_negated", "u_float64"]) == [-2.0, 2.0, 0.5]  # before the slave is initialised as well
    made.exit_initialization()
    assert read(made, ["y_negated", "y_equal", "y_float64", "w", "u_negated"]) == [-1.5, 1.5, 1.5, -2.0, 2.0]
    assert [made.exact_reader(name)() for name in ("y_negated", "w", "u_negated")] == [(-1.5,), (-2.0,), (2.0,)]
    made.exact_writer("u_negated")([-7.0])
    assert read(made, ["w", "u_negated"]) == [7.0, -7.0]
    made.free()


@pytest.mark.compiler
def test_a_negated_start_value_and_a_negated_source(tmp_path: Path) -> None:
    path = typed_fmu(tmp_path, version=1)
    parts = [load_fmu(path, "one"), load_fmu(path, "two")]
    ran = run(
        parts,
        [("one.y_negated", "two.u_float64")],
        0.1,
        2,
        starts={"one": {"u_float64": 4.0, "u_negated": 3.0}},
        extra={"one": ["w"]},
    )
    np.testing.assert_array_equal(ran["two.y_float64"], -4.0)  # -(4 + 1) + 1
    np.testing.assert_array_equal(ran["one.w"], -3.0)


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("behaviour", "message"),
    [
        (
            "discard",
            r"t = 0.2 s: doStep was discarded: asked for 0.3 s, it came to 0.25 s. The FMU says: a step of 0.1 s over",
        ),
        ("discard-silently", r"t = 0.2 s: doStep was discarded: asked for 0.3 s, it does not say how far it came"),
        ("waits", r"t = 0.2 s: doStep returned before it was done \(status pending\), as canRunAsynchronuously allows"),
        ("fails", r"t = 0.2 s: doStep failed: .*status 3 \(error\)"),
        ("dies", r"t = 0.2 s: doStep failed: .*status 4 \(fatal\)"),
    ],
)
def test_refused_steps_say_what_happened_and_keep_the_results(tmp_path: Path, behaviour: Any, message: str) -> None:
    """With fmpy's own slave a status other than OK is taken for an address, and the process dies."""
    master = prepare([load_fmu(awkward_fmu(tmp_path, behaviour, version=1), "awkward")], [], 0.1, 10)
    with pytest.raises(RunError, match=f"Component 'awkward' at {message}"):
        master.run()
    assert master.recorder.table()["time"].tolist() == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.compiler
def test_a_warning_passes(tmp_path: Path) -> None:
    ran = run(
        [load_fmu(awkward_fmu(tmp_path, "warns", version=1), "awkward")], [], 0.1, 5, starts={"awkward": {"u": 2.0}}
    )
    np.testing.assert_allclose(ran["awkward.y"], 2.0 * ran["time"], rtol=1e-14)


@pytest.mark.compiler
def test_declared_dependencies_are_read(tmp_path: Path) -> None:
    """A lag with and one without direct feedthrough, and one that says nothing."""
    through, held = (
        lag(tmp_path, "through"),
        describe_fmu(linear_fmu(tmp_path, "held", **LAG | {"D": [[0.0]]}, version=1), "held"),
    )
    silent = describe_fmu(linear_fmu(tmp_path, "silent", **LAG, version=1, declare_dependencies=False), "silent")
    dependencies = [
        None if (d := c.description.outputs[0].dependencies) is None else [v.name for v in d]
        for c in (through, held, silent)
    ]
    assert dependencies == [["u"], [], None]
    through.free()
    both = {"a": describe_fmu(tmp_path / "through.fmu", "a"), "b": describe_fmu(tmp_path / "through.fmu", "b")}
    (group,) = execution_groups(both, connect([("a.y", "b.u"), ("b.y", "a.u")], both))
    assert [set(loop.components) for loop in group.algebraic] == [{"a", "b"}]


class Old(Mock):
    """An FMI 1.0 slave in Python."""

    version = 1
    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

    def initialize(self, tStart: float = 0.0, stopTime: float | None = None) -> None:
        self.time = tStart

    def doStep(self, t: float, h: float, newStep: Any) -> None:  # type: ignore[override]
        super().doStep(t, h)


def test_what_fmi_1_does_not_have_is_said() -> None:
    slave = Old()
    made = FMI1Component("old", slave, slave.model_description)
    assert made.capabilities.canGetAndSetFMUState  # the mock says so
    assert not made.can_save
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()

    def notify(event: EventPort) -> None:
        made.notify(event, 0.0, 0.0, {})

    event = EventPort("balise", 1, None, {})
    calls = {
        "save its state": made.save,
        "restore a state": lambda: made.restore(None),
        "takes no events": lambda: notify(event),
    }
    for words, call in calls.items():
        with pytest.raises(RunError, match=f"Component 'old' at t = 0 s: an FMI 1.0 slave .*{words}"):
            call()


def test_a_slave_that_is_not_initialised_says_so() -> None:
    class Refusing(Old):
        def initialize(self, tStart: float = 0.0, stopTime: float | None = None) -> None:
            raise FMICallException("fmi1InitializeSlave", 3)

    slave = Refusing()
    made = FMI1Component("old", slave, slave.model_description)
    made.instantiate()
    made.enter_initialization(0.5, 1.0)
    with pytest.raises(RunError, match=r"Component 'old' at t = 0.5 s: fmiInitializeSlave failed"):
        made.exit_initialization()

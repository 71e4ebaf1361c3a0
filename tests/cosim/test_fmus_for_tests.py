"""The test FMUs themselves: fmpy finds no fault in them, and stepped alone by plain fmpy they equal their closed
forms.
"""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import block_diag, expm
from scipy.signal import lsim
from test_fmus import events as ev
from test_fmus.build import DEFAULTS, SOURCES, config_header, linear_fmu
from test_fmus.drive import Plain, plain
from test_fmus.masses import CONVERGENT, DIVERGENT, Chain, Cut, Loop, cuts
from test_fmus.typed import ARRAYS, LONGEST, SCALARS, expected, typed_fmu

from fmus.toolchain.compile import find_compiler, header_folder
from plant_models.hybrid import Runtime

EXACT = 1e-12
"""Matrix exponentials of order-one matrices over tens of steps, twice: rounding only."""

A = [[0.0, 1.0, 0.0], [-4.0, -0.5, 1.0], [0.3, 0.0, -2.0]]
B = [[0.0, 0.2], [1.0, 0.0], [0.0, 1.0]]
C = [[1.0, 0.0, 0.0], [0.5, -1.0, 2.0]]
D = [[0.0, 0.0], [0.7, 0.0]]
START = (1.0, -0.5, 0.25)
H = 0.05


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("test_fmus")


def linear(folder: Path, name: str, version: Any, **further: Any) -> Path:
    return linear_fmu(
        folder, name, A, B, C, D, version=version, inputs=["f", "g"], outputs=["p", "q"], x0=START, **further
    )


# -- what fmpy says
# -------------------------------------------------------------------------------------------------------

HONEST: dict[str, Callable[[Path], Path]] = {
    **{
        f"linear{v}": lambda f, v=v: linear(  # type: ignore[misc]
            f,
            f"linear{v}",
            v,
            units={"f": "N", "p": "km/h", "q": "degC"},
            input_derivatives=True,
            output_derivatives=True,
            directional=True,
            inner_instants=2,
            early=True,
            once_per_process=True,
            needs_tool=True,
        )
        for v in (1, 2, 3)
    },
    **{f"typed{v}": lambda f, v=v: typed_fmu(f, f"typed{v}", version=v) for v in (1, 2, 3)},  # type: ignore[misc]
    "periodic": ev.periodic_fmu,
    "triggered": ev.triggered_fmu,
    "receiver": ev.receiver_fmu,
    "timed": ev.timed_fmu,
    "integrator": ev.integrator_fmu,
    "countdown": ev.countdown_fmu,
    "ping": lambda f: ev.bouncing_pair(f)[0],
    "clockless": lambda f: ev.triggered_fmu(f, "clockless", event_mode=False),
    "old_receiver": lambda f: ev.receiver_fmu(f, "old_receiver", version=1),
    "waiting": lambda f: ev.awkward_fmu(f, "waits", "waiting", version=2),
}


@pytest.mark.parametrize("name", list(HONEST))
def test_fmpy_finds_no_fault(name: str, folder: Path) -> None:
    assert validate_fmu(str(HONEST[name](folder))) == []


def test_the_sources_compile_without_warnings(folder: Path) -> None:
    numbers = dict.fromkeys(("NX", "NU", "NY"), 1) | dict.fromkeys(("A", "B", "C", "D", "X0", "U0"), (1.0,))
    others = {
        "INTERVAL": 0.1,
        "SHIFT": 0.0,
        "LEVEL_START": 1.0,
        "JUMPS": 1,
        "INSTANTS": (1.0,),
        "LEVELS": (1.0,),
        "FIRST_LEVEL": 1.0,
        "DELAY_START": 1.0,
        "ARM_START": 1.0,
        "KICK_START": 1.0,
        "ADD_START": 1.0,
        "LIMIT_START": 1.0,
        "AT": 1.0,
        "W": 1.0,
        "MIDDLE": 0.0,
        "USUAL_TOLERANCE": 1e-4,
        "FINEST": 0.0,
        "FORGETS": False,
        "LONGEST_STEP": 1.0,
        "EVERY": 1.0,
        "INNER_LINEAR": 0,
        "CAN_RETURN_EARLY": 1,
    }
    defines = DEFAULTS | numbers | others
    flags = [
        "-std=c11",
        "-fsyntax-only",
        "-Werror",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Wno-sign-conversion",
        "-Wshadow",
    ]
    for version in (1, 2, 3):
        for source in sorted(SOURCES.glob("*.c")):
            can = {key: source.name == "linear.c" for key in DEFAULTS if key.startswith("HAS_")}
            for behaviour in range(1, 14) if source.name == "awkward.c" else (0,):
                place = folder / f"warnings_{version}_{source.stem}_{behaviour}"
                place.mkdir()
                here = {"HAS_EVENT_MODE": version == 3, "BEHAVIOUR": behaviour, "INNER_INSTANTS": 2 * (version == 3)}
                (place / "config.h").write_text(config_header(defines | can | here, version, "model", "token"))
                command = [*find_compiler().command, *flags, f"-I{place}", f"-I{header_folder()}", str(source)]
                done = subprocess.run(command, capture_output=True, text=True, check=False)
                assert done.returncode == 0, f"{source.name}, FMI {version}: {done.stderr}"


# -- linear systems
# -------------------------------------------------------------------------------------------------------


def inputs_at(k: int) -> tuple[float, float]:
    return float(np.sin(0.7 * k)), float(np.cos(0.3 * k))


def outputs_of(instance: Plain) -> list[float]:
    return [instance.get("p"), instance.get("q")]


@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_linear_system_with_held_inputs_is_exact(version: Any, folder: Path) -> None:
    count = 40
    u = np.array([inputs_at(k) for k in range(count + 1)])
    with plain(linear(folder, f"held{version}", version)) as one:
        one.initialize()
        seen = []
        for k in range(count):
            one.set("f", u[k, 0])
            one.set("g", u[k, 1])
            one.step(H * (k + 1))
            seen.append([one.get(f"x[{i}]") for i in (1, 2, 3)])
    _, _, states = lsim((A, B, C, D), u, H * np.arange(count + 1), START, interp=False)
    np.testing.assert_allclose(seen, states[1:], rtol=0, atol=EXACT)


@pytest.mark.parametrize("version", [1, 2])
def test_a_linear_system_with_input_derivatives_is_exact(version: Any, folder: Path) -> None:
    count = 30
    u = np.array([inputs_at(k) for k in range(count + 1)])
    with plain(linear(folder, f"sloped{version}", version, input_derivatives=True)) as one:
        one.initialize()
        seen = []
        # fmpy's method for FMI 1 calls another
        set_slopes = one.slave._functions[f"fmi{version}SetRealInputDerivatives"]
        for k in range(count):
            one.set("f", u[k, 0])
            one.set("g", u[k, 1])
            assert set_slopes(one.slave.component, uints(1, 2), 2, ints(1, 1), doubles(*(u[k + 1] - u[k]) / H)) == 0
            one.step(H * (k + 1))
            seen.append(outputs_of(one))
        assert set_slopes(one.slave.component, uints(3), 1, ints(1), doubles(0.0)) == 3  # an output has none
        assert set_slopes(one.slave.component, uints(1), 1, ints(2), doubles(0.0)) == 3
    _, outputs, _ = lsim((A, B, C, D), u, H * np.arange(count + 1), START, interp=True)
    np.testing.assert_allclose(seen, outputs[1:], rtol=0, atol=EXACT)


@pytest.fixture(scope="module")
def held_linear(folder: Path) -> Iterator[Plain]:
    with plain(linear(folder, "split", 2)) as one:
        yield one


@given(st.lists(st.sampled_from([0.1, 0.1 + 1e-9, 0.1 + 1e-5]) | st.floats(1e-3, 0.3), min_size=1, max_size=12))
def test_splitting_a_step_changes_nothing(held_linear: Plain, steps: list[float]) -> None:
    one = held_linear
    ends = np.cumsum(steps)
    seen = []
    for points in (ends, ends[-1:]):
        one.slave.reset()
        one.initialize(f=0.7, g=-1.2)
        for t in points:
            one.step(float(t))
        seen.append([one.get(f"x[{i}]") for i in (1, 2, 3)])
    np.testing.assert_allclose(seen[0], seen[1], rtol=0, atol=EXACT)


def uints(*values: int) -> Any:
    return (ctypes.c_uint * len(values))(*values)


def ints(*values: int) -> Any:
    return (ctypes.c_int * len(values))(*values)


def doubles(*values: float) -> Any:
    return (ctypes.c_double * len(values))(*values)


@pytest.mark.parametrize("linear_between", [False, True])
def test_intermediate_update_asks_at_its_instants_and_is_exact_in_between(linear_between: bool, folder: Path) -> None:
    instants, count = 3, 10
    pieces = instants if linear_between else instants + 1
    asked: list[float] = []

    def provide(_environment: Any, t: float, requested: bool, *_others: Any) -> None:
        assert requested
        asked.append(t)
        one.set("f", np.sin(t))

    fmu = linear(folder, f"asking{linear_between:d}", 3, inner_instants=instants, inner_linear=linear_between)
    with plain(fmu, intermediate=provide) as one:
        one.initialize()
        for k in range(count):
            one.set("f", np.sin(one.time))
            one.step(0.2 * (k + 1))
        seen = outputs_of(one)
    grid = 0.2 / pieces * np.arange(count * pieces + 1)
    inner = grid[1:] if linear_between else [t for i, t in enumerate(grid) if i % pieces]
    np.testing.assert_allclose(asked, inner, rtol=0, atol=1e-14)
    u = np.column_stack([np.sin(grid), np.zeros_like(grid)])
    _, _, states = lsim((A, B, C, D), u, grid, START, interp=linear_between)
    last = np.asarray(C) @ states[-1] + np.asarray(D) @ u[-1 if linear_between else -2]
    np.testing.assert_allclose(seen, last, rtol=0, atol=EXACT)


def test_intermediate_update_returns_early_where_asked(folder: Path) -> None:
    def stop(_e: Any, t: float, _r: bool, _g: bool, _f: bool, can_return: bool, requested: Any, when: Any) -> None:
        assert can_return
        requested[0], when[0] = t > 0.1, 0.17

    with plain(linear(folder, "stopping", 3, inner_instants=3, early=True), intermediate=stop) as one:
        one.initialize()
        assert one.step(0.2)[2:] == (True, 0.17)  # asked at 0.05, 0.1, 0.15
        np.testing.assert_allclose(one.get("x[1]"), (expm(np.array(A) * 0.17) @ START)[0], rtol=0, atol=EXACT)


@pytest.mark.parametrize("version", [2, 3])
def test_a_restored_state_goes_on_bit_for_bit(version: Any, folder: Path) -> None:
    with plain(linear(folder, f"saved{version}", version)) as one:
        one.initialize()
        one.set("f", 0.3)
        one.run(0.2, H)
        slave, v2 = one.slave, version == 2
        saved = slave.getFMUstate() if v2 else slave.getFMUState()
        content = slave.serializeFMUstate(saved) if v2 else slave.serializeFMUState(saved)
        one.run(0.5, H)
        first = outputs_of(one)
        for again in (saved, slave.deSerializeFMUstate(content) if v2 else slave.deserializeFMUState(content)):
            (slave.setFMUstate if v2 else slave.setFMUState)(again)
            one.time = 0.2
            one.run(0.5, H)
            assert outputs_of(one) == first
            (slave.freeFMUstate if v2 else slave.freeFMUState)(again)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_derivatives_of_outputs_are_those_of_the_matrices(version: Any, folder: Path) -> None:
    fmu = linear(folder, f"derived{version}", version, output_derivatives=True, directional=True)
    with plain(fmu) as one:
        one.initialize(f=0.4, g=-0.2)
        rates = one.slave.getRealOutputDerivatives if version < 3 else one.slave.getOutputDerivatives
        assert rates([3, 4], [1, 1]) == pytest.approx(
            np.array(C) @ (np.array(A) @ START + np.array(B) @ [0.4, -0.2]), abs=EXACT
        )
        if version > 1:
            columns = [one.slave.getDirectionalDerivative([3, 4], [j], [1.0]) for j in (1, 2)]
            assert np.transpose(columns).tolist() == D


def test_outputs_follow_inputs_at_once_or_are_frozen_between_steps(folder: Path) -> None:
    with plain(linear(folder, "at_once", 2)) as live, plain(linear(folder, "frozen", 2, frozen_outputs=True)) as frozen:
        for one in (live, frozen):
            one.initialize()
            one.step(H)
        before = live.get("q")
        assert frozen.get("q") == before
        for one in (live, frozen):
            one.set("f", 2.0)
        assert live.get("q") == pytest.approx(before + 0.7 * 2.0, abs=EXACT)
        assert frozen.get("q") == before
        for one in (live, frozen):
            one.step(2 * H)
        assert live.get("q") == frozen.get("q")


@pytest.mark.parametrize("version", [1, 2, 3])
def test_misuse_is_refused_and_said(version: Any, folder: Path) -> None:
    with plain(linear(folder, f"strict{version}", version)) as one:
        for wrong in (lambda: one.slave.doStep(0.0, H), lambda: one.set("p", 1.0)):
            with pytest.raises(FMICallException):
                wrong()
        one.initialize(**{"x0[1]": 0.5})
        assert one.get("x[1]") == 0.5
        for wrong in (
            lambda: one.slave.doStep(1.0, H),
            lambda: one.slave.doStep(0.0, 0.0),
            lambda: one.set("x0[1]", 1.0),
        ):
            with pytest.raises(FMICallException):
                wrong()
        assert len(one.log) == 5
        assert {category for _, category, _ in one.log} == {"logStatusError"}
        one.slave.reset()
        one.initialize()
        assert one.get("x[1]") == START[0]


# -- masses
# ---------------------------------------------------------------------------------------------------------------

CHAINS = {"two": Chain.two(0.4), "three": Chain.three(0.3), "conservative": Chain.three()}
CUTS = [(chain, cut) for chain in CHAINS for cut in cuts(CHAINS[chain])]


def closed(cut: Cut) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """State matrix of the connected parts, their outputs from the states, and the names of the outputs."""
    parts = list(cut.parts.values())
    a, b, c, d = (block_diag(*(getattr(p, m) for p in parts)) for m in "ABCD")
    u = [f"{p.name}.{v}" for p in parts for v in p.inputs]
    y = [f"{p.name}.{v}" for p in parts for v in p.outputs]
    wires = np.array([[float(f"{source} -> {target}" in cut.connections) for source in y] for target in u]).reshape(
        len(u), len(y)
    )
    assert (wires.sum(axis=1) == 1).all()  # every input is connected, once
    outputs = np.linalg.solve(np.eye(len(y)) - d @ wires, c)
    return a + b @ wires @ outputs, outputs, y


@pytest.mark.parametrize(("chain", "name"), CUTS)
def test_every_cut_is_the_whole_once_connected(chain: str, name: str) -> None:
    whole, cut = CHAINS[chain], cuts(CHAINS[chain])[name]
    matrix, outputs, names = closed(cut)
    start = np.concatenate([p.x0 for p in cut.parts.values()])
    times = [0.0, 0.3, 2.0]
    reference = whole.reference(times)
    for k, t in enumerate(times):
        values = dict(zip(names, outputs @ expm(matrix * t) @ start, strict=True))
        for quantity, signal in cut.signals.items():
            assert values[signal] == pytest.approx(reference[quantity][k], abs=1e-12)


def test_energy_is_kept_without_dampers_and_lost_with_them() -> None:
    times = np.linspace(0.0, 5.0, 11)
    energy = CHAINS["conservative"].reference(times).energy
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)
    assert (np.diff(CHAINS["two"].reference(times).energy) < 0.0).all()


@pytest.mark.parametrize("name", ["force-displacement", "inertial"])
def test_the_parts_as_fmus_and_as_systems_agree(name: str, folder: Path) -> None:
    cut = cuts(CHAINS["two"])[name]
    fmus, systems = cut.fmus(folder / name, version=2), cut.systems(internal_step=1e-3)
    for part in cut.parts.values():
        runtime = Runtime(systems[part.name])
        runtime.u[:] = np.arange(1.0, len(part.inputs) + 1.0)
        runtime.start(0.0)
        runtime.advance(0.2)
        with plain(fmus[part.name]) as one:
            one.initialize(**{v: float(i) for i, v in enumerate(part.inputs, start=1)})
            one.step(0.2)
            seen = [one.get(v) for v in part.outputs]
        # RK4 at 1 ms: (w h)^5 / 120 a step, w = 5.5 rad/s, 200 steps, times derivatives and forces of order 100
        np.testing.assert_allclose(runtime.update_outputs(), seen, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("loop", "converges"), [(CONVERGENT, True), (DIVERGENT, False)])
def test_the_loop_without_states_has_its_solution(loop: Loop, converges: bool, folder: Path) -> None:
    fmus = loop.fmus(folder / f"loop{converges}", version=2)
    with plain(fmus["first"]) as first, plain(fmus["second"]) as second:
        first.initialize()
        second.initialize()
        distances = []
        for _ in range(60):
            second.set("u", first.get("y"))
            first.set("u", second.get("y"))
            distances.append(abs(first.get("y") - loop.solution[0]))
        assert distances[3] / distances[2] == pytest.approx(abs(loop.gain))
        assert (distances[-1] < 1e-12) is converges
        second.set("u", loop.solution[0])
        assert second.get("y") == pytest.approx(loop.solution[1], abs=1e-12)


# -- types
# ----------------------------------------------------------------------------------------------------------------

VALUES: dict[str, Any] = {
    "Float64": 0.1,
    "Float32": 0.25,
    "Int8": -128,
    "UInt8": 255,
    "Int16": -32768,
    "UInt16": 65535,
    "Int32": -(2**31),
    "UInt32": 2**32 - 1,
    "Int64": -(2**63),
    "UInt64": 2**64 - 1,
    "Boolean": True,
    "String": "Zug fährt übers Gleis",
    "Binary": b"\x00a\x00\xffb",
    "Enumeration": 3,
}


@pytest.mark.parametrize("version", [1, 2, 3])
def test_every_type_comes_back_with_its_twist(version: Any, folder: Path) -> None:
    with plain(typed_fmu(folder, f"echo{version}", version=version)) as one:
        one.initialize()
        for kind in SCALARS:
            name = kind.lower()
            if f"u_{name}" in one.variables:
                value = VALUES[kind]
                one.set(f"u_{name}", value)
                assert one.get(f"y_{name}") == expected(f"u_{name}", value), kind
        one.step(H)
        assert one.get("y_float64") == VALUES["Float64"] + 1.0
        if version == 1:
            one.set("u_negated", 2.0)  # as the bare slave sees it: signs are the importer's business
            assert [one.get("w"), one.get("y_equal"), one.get("y_negated")] == [2.0, 1.1, 1.1]


def test_arrays_come_back_with_their_twist(folder: Path) -> None:
    vector, matrix = [0.5, 1.5, 2.5], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    with plain(typed_fmu(folder)) as one:
        one.initialize()
        one.set("u_vector", vector)
        one.set("u_matrix", np.ravel(matrix).tolist())
        assert one.get("y_vector") == expected("u_vector", vector)
        assert one.get("y_matrix") == np.ravel(expected("u_matrix", matrix)).tolist()
        for name, (kind, _) in ARRAYS.items():
            if name.startswith("pair_"):
                pair = {"String": ["", "ä"], "Binary": [b"", b"\x00\x01"], "Boolean": [True, False]}.get(
                    kind, [VALUES[kind], 7]
                )
                one.set(f"u_{name}", pair)
                assert one.get(f"y_{name}") == expected(f"u_{name}", pair), kind


@pytest.mark.parametrize("length", [1, 5, LONGEST])
def test_a_structural_parameter_changes_the_length(length: int, folder: Path) -> None:
    with plain(typed_fmu(folder)) as one:
        one.slave.enterConfigurationMode()
        one.set("n", length)
        one.slave.exitConfigurationMode()
        one.initialize()
        assert (one.shape("u_vector"), one.shape("y_matrix")) == ((length,), (2, length))
        values = np.arange(2.0 * length).reshape(2, length)
        one.set("u_matrix", values.ravel().tolist())
        assert one.get("y_matrix") == np.ravel(expected("u_matrix", values.tolist())).tolist()
        with pytest.raises(FMICallException):
            one.set("u_vector", [0.0] * (length + 1))


# -- events
# ---------------------------------------------------------------------------------------------------------------


def test_a_periodic_clock_samples_at_its_instants(folder: Path) -> None:
    with plain(ev.periodic_fmu(folder)) as one:
        one.initialize()
        with one.event():
            assert one.interval("tick") == (0.03, 1)
        for k, t in enumerate(ev.periodic_ticks(0.2), start=1):
            one.step(t)
            one.set("u", np.sin(t))
            one.slave.enterEventMode()
            one.tick("tick")
            during = [one.get(name) for name in ("count", "when", "sample")]
            one.settle()
            one.slave.enterStepMode()
            after = [one.get(name) for name in ("count", "when", "sample")]
            assert during == after == [k, t, np.sin(t)]
        assert k == 7


@pytest.mark.parametrize("version", [2, 3])
def test_without_event_mode_the_samples_come_at_communication_points(version: Any, folder: Path) -> None:
    with plain(ev.periodic_fmu(folder, f"sampled{version}", version=version, event_mode=False)) as one:
        one.initialize()
        one.run(0.2, 0.04)
        assert one.get("count") == len(ev.periodic_ticks(0.2))
        assert one.get("when") == pytest.approx(0.2, abs=1e-12)
        assert ev.periodic_ticks(0.2)[-1] == pytest.approx(0.19)


def received(folder: Path, kind: str) -> tuple[float, float]:
    """Integral of a receiver behind a ramp at 1 s, steps of 0.1 s: with clocks; and the last time of crossing seen."""
    exact, clocks = kind == "exact", kind != "none"
    source_fmu = ev.triggered_fmu(folder, f"source_{kind}", event_mode=clocks, early=exact)
    with plain(source_fmu) as source, plain(ev.receiver_fmu(folder, f"sink_{clocks:d}", event_mode=clocks)) as sink:
        source.initialize()
        sink.initialize()
        for k in range(10):
            point = 0.1 * (k + 1)
            while source.time < point - 1e-12:
                needed = source.step(point)[0]
                sink.step(source.time)
                if needed:
                    with source.event(), sink.event():
                        assert source.ticks("crossing")
                        sink.tick("tick")
                        sink.set("tick_value", source.get("crossing_value"))
                elif not clocks:
                    sink.set("tick_value", source.get("crossing_value"))
        return sink.get("integral"), source.get("when")


def test_a_triggered_clock_ticks_at_the_crossing_and_its_listener_integrates_exactly(folder: Path) -> None:
    exact, last = received(folder, "exact")
    assert exact == pytest.approx(ev.received_integral(1.0), abs=1e-12)
    assert last == pytest.approx(ev.crossing_times(1.0)[-1], abs=1e-15)
    late = ev.LEVEL * sum(1.0 - np.ceil(t * 10.0) / 10.0 for t in ev.crossing_times(1.0))
    for loss in ("late", "none"):  # a communication point too late at every crossing
        assert received(folder, loss)[0] == pytest.approx(late, abs=1e-12)
    assert ev.received_integral(1.0) - late > 0.01


def test_a_clocked_input_wants_its_clock(folder: Path) -> None:
    with plain(ev.receiver_fmu(folder)) as one:
        one.initialize()
        one.step(H)
        with pytest.raises(FMICallException):
            one.set("tick_value", 1.0)  # step mode
        with one.event(), pytest.raises(FMICallException):
            one.set("tick_value", 1.0)  # event mode, clock not active


@pytest.mark.parametrize("announced", [True, False])
def test_time_events_come_at_their_instants(announced: bool, folder: Path) -> None:
    with plain(ev.timed_fmu(folder)) as one, plain(ev.integrator_fmu(folder)) as sum_:
        one.initialize()
        sum_.initialize(u=one.get("level"))
        seen = []
        for k in range(10):
            point = 0.1 * (k + 1)
            while one.time < point - 1e-12:
                needed, _, early, _ = one.step(min(point, one.next_event) if announced else point)
                assert early is (not announced and one.time < point)  # what is announced needs no early return
                sum_.step(one.time)
                if needed:
                    seen.append(one.time)
                    with one.event():
                        pass
                    with sum_.event():
                        sum_.set("u", one.get("level"))
            assert one.get("level") == ev.timed_level(point)
            assert sum_.get("integral") == pytest.approx(ev.timed_integral(point), abs=1e-12)
        assert seen == pytest.approx(ev.INSTANTS, abs=1e-15)
        assert (sum_.get("changes"), one.get("jumps")) == (4, 4)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_time_events_without_event_mode_come_late(version: Any, folder: Path) -> None:
    source = ev.timed_fmu(folder, f"late{version}", version=version, event_mode=False)
    with (
        plain(source) as one,
        plain(ev.integrator_fmu(folder, f"sum{version}", version=version, event_mode=False)) as sum_,
    ):
        one.initialize()
        sum_.initialize(u=one.get("level"))
        for k in range(10):
            one.step(0.1 * (k + 1))
            sum_.step(one.time)
            sum_.set("u", one.get("level"))
        seen = np.ceil(np.array(ev.INSTANTS) * 10.0 - 1e-9) / 10.0
        assert sum_.get("integral") == pytest.approx(ev.timed_integral(1.0, seen), abs=1e-12)
        assert abs(ev.timed_integral(1.0, seen) - ev.timed_integral(1.0)) > 0.05


@pytest.mark.parametrize("repeat", [False, True])
def test_a_countdown_clock_rings_after_its_delay(repeat: bool, folder: Path) -> None:
    with plain(ev.countdown_fmu(folder)) as one:
        one.initialize(repeat=repeat)
        due, rung = np.inf, []
        for k in range(10):
            point = 0.1 * (k + 1)
            while one.time < point - 1e-12:
                needed = one.step(min(point, one.next_event, due))[0]
                ring = abs(one.time - due) < 1e-12
                if needed or ring:
                    one.slave.enterEventMode()
                    if ring:
                        one.tick("alarm")
                        rung.append(one.time)
                    one.settle()
                    interval, qualifier = one.interval("alarm")
                    due = {0: np.inf, 1: due, 2: one.time + interval}[qualifier]
                    assert one.interval("alarm")[1] in (0, 1)  # a change is said once
                    one.slave.enterStepMode()
        assert rung == pytest.approx(ev.alarm_times(1.0, repeat=repeat), abs=1e-14)
        assert (one.get("alarms"), one.get("when"), one.get("armed")) == (len(rung), rung[-1], repeat)


def test_a_countdown_clock_is_armed_by_its_start_clock(folder: Path) -> None:
    with plain(ev.countdown_fmu(folder, "armed", arm_time=-1.0)) as one:
        one.initialize(delay=0.05)
        one.step(0.1)
        with one.event():
            assert one.interval("alarm")[1] == 0
            one.tick("start")
            one.settle()
            assert one.interval("alarm") == (0.05, 2)
        assert one.get("armed") is True


@pytest.mark.parametrize(("rounds", "settles"), [(1, True), (5, True), (ev.NEVER_SETTLES, False)])
def test_a_bouncing_pair_settles_after_its_rounds(rounds: float, settles: bool, folder: Path) -> None:
    ping_fmu, pong_fmu = ev.bouncing_pair(folder / f"rounds{rounds:g}", rounds)
    with plain(ping_fmu) as ping, plain(pong_fmu) as pong:
        ping.initialize()
        pong.initialize()
        assert ping.step(0.2) == (True, False, True, ev.KICK_TIME)
        pong.step(ev.KICK_TIME)
        for one in (ping, pong):
            one.slave.enterEventMode()
        used = 0
        for _ in range(20):
            ping.settle()
            if pong.get("y") == ping.get("y"):
                break
            used += 1
            pong.set("u", ping.get("y"))
            pong.settle()
            ping.set("u", pong.get("y"))
        if settles:
            assert used == ping.get("changes") == pong.get("changes") == rounds
            assert ping.get("y") == pong.get("y") == rounds
        else:
            assert used == 20


# -- awkward
# --------------------------------------------------------------------------------------------------------------


def awkward(folder: Path, behaviour: Any, version: Any, **further: Any) -> Path:
    return ev.awkward_fmu(folder, behaviour, f"{behaviour.replace('-', '_')}{version}", version=version, **further)


def test_quitting(folder: Path) -> None:
    with plain(awkward(folder, "quit", 3)) as one:
        one.initialize()
        assert one.step(0.2)[1] is False
        assert one.step(0.4) == (False, True, True, 0.25)
        assert one.get("y") == pytest.approx(0.25)
    with plain(awkward(folder, "quit-in-event", 3)) as one:
        one.initialize()
        assert one.step(0.4) == (True, False, True, 0.25)
        one.slave.enterEventMode()
        assert one.slave.updateDiscreteStates()[1] is True
    with plain(awkward(folder, "quit", 2)) as one:
        one.initialize()
        one.step(0.2)
        with pytest.raises(FMICallException, match="discard"):
            one.step(0.4)
        assert (one.slave.getBooleanStatus(3), one.slave.getRealStatus(2), one.get("y")) == (
            True,
            0.25,
            pytest.approx(0.25),
        )


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("behaviour", ["discard", "discard-silently"])
def test_discarding(version: Any, behaviour: Any, folder: Path) -> None:
    with plain(awkward(folder, behaviour, version)) as one:
        one.initialize()
        one.step(0.2)
        with pytest.raises(FMICallException, match="discard"):
            one.step(0.3)
        assert one.log[-1][0] == 2
        reports = behaviour == "discard" and version < 3
        if reports:
            last = one.slave.getRealStatus(2)
            assert (last.value if version == 1 else last) == 0.25
        elif version < 3:
            with pytest.raises(FMICallException):
                one.slave.getRealStatus(2)
        one.time = 0.25 if reports else 0.2
        for t in np.arange(one.time + 0.025, 0.31, 0.025):  # short steps pass
            one.step(t)
        assert one.get("y") == pytest.approx(0.3)


def test_coming_short(folder: Path) -> None:
    with plain(awkward(folder, "short", 3)) as one:
        one.initialize()
        assert one.step(0.1) == (False, False, True, 0.04)
    with plain(awkward(folder, "own-steps", 3)) as one:
        one.initialize()
        assert one.step(0.1) == (False, False, False, pytest.approx(0.08))
        assert one.get("y") == pytest.approx(0.08)
    with plain(awkward(folder, "short", 2)) as one:
        one.initialize()
        one.step(0.1)
        assert one.get("y") == pytest.approx(0.04)  # and nobody is told


@pytest.mark.parametrize("version", [1, 2, 3])
def test_chattering_in_categories(version: Any, folder: Path) -> None:
    with plain(awkward(folder, "chatty", version), logging=True) as one:
        one.initialize()
        one.run(1.0, 0.1)
        said = ev.chatter(1.0)
        assert [entry[:2] for entry in one.log] == [(status, category) for _, status, category, _ in said]
        if version == 3:
            assert [text for _, _, text in one.log] == [text for *_, text in said]
        assert len(said) == 8
    if version > 1:
        with plain(awkward(folder, "chatty", version), logging=True) as one:
            one.slave.setDebugLogging(True, ["logStatusWarning"])
            one.initialize()
            one.run(1.0, 0.1)
            assert {category for _, category, _ in one.log} == {"logStatusWarning"}
            with pytest.raises(FMICallException):
                one.slave.setDebugLogging(True, ["logNothing"])


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize(("behaviour", "status"), [("warns", 1), ("fails", 3), ("dies", 4)])
def test_status_codes(version: Any, behaviour: Any, status: int, folder: Path) -> None:
    with plain(awkward(folder, behaviour, version)) as one:
        one.initialize()
        if status == 1:
            one.step(0.3)
            assert one.get("y") == pytest.approx(0.3)
            return
        with pytest.raises(FMICallException) as caught:
            one.step(0.3)
        assert caught.value.status == status
        assert "the solver gave up" in one.log[-1][2]


def test_pending(folder: Path) -> None:
    for version in (1, 2):
        with plain(awkward(folder, "waits", version)) as one:
            one.initialize()
            with pytest.raises(FMICallException) as caught:
                one.step(0.3)
            assert caught.value.status == 5

"""Directional derivatives of FMUs and blocks: exact, linear, the same everywhere, and refused by name where there are
none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange
from fmpy.fmi1 import FMICallException
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped import shipped

from fmu_observer.block import make_block
from fmu_observer.description import can_exchange
from fmus import RECIPES
from plant_models.hybrid import HybridSystem, TracedSystem, output_signal, scalar_names, state

pytestmark = pytest.mark.compiler

SMALL = ("oscillator", "slider", "sampler", "tracker", "gain")
EXCHANGED = (*SMALL, *(n for n in RECIPES if can_exchange(shipped(n))))
POINTS = settings(max_examples=6, deadline=None, derandomize=True)
RAW = {2: "Real", 3: "Float64"}


class Kinked(HybridSystem):
    """A root at its end, where it has no derivative, and a whole number among the outputs."""

    name = "kinked"
    states = (state("level", "m"),)
    outputs = (
        output_signal("root_of_level", "m"),
        output_signal("count", "1", variability="discrete", integer=True),
    )

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"level": 1.0}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"root_of_level": np.sqrt(x.level), "count": np.floor(t)}


def _names(system: HybridSystem) -> tuple[list[str], list[str]]:
    """Real unknowns and knowns that the model exchange instance may set one after the other."""
    unknowns = [name for s in system.outputs if not s.integer for name in s.scalar_names]
    unknowns += [f"der({name})" for name in scalar_names(system.states)[: system.continuous_count]]
    return unknowns, ["time", *scalar_names(system.inputs), *scalar_names(system.states)[: system.continuous_count]]


def _derivative(one: Any, unknowns: list[str], knowns: list[str], seed: list[float]) -> np.ndarray:
    """Of a `Component`, an `Exchange` or a block."""
    if isinstance(one, Exchange):
        slave, by_name = one.model, one.by_name
    elif hasattr(one, "slave"):
        slave, by_name = one.slave, one.by_name
    else:
        slave, by_name = one, {v.name: v for v in one.model_description.modelVariables}
    references = [[by_name[name].valueReference for name in names] for names in (unknowns, knowns)]
    return np.array(slave.getDirectionalDerivative(*references, seed))


def _point(system: HybridSystem, draw: Callable[[], float]) -> dict[str, float]:
    """Starts away from kinks: everything moves forward, nothing is at a limit."""
    size = {"effort": 2.0e4, "force": 4.0, "wheel_rate": 20.0, "signal": 12.0}
    names = [*scalar_names(system.inputs), *scalar_names(system.states)[: system.continuous_count]]
    starts = {name: size.get(name, 9.0) * (1.0 + 0.05 * draw()) for name in names}
    filtered = [name for name in names if name.startswith(("filter_", "filtered_slip"))]
    # below the limit of 0.02 at which indicators switch
    return starts | {name: 0.015 + 0.004 * draw() for name in filtered}


def _values_at(one: Exchange, unknowns: list[str], values: dict[str, float], states: list[str]) -> np.ndarray:
    one.set_state(values["time"], np.array([values[name] for name in states]))
    inputs = {name: value for name, value in values.items() if name != "time" and name not in states}
    one.set(**inputs)
    return one.get(*unknowns)


@pytest.mark.each_kind
@pytest.mark.parametrize("name", EXCHANGED)
def test_they_are_the_limits_of_central_differences(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    system, one = reference(name).system, exchange(name, version)
    unknowns, knowns = _names(system)
    states = list(scalar_names(system.states)[: system.continuous_count])
    one.initialize(**_point(system, lambda: 0.0))

    def around(values: dict[str, float], seed: dict[str, float], step: float) -> np.ndarray:
        ends = [
            _values_at(one, unknowns, {k: values[k] + s * step * seed[k] for k in knowns}, states) for s in (1.0, -1.0)
        ]
        return (ends[0] - ends[1]) / (2.0 * step)

    @POINTS
    @given(data=st.data())
    def law(data: st.DataObject) -> None:
        draw = lambda: data.draw(st.floats(-1.0, 1.0))  # noqa: E731
        values = _point(system, draw) | {"time": 0.321}
        seed = {known: max(abs(values[known]), 0.1) * draw() for known in knowns}
        centre = np.abs(_values_at(one, unknowns, values, states))
        exact = _derivative(one, unknowns, knowns, [seed[k] for k in knowns])
        # A central difference with step s is wrong by rounding, eps |f| / s, and by a term of order s^2, or of order s
        # where a second derivative jumps. Either is at most what the differences with the steps s and 2 s differ by.
        # With s = eps^(1/3) all of them are small.
        step = np.finfo(float).eps ** (1.0 / 3.0)
        difference, wider = around(values, seed, step), around(values, seed, 2.0 * step)
        allowed = 20.0 * np.finfo(float).eps * (centre + np.abs(difference) + 1.0) / step * _terms(system)
        allowed += 1.1 * np.abs(wider - difference)
        assert np.all(np.abs(exact - difference) <= allowed), (exact, difference, allowed)

    law()


def _terms(system: HybridSystem) -> float:
    """How much larger than its result a term inside a model can be, by which rounding goes: forces and masses of a
    train.
    """
    return 100.0 if system.name in RECIPES else 1.0


@pytest.mark.each_kind
@pytest.mark.parametrize("name", EXCHANGED)
def test_every_known_has_the_column_of_the_jacobian(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    """Against CasADi's own Jacobians of the traced functions, at a point where everything moves."""
    system = reference(name).system
    traced, one = TracedSystem(system), exchange(name, version)
    point = _point(system, lambda: 0.4)
    one.initialize(0.25, **point)
    x, p = one.get(*scalar_names(system.states)), one.get(*scalar_names(system.parameter_signals))
    u = np.concatenate([one.get(*_exposed(system)), np.zeros(sum(s.width for s in system.noises))])
    # a count has none
    places = [i for i, s in enumerate(s for s in system.outputs for _ in range(s.width)) if not s.integer]
    rows, columns = (
        [scalar_names(system.outputs)[i] for i in places],
        {"x": scalar_names(system.states), "u": _exposed(system)},
    )
    columns |= {"t": ["time"], "p": scalar_names(system.parameter_signals)}
    for group, names in columns.items():
        jacobian = np.asarray(traced.jacobian("output", group)(0.25, x, u, p), dtype=float)
        jacobian = jacobian.reshape(len(scalar_names(system.outputs)), -1)[places]
        for k, known in enumerate(names):
            got = _derivative(one, rows, [known], [1.0])
            # the same graph differentiated forward and by columns: sums in another order, eps times the largest summand
            scale = max(float(np.abs(jacobian).max(initial=0.0)), 1.0)
            np.testing.assert_allclose(got, jacobian[:, k], rtol=1e-12, atol=1e-13 * scale, err_msg=known)


def _exposed(system: HybridSystem) -> list[str]:
    payloads = [s for event in system.triggered_events for s in event.payload]
    return list(scalar_names((*system.inputs, *payloads)))


@pytest.mark.parametrize("name", ["oscillator", "locomotive", "takagi_sugeno_cdo"])
def test_they_are_linear_in_the_seed(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    system, one = reference(name).system, exchange(name, version)
    unknowns, knowns = _names(system)
    one.initialize(**_point(system, lambda: 0.3))
    columns = np.array([_derivative(one, unknowns, [known], [1.0]) for known in knowns]).T
    seeds = st.lists(st.floats(-10.0, 10.0), min_size=len(knowns), max_size=len(knowns)).map(np.array)

    @POINTS
    @given(a=seeds, b=seeds, factor=st.floats(-10.0, 10.0))
    def law(a: np.ndarray, b: np.ndarray, factor: float) -> None:
        together = _derivative(one, unknowns, knowns, list(a + factor * b))
        apart = [_derivative(one, unknowns, knowns, list(s)) for s in (a, b)]
        size = np.abs(columns) @ (np.abs(a) + abs(factor) * np.abs(b))  # of the summands, which rounding goes by
        assert np.all(np.abs(together - (apart[0] + factor * apart[1])) <= 1e-13 * (size + 1.0))

    law()


@pytest.mark.parametrize("name", EXCHANGED)
def test_block_and_both_kinds_of_fmu_agree_to_the_bit(
    name: str,
    version: int,
    exchange: Callable[..., Exchange],
    component: Callable[..., Any],
    reference: Callable[[str], Any],
) -> None:
    system = reference(name).system
    unknowns, knowns = _names(system)
    knowns += [*scalar_names(system.states)[system.continuous_count :], *scalar_names(system.parameter_signals)]
    point, seed = _point(system, lambda: -0.7), [0.1 * (k + 1) for k in range(len(knowns))]
    exchanged, stepped = exchange(name, version), component(name, version)
    block: Any = make_block(system, version)  # type: ignore[arg-type]
    exchanged.initialize(**point)
    stepped.initialize(**point)
    references = {v.name: v.valueReference for v in block.model_description.modelVariables}
    getattr(block, f"set{RAW[version]}")([references[k] for k in point], list(point.values()))
    block.enterInitializationMode()
    block.exitInitializationMode()
    results = [_derivative(one, unknowns, knowns, seed) for one in (exchanged, stepped, block)]
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[1], results[2])
    assert np.isfinite(results[0]).all()
    assert np.any(results[0] != 0.0)


def test_friction_is_held_as_it_is(version: int, exchange: Callable[..., Exchange]) -> None:
    moving, resting = exchange("slider", version), exchange("slider", version)
    moving.initialize(speed=0.5)
    resting.initialize(speed=0.0, force=0.2)
    knowns, unknowns = ["force", "grip"], ["der(speed)"]
    assert _derivative(moving, unknowns, knowns, [1.0, 0.0]).tolist() == [0.5]  # 1 / mass
    assert _derivative(moving, unknowns, knowns, [0.0, 1.0]).tolist() == [-0.5]
    assert _derivative(resting, unknowns, knowns, [1.0, 1.0]).tolist() == [0.0]


def test_a_known_that_comes_twice_counts_twice(version: int, component: Callable[..., Any]) -> None:
    one = component("gain", version)
    one.initialize()
    assert _derivative(one, ["twice"], ["force", "time", "force"], [1.0, 0.5, 3.0]).tolist() == [8.5]
    assert _derivative(one, ["twice"], [], []).tolist() == [0.0]
    assert _derivative(one, [], ["force"], [1.0]).tolist() == []


@pytest.mark.parametrize("kind", ["co-simulation", "block"])
def test_what_is_no_unknown_or_no_known_is_refused_by_name(
    version: int, kind: str, component: Callable[..., Any], reference: Callable[[str], Any]
) -> None:
    if kind == "block":
        one: Any = make_block(reference("tracker").system, version)  # type: ignore[arg-type]
        one.enterInitializationMode()
        one.exitInitializationMode()
    else:
        one = component("tracker", version)
        one.initialize()
    trigger = "balise_count" if version == 2 else "balise"
    cases = [
        ("position", "odometer", "position"),
        ("gain", "odometer", "gain"),
        ("position_out", "position_out", "position_out"),
        ("position_out", "der(speed)", "der(speed)"),
        ("position_out", "balise_time", "balise_time"),
        ("position_out", trigger, trigger),
        ("position_out", "late_policy", "late_policy"),
    ]
    for unknown, known, named in cases:
        with pytest.raises(FMICallException) as refused:
            _derivative(one, [unknown], [known], [1.0])
        message = one.log[-1] if kind == "co-simulation" else str(refused.value)
        assert f"{named} (value reference " in message
        assert "expected" in message


def test_lengths_are_checked(component: Callable[..., Any]) -> None:
    one = component("gain", 3)
    one.initialize()
    force, twice = one.references(["force"]), one.references(["twice"])
    for arguments in ((twice, force, [1.0, 2.0]), (twice, force, []), (twice, force, [1.0], 2)):
        with pytest.raises(FMICallException):
            one.slave.getDirectionalDerivative(*arguments)
    assert "seeds" in one.log[-1]


def test_they_exist_from_initialization_mode_on(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("gain", version)
    with pytest.raises(FMICallException):
        _derivative(one, ["twice"], ["force"], [1.0])
    if version == 2:
        one.model.setupExperiment(startTime=0.0)
    one.model.enterInitializationMode()
    assert _derivative(one, ["twice"], ["force"], [1.0]).tolist() == [2.0]
    one.model.exitInitializationMode()
    assert _derivative(one, ["twice"], ["force"], [1.0]).tolist() == [2.0]  # event mode
    one.update()
    one.model.terminate()
    assert _derivative(one, ["twice"], ["force"], [1.0]).tolist() == [2.0]


def test_where_the_equations_have_no_derivative_there_is_none(version: int, component: Callable[..., Any]) -> None:
    system = Kinked()
    one, block = component(system, version), make_block(system, version)  # type: ignore[arg-type]
    one.initialize()
    block.enterInitializationMode()
    for owner in (one, block):
        with pytest.raises(FMICallException):
            _derivative(owner, ["root_of_level"], ["level"], [1.0])
        with pytest.raises(FMICallException):
            _derivative(owner, ["count"], ["time"], [1.0])
    assert any("root_of_level is not a finite number" in line for line in one.log)
    one.step(0.0, 0.25)
    # 1 / (2 sqrt(1/4))
    assert _derivative(one, ["root_of_level"], ["level"], [1.0])[0] == pytest.approx(1.0, rel=1e-15)


def test_block_that_cannot_be_traced_has_none(version: int) -> None:
    class Untraceable(Kinked):
        """The same in Python that nobody can trace."""

        name, traceable = "untraceable", False

    block = make_block(Untraceable(), version)  # type: ignore[arg-type]
    assert not block.model_description.coSimulation.providesDirectionalDerivative
    block.enterInitializationMode()
    with pytest.raises(FMICallException, match="cannot be traced"):
        _derivative(block, ["root_of_level"], ["level"], [1.0])

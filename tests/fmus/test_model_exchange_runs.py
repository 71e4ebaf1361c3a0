"""Model exchange and co-simulation are two ways along one trajectory: they meet as the co-simulation's internal step
shrinks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer, Notified
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from shipped import shipped

from fmu_observer.block import make_block
from fmu_observer.description import can_exchange
from fmus import RECIPES, cached_fmu, recipe
from plant_models.hybrid import HybridSystem, scalar_names
from plant_models.railway.vehicle import Train

pytestmark = pytest.mark.compiler

SMALL = ("oscillator", "slider", "sampler", "tracker", "gain", "booster")
EXCHANGED = (*SMALL, *(name for name in RECIPES if can_exchange(shipped(name))))
"""Everything that has model exchange; the balise reader, which works on communication steps, has none."""

STEP, STEPS = 0.1, 10
EVENT_TIME = 0.337
"""Of the told events [s]: on no grid."""

ORDER = {"locomotive": 2, "train": 2, "slider": 2, "differentiator_cdo": 1}
ORDER |= {"levant_differentiator": 1, "filtering_differentiator": 1}
ORDER |= {"decaying_innovation": 2, "decaying_innovation_cdo": 2}
"""Of the internal method; 4 for the others. The differentiators' right-hand sides have roots and signs, which leaves
order 1; the second derivative of an innovation that ends jumps there, which leaves order 3, more or less by where in a
step.
"""

TOLERANCE = 1e-11
FLOOR = 2e-10
"""What the solver itself may be wrong by, relative: some tens of steps with local errors of `TOLERANCE`."""

AT_REST = {
    "gain",
    "inverter",
    "signal_fault",
    "state_feedback",
    "wind_turbine_controller",
    "culture_signature",
}  # what they tell follows inputs that are held, or samples of minutes
"""What they tell follows inputs that are held."""

FLOORS = {"decaying_innovation_cdo": 5e-9, "cart_double_pendulum": 1e-8, "three_state_cascade": 5e-8}
"""The same for what has a second derivative that jumps: the solver's estimate of its error takes it for smooth; for
what falls over, multiplying the error of every restart of the solver, one a sample; and for a third root through zero,
where no derivative exists.
"""

GAIN = 0.55
"""Share of the asymptotic gain of a halved step that must be seen: events cut internal steps, and the cuts fall
elsewhere. More than half tells an order from the one below."""

INPUTS = {"effort": 2.0e4, "force": 4.0, "load_torque": 0.02}
STARTS: Mapping[str, Mapping[str, float]] = {
    "dynamic_gain_cdo": {"odometer": 40.0},  # beyond the speed that a balise teaches: the slip bends where they meet
    "locomotive": {"train_speed": 10.0, "wheel_rate": 20.2},
    "wind_turbine": {  # samples that do not cut steps, a converter that the longest of them resolves
        "sample_period": 0.1,
        "converter_time": 0.2,
        "efficiency": 0.97,
        **{f"pitch_frequency[{i}]": 11.11 for i in (1, 2, 3)},
        **{f"pitch_damping[{i}]": 0.6 for i in (1, 2, 3)},
    },
    "train": {"brake_demand": 0.4, "elongation[1]": 0.002, **Train().rolling(10.0)},
}
PAYLOADS = {"balise": {"balise_position": 3.4}, "telegram": {"telegram_speed": 12.0, "telegram_weight": 0.3}}


def _starts(name: str, system: HybridSystem) -> dict[str, float]:
    inputs = {signal: INPUTS.get(signal, 9.0 + k) for k, signal in enumerate(scalar_names(system.inputs))}
    return inputs | dict(STARTS.get(name, {}))


def _reported(system: HybridSystem) -> list[Notified]:
    events = system.triggered_events
    return [Notified(EVENT_TIME, e.name, PAYLOADS.get(e.name, {s.name: 0.4 for s in e.payload})) for e in events]


def _values(description: Any) -> list[str]:
    """Names of the outputs and states."""
    exact = [v.name for v in description.modelVariables if v.causality == "local" and v.initial == "exact"]
    counts = ("Integer", "Int32")  # read by other functions
    return [v.name for v in description.modelVariables if v.causality == "output" and v.type not in counts] + exact


def _exchanged(model: Exchange, name: str, system: HybridSystem) -> np.ndarray:
    update = model.initialize(**_starts(name, system))
    solver = "Radau" if system.method == "rosenbrock" else "DOP853"
    importer = Importer(model, update, method=solver, rtol=TOLERANCE, atol=TOLERANCE)
    reported = _reported(system)
    for k in range(1, STEPS + 1):
        if reported and (k - 1) * STEP < EVENT_TIME <= k * STEP:
            importer.advance(EVENT_TIME)
            importer.happen(reported)
        importer.advance(k * STEP)
        importer.record(*_values(model.description))
    return importer.run.values()


def _cosimulated(made: Any, name: str, system: HybridSystem, factor: float) -> np.ndarray:
    made.initialize(**_starts(name, system), internal_step=system.internal_step * factor)
    rows = []
    for k in range(STEPS):
        if k * STEP < EVENT_TIME <= (k + 1) * STEP:
            for reported in _reported(system):
                made.event(reported.name, stamp=EVENT_TIME, **reported.payload)
        made.step(k * STEP, STEP)
        rows.append(made.get(*_values(made.description)))
    return np.array(rows)


@pytest.mark.parametrize("name", EXCHANGED)
def test_cosimulation_converges_to_model_exchange_at_its_order(
    name: str,
    version: int,
    exchange: Callable[..., Exchange],
    component: Callable[..., Any],
    reference: Callable[[str], Any],
) -> None:
    system = reference(name).system
    expected = _exchanged(exchange(name, version), name, system)
    size = np.maximum(np.abs(expected).max(axis=0), 1.0)
    errors = []
    for factor in (4.0, 2.0, 1.0):
        got = _cosimulated(component(name, version), name, system, factor)
        errors.append(float((np.abs(got - expected).max(axis=0) / size).max()))
    assert np.ptp(expected, axis=0).max() > 0.0 or name in AT_REST  # something moved
    gain = GAIN * 2.0 ** ORDER.get(name, 4)
    for coarse, fine in pairwise(errors):
        assert fine < max(coarse / gain, FLOORS.get(name, FLOOR)), errors


ROUGH = {"differentiator_cdo": 2e-3, "levant_differentiator": 2e-3, "filtering_differentiator": 2e-3, "train": 1e-4}
"""Relative: internal steps of differentiators are of order 1; 1e-7 m of elongation are 0.25 N of 14 kN in a coupler."""


@pytest.mark.each_kind
@pytest.mark.parametrize("name", EXCHANGED)
def test_fmpy_simulates_it_in_model_exchange(name: str, version: int, reference: Callable[[str], Any]) -> None:
    system = reference(name).system
    fmu = str(cached_fmu(system, version))  # type: ignore[arg-type]
    assert validate_fmu(fmu) == []
    common: dict[str, Any] = {"stop_time": 1.0, "output_interval": STEP, "start_values": _starts(name, system)}
    outputs = list(scalar_names(system.outputs)) + list(scalar_names(system.states))
    solved = simulate_fmu(
        fmu,
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-11,  # at 1e-9 CVode, restarted at every event, is further off than the stepped run
        output=outputs,
        record_events=False,
        **common,
    )
    common["start_values"] = {**common["start_values"], "internal_step": system.internal_step / 4.0}
    stepped = simulate_fmu(fmu, fmi_type="CoSimulation", output=outputs, **common)
    np.testing.assert_allclose(solved["time"], stepped["time"], rtol=0.0, atol=1e-12)
    for output in outputs:
        # CVode adds up its local errors over a hundred restarts
        atol = ROUGH.get(name, 3e-7) * max(np.abs(solved[output]).max(), 1.0)
        np.testing.assert_allclose(solved[output], stepped[output], rtol=0.0, atol=atol, err_msg=output)


@pytest.mark.parametrize("name", ["odometer", "discrete_uio", "multirate_cdo", "sampler", "tracker"])
def test_time_events_are_hit_exactly(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    system, model, start = reference(name).system, exchange(name, version), 3.7
    importer = Importer(model, model.initialize(start))
    importer.advance(start + 1.0)
    instants = set()
    for event in system.periodic_events:
        period, offset = model.get(event.period)[0], 0.0 if event.offset is None else model.get(event.offset)[0]
        # as the grid is defined, to the bit
        instants |= {start + offset + k * period for k in range(round(1.0 / period) + 1)}
    expected = sorted(t for t in instants if start < t <= start + 1.0)
    assert importer.run.time_events == expected


@pytest.mark.parametrize("name", ["takagi_sugeno_cdo", "discrete_uio", "multirate_cdo"])
def test_observer_with_balises_follows_its_block(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    system, model = reference(name).system, exchange(name, version)
    starts, names = {"effort": 3.0e4, "odometer": 10.0}, list(scalar_names(system.outputs))
    balises = [(0.31 * k + 0.1234, 3.1 * k + 1.5) for k in range(4)]
    block: Any = make_block(recipe(name, **system.options), fmi_version=3)
    references = [next(v.valueReference for v in block.model_description.modelVariables if v.name == n) for n in names]
    by_name = {v.name: v.valueReference for v in block.model_description.modelVariables}
    block.instantiate(eventModeUsed=True)
    block.setFloat64([by_name[n] for n in (*starts, "internal_step")], [*starts.values(), system.internal_step / 2.0])
    block.enterInitializationMode()
    block.exitInitializationMode()
    block.enterStepMode()
    importer = Importer(model, model.initialize(**starts), rtol=TOLERANCE, atol=TOLERANCE)
    now = 0.0
    for instant, position in balises:
        importer.advance(instant)
        importer.happen([Notified(instant, "balise", {"balise_position": position})])
        block.doStep(now, instant - now)
        block.enterEventMode()
        block.setClock([by_name["balise"]], [True])
        block.setFloat64([by_name["balise_position"]], [position])
        block.updateDiscreteStates()
        block.enterStepMode()
        now = instant
        got, expected = model.get(*names), np.array(block.getFloat64(references))
        # half the internal step leaves 1e-11 of the block's error of order 4, the solver as much; times the size of
        # forces
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-8)
    assert len(importer.run.time_events) == (10 if system.periodic_events else 0)
    assert abs(model.get("innovation")[0]) > 0.01  # the balises told something

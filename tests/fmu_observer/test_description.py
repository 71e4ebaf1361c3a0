"""Descriptions: value references, attributes, units, starts and dependencies against tables written by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Doorman, Swing
from fmpy.model_description import ModelDescription, ModelVariable
from shipped import shipped

from fmu_observer import OBSERVERS, description
from fmu_observer.description import STAMP_NOW, VariableTable, can_exchange, exposed_inputs, referenced
from fmu_observer.event_protocol import EventProtocol
from plant_models import PLANTS
from plant_models.hybrid import CommunicationEvent, HybridSystem, output_signal, parameter, scalar_names, state
from plant_models.hybrid.units import parse_unit

BOTH = pytest.mark.parametrize("version", [2, 3])
SHIPPED: list[HybridSystem] = [shipped(name) for name in (*PLANTS, *OBSERVERS)]

describe = cache(description.describe)
"""Once for each system, version and options: it traces the system."""

# name, causality, variability, initial, unit, start
TABLE = [
    ("time", "independent", "continuous", None, "s", None),
    ("torque", "input", "continuous", None, "N.m", 0.5),
    ("wind[1]", "input", "continuous", None, "N", 0.1),
    ("wind[2]", "input", "continuous", None, "N", -0.2),
    ("kick_impulse", "input", "discrete", None, "N.m.s", 0.0),
    ("kick_share[1]", "input", "discrete", None, None, 0.5),
    ("kick_share[2]", "input", "discrete", None, None, 0.25),
    ("energy", "output", "continuous", "calculated", "J", None),
    ("last_sample", "output", "discrete", "calculated", "rad", None),
    ("net_torque", "output", "continuous", "calculated", "N.m", None),
    ("angle", "local", "continuous", "exact", "rad", 0.3),
    ("rate", "local", "continuous", "exact", "rad/s", 0.0),
    ("sample", "local", "discrete", "exact", "rad", 0.0),
    ("sampled_at", "local", "discrete", "exact", "s", -1.0),
    ("marks[1]", "local", "discrete", "exact", None, 0.0),
    ("marks[2]", "local", "discrete", "exact", None, 0.0),
    ("stiffness[1]", "parameter", "fixed", "exact", "N.m/rad", 3.0),
    ("stiffness[2]", "parameter", "fixed", "exact", "N.m/rad", 0.5),
    ("damping", "parameter", "tunable", "exact", "N.m.s/rad", 0.2),
    ("period", "parameter", "fixed", "exact", "s", 0.07),
    ("offset", "parameter", "fixed", "exact", "s", 0.013),
    ("internal_step", "parameter", "fixed", "exact", "s", 0.01),
    ("seed", "parameter", "fixed", "exact", None, -1.0),
]
OUTCOMES = ("accepted", "replayed", "late", "rejected", "lost", "doubted", "ignored")
EVENTS = {
    2: [("kick_count", "Integer"), ("kick_time", "Real"), ("mark_count", "Integer"), ("mark_time", "Real")],
    3: [("kick", "Clock"), ("kick_time", "Float64"), ("mark", "Clock"), ("mark_time", "Float64")],
}


def _by_name(description: ModelDescription) -> dict[str, ModelVariable]:
    return {v.name: v for v in description.modelVariables}


@BOTH
def test_every_variable_is_as_the_table_says(version: Any) -> None:
    found = [
        (v.name, v.causality, v.variability, v.initial, v.unit, None if v.start is None else float(v.start))
        for v in describe(SWING, version).modelVariables[: len(TABLE)]
    ]
    assert found == TABLE


@BOTH
def test_event_variables_follow(version: Any) -> None:
    variables = describe(SWING, version).modelVariables[len(TABLE) : len(TABLE) + 4]
    assert [(v.name, v.type) for v in variables] == EVENTS[version]
    for trigger, stamp in zip(variables[::2], variables[1::2], strict=True):
        assert (trigger.causality, trigger.variability) == (stamp.causality, stamp.variability) == ("input", "discrete")
        assert (stamp.unit, float(stamp.start)) == ("s", STAMP_NOW)
        assert (trigger.start, trigger.intervalVariability) == (("0", None) if version == 2 else (None, "triggered"))


@BOTH
def test_the_event_protocol_follows_and_then_the_derivatives(version: Any) -> None:
    late = EventProtocol(late_policy="late", replay_horizon=3.0)
    policy, horizon, *others = describe(SWING, version, protocol=late).modelVariables[len(TABLE) + 4 :]
    counts, rates = others[: len(OUTCOMES)], others[len(OUTCOMES) :]
    assert (policy.name, policy.type, policy.causality, policy.start) == (
        "late_policy",
        "Enumeration",
        "parameter",
        "3",
    )
    assert [item.name for item in policy.declaredType.items] == ["replay", "reject", "late"]
    assert (horizon.name, horizon.unit, horizon.start) == ("replay_horizon", "s", "3.0")
    whole = "Integer" if version == 2 else "Int32"
    assert [v.name for v in counts] == [f"events.{outcome}" for outcome in OUTCOMES]
    kinds = {(v.type, v.causality, v.variability, v.initial, v.start, v.unit) for v in counts}
    assert kinds == {(whole, "local", "discrete", "calculated", None, None)}
    found = [(v.name, v.causality, v.initial, v.unit, v.derivative.name) for v in rates]
    assert found == [
        ("der(angle)", "local", "calculated", "rad/s", "angle"),
        ("der(rate)", "local", "calculated", "rad/s2", "rate"),
    ]


@BOTH
def test_a_state_with_dry_friction_has_an_event_indicator(version: Any) -> None:
    locomotive, table = PLANTS["locomotive"](), VariableTable.of(PLANTS["locomotive"]())
    description = describe(locomotive, version)
    names = [v.name for v in referenced(description.modelVariables, table.indicators, 2)]
    assert names == ["event_indicator.train_speed", "event_indicator.wheel_rate"]
    switches = [f"event_indicator.{name}" for name in locomotive.switchings]
    assert [u.variable.name for u in description.eventIndicators] == [*names, *switches]
    assert description.numberOfEventIndicators == 2 + len(switches)


def test_counts_can_announce_events_in_fmi_3() -> None:
    description = describe(SWING, 3, protocol=EventProtocol("counts"))
    variables = _by_name(description)
    assert (variables["kick_count"].type, variables["mark_count"].start) == ("Int32", "0")
    assert not any(v.clocks or v.type == "Clock" for v in variables.values())
    assert not description.coSimulation.hasEventMode
    with pytest.raises(ValueError, match="FMI 2 has no clocks"):
        describe(SWING, 2, protocol=EventProtocol("clocks"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"announcement": "letters"}, "announcement 'letters' is unknown"),
        ({"late_policy": "forget"}, "late_policy 'forget' is unknown; use one of replay, reject, late"),
        ({"replay_horizon": -1.0}, "replay_horizon = -1.0 s; expected zero or more"),
        ({"replay_horizon": float("inf")}, "replay_horizon = inf s"),
    ],
)
def test_an_impossible_protocol_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EventProtocol(**arguments)


def test_an_integer_output_is_a_whole_number_to_the_outside() -> None:
    class Counting(Swing):
        name = "counting"
        outputs = (*Swing.outputs, output_signal("marks_count", "1", variability="discrete", integer=True))

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return super().output(t, x, u, p) | {"marks_count": x.marks[0]}

    assert [_by_name(describe(Counting(), v))["marks_count"].type for v in (2, 3)] == ["Integer", "Int32"]  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="'speed' is an integer; only a discrete output can be one"):
        output_signal("speed", "m/s", integer=True)


@BOTH
def test_model_exchange_is_only_for_what_can_be_one(version: Any) -> None:
    class Listening(Swing):
        events = (*Swing.events, CommunicationEvent("heard"))

    exchange = describe(SWING, version, model_exchange=True).modelExchange
    assert (exchange.modelIdentifier, exchange.providesDirectionalDerivative) == ("swing", True)
    assert describe(SWING, version).modelExchange is None
    assert (can_exchange(SWING), can_exchange(Listening()), can_exchange(Doorman())) == (True, False, False)
    with pytest.raises(ValueError, match="swing: a system with communication events"):
        describe(Listening(), version, model_exchange=True)


def test_what_comes_with_an_event_carries_its_clock() -> None:
    variables = _by_name(describe(SWING, 3))
    clocked = {name: v.clocks for name, v in variables.items() if v.clocks}
    kick, mark = variables["kick"].valueReference, variables["mark"].valueReference
    payload = ("kick_impulse", "kick_share[1]", "kick_share[2]", "kick_time")
    assert clocked == {name: [kick] for name in payload} | {"mark_time": [mark]}
    assert not any(v.clocks for v in describe(SWING, 2).modelVariables)


@BOTH
@pytest.mark.parametrize("system", [SWING, Doorman(), *SHIPPED], ids=lambda s: s.name)
def test_value_references_are_contiguous_and_in_the_order_of_the_runtime(system: HybridSystem, version: Any) -> None:
    description, table = describe(system, version), VariableTable.of(system)
    names = [v.name for v in description.modelVariables]
    assert [v.valueReference for v in description.modelVariables] == list(range(1, table.end))  # see FIRST_REFERENCE
    assert len(set(names)) == len(names)
    for first, signals in (
        (table.inputs, exposed_inputs(system)),
        (table.outputs, system.outputs),
        (table.states, system.states),
        (table.parameters, system.parameter_signals),
    ):
        expected = list(scalar_names(signals))
        assert referenced(names, first, len(expected)) == expected
    assert (table.time, table.inputs) == (1, 2)
    assert table.protocol - table.events == 2 * len(system.triggered_events)
    assert table.outcomes - table.protocol == (2 if system.triggered_events else 0)
    assert table.derivatives - table.outcomes == (len(OUTCOMES) if system.triggered_events else 0)
    rates = [f"der({n})" for n in scalar_names(system.states)[: system.continuous_count]]
    assert referenced(names, table.derivatives, system.continuous_count) == rates
    assert not set(names) & {s.name for s in system.noises}


@BOTH
@pytest.mark.parametrize("system", [SWING, *SHIPPED], ids=lambda s: s.name)
def test_every_unit_in_use_is_defined_and_means_what_its_name_says(system: HybridSystem, version: Any) -> None:
    description = describe(system, version)
    defined = {u.name: u for u in description.unitDefinitions}
    used = {v.unit for v in description.modelVariables if v.unit is not None}
    assert set(defined) == used
    for name, unit in defined.items():
        meaning, base = parse_unit(name), unit.baseUnit
        powers = tuple(getattr(base, symbol) for symbol in ("kg", "m", "s", "A", "K", "mol", "cd", "rad"))
        assert (powers, base.factor, base.offset) == (meaning.exponents, meaning.factor, meaning.offset)
    for variable in description.modelVariables:
        if variable.displayUnit is not None:
            assert variable.displayUnit in {d.name for d in defined[variable.unit].displayUnits}


def test_display_units_convert_as_the_standard_defines() -> None:
    torque = next(u for u in describe(SWING, 3).unitDefinitions if u.name == "N.m")
    (display,) = torque.displayUnits
    assert (display.name, display.offset) == ("kN.m", 0.0)
    assert display.factor == pytest.approx(1e-3, rel=1e-15)  # shown = factor * value + offset


@BOTH
@pytest.mark.parametrize("system", SHIPPED, ids=lambda s: s.name)
def test_every_speed_is_shown_in_km_per_hour(system: HybridSystem, version: Any) -> None:
    signals = [v for v in describe(system, version).modelVariables if v.unit == "m/s" and v.derivative is None]
    assert {v.displayUnit for v in signals} <= {"km/h"}


@BOTH
def test_dependencies_of_outputs_are_exact(version: Any) -> None:
    description = describe(SWING, version)
    structure = [*description.outputs, *description.derivatives]
    found = {u.variable.name: [v.name for v in u.dependencies] for u in structure}
    assert found == {
        "energy": ["angle", "rate"],
        "last_sample": [],
        "net_torque": ["torque", "wind[2]", "rate"],
        "der(angle)": ["rate"],
        "der(rate)": ["time", "torque", "wind[1]", "wind[2]", "angle", "rate"],
    }
    for unknown in structure:
        assert unknown.dependenciesKind == ["dependent"] * len(unknown.dependencies)
        assert unknown.index == unknown.variable.valueReference  # FMI 2 counts from one, and so do we


@BOTH
@pytest.mark.parametrize("system", [SWING, Doorman(), *SHIPPED], ids=lambda s: s.name)
def test_initial_unknowns_depend_on_what_running_ones_do_and_on_start_values(
    system: HybridSystem, version: Any
) -> None:
    """Without dependencies OMSimulator takes every input for one, and finds algebraic loops."""
    description, table = describe(system, version), VariableTable.of(system)
    running = [*description.outputs, *description.derivatives]
    for unknown, initial in zip(running, description.initialUnknowns, strict=True):
        assert initial.variable is unknown.variable
        assert initial.dependenciesKind == ["dependent"] * len(initial.dependencies)
        now, before = ({v.name for v in u.dependencies} for u in (unknown, initial))
        starts = {v.name for v in description.modelVariables if table.states <= v.valueReference < table.events}
        assert now <= before <= now | starts


@BOTH
def test_dependencies_of_initial_unknowns_are_exact(version: Any) -> None:
    found = {u.variable.name: [v.name for v in u.dependencies] for u in describe(SWING, version).initialUnknowns}
    assert found["der(angle)"] == ["rate"]
    assert found["last_sample"] == ["sample"]


ESTIMATE = {
    "position": [],
    "speed": [],
    "slip": ["odometer"],
    "slip_indicator": ["odometer"],
    "innovation": [],
    "rolls_back": ["odometer"],
}
HAND = {  # read off the equations of the observers
    "differentiator_cdo": ESTIMATE | {"adhesion_force": ["effort"]},
    "takagi_sugeno_cdo": ESTIMATE | {"adhesion_force": ["effort"]},
    "multirate_cdo": ESTIMATE | {"adhesion_force": []},
    "discrete_uio": ESTIMATE | {"adhesion_force": ["effort"]},
    "slip_indicator": {"slip": ["odometer", "speed"], "slip_indicator": ["odometer", "speed"]},
}


@BOTH
@pytest.mark.parametrize("name", sorted(HAND))
def test_dependencies_of_shipped_observers(name: str, version: Any) -> None:
    outputs = describe(OBSERVERS[name](), version).outputs
    assert {u.variable.name: [v.name for v in u.dependencies if v.causality == "input"] for u in outputs} == HAND[name]


@BOTH
def test_a_preset_gives_the_start_values(version: Any) -> None:
    soft, declared = _by_name(describe(SWING, version, preset="soft")), _by_name(describe(SWING, version))
    changed = {name: float(v.start) for name, v in soft.items() if v.start != declared[name].start}
    assert changed == {"angle": 1.5, "stiffness[1]": 0.5, "stiffness[2]": 0.1, "internal_step": 0.005, "seed": 7.0}
    with pytest.raises(ValueError, match="unknown preset 'hard'; it has: soft"):
        describe(SWING, version, preset="hard")


@pytest.mark.parametrize("name", sorted(OBSERVERS))
def test_presets_of_shipped_observers_land_in_the_starts(name: str) -> None:
    system = OBSERVERS[name]()
    for preset in system.presets:
        variables = _by_name(describe(system, 3, preset=preset))
        for signal_name, value in system.presets[preset].items():
            signal = next(s for s in (*system.parameter_signals, *system.states) if s.name == signal_name)
            found = [float(variables[n].start) for n in signal.scalar_names]
            np.testing.assert_array_equal(found, np.broadcast_to(np.asarray(value, dtype=float), len(found)))
    default = {n: v.start for n, v in _by_name(describe(system, 3)).items()}
    assert default == {n: v.start for n, v in _by_name(describe(system, 3, preset=system.default_preset)).items()}


@BOTH
@pytest.mark.parametrize("system", [SWING, *SHIPPED], ids=lambda s: s.name)
def test_starts_are_plain_numbers_that_read_back_exactly(system: HybridSystem, version: Any) -> None:
    starts = dict(zip(scalar_names(system.parameter_signals), system.start_parameters(), strict=True))
    starts |= dict(zip(scalar_names(system.states), system.start_state(), strict=True))
    variables = _by_name(describe(system, version))
    assert {name: float(variables[name].start) for name in starts} == starts


def test_numpy_scalars_as_starts_are_written_as_numbers() -> None:
    class Scalars(Swing):
        name = "scalars"
        parameters = (
            *Swing.parameters,
            parameter("gain", "1", (np.float64(0.1), np.int64(2)), min=np.float64(0.0), size=2),
        )  # type: ignore[arg-type]

    variables = _by_name(describe(Scalars(), 3))
    assert (variables["gain[1]"].start, variables["gain[2]"].start, variables["gain[1]"].min) == ("0.1", "2.0", "0.0")


@BOTH
def test_capabilities_are_those_of_a_block(version: Any) -> None:
    swing, cosimulation = describe(SWING, version), describe(SWING, version).coSimulation
    assert cosimulation.modelIdentifier == "swing"
    assert cosimulation.canHandleVariableCommunicationStepSize
    assert cosimulation.canGetAndSetFMUstate
    assert cosimulation.canSerializeFMUstate
    assert bool(cosimulation.hasEventMode) == (version == 3)
    assert swing.fmiVersion == f"{version}.0"
    assert swing.modelName == "swing"
    assert describe(SWING, version, model_name="Pendulum").modelName == "Pendulum"
    without = next(s for s in SHIPPED if not s.triggered_events)
    assert not describe(without, version).coSimulation.hasEventMode


def test_an_unknown_version_is_refused() -> None:
    with pytest.raises(ValueError, match="FMI version 1 is unknown; use 2 or 3"):
        describe(SWING, 1)  # type: ignore[arg-type]


# -- token
# --------------------------------------------------------------------------------------------------------------


def _variant(**attributes: Any) -> HybridSystem:
    made: HybridSystem = type("Variant", (Swing,), attributes)()
    return made


def test_the_token_names_the_content() -> None:
    token = describe(SWING, 3).instantiationToken
    assert describe(Swing(), 3).instantiationToken == token
    changed = {
        "version": describe(SWING, 2),
        "preset": describe(SWING, 3, preset="soft"),
        "name": describe(_variant(name="swung"), 3),
        "internal step": describe(_variant(internal_step=0.02), 3),
        "method": describe(_variant(method="rosenbrock"), 3),
        "start": describe(_variant(states=(state("angle", "rad", 0.31), *Swing.states[1:])), 3),
        "unit": describe(_variant(states=(state("angle", "deg", 0.3), *Swing.states[1:])), 3),
        "order": describe(_variant(states=(Swing.states[1], Swing.states[0], *Swing.states[2:])), 3),
        "variability": describe(_variant(parameters=(_tunable(Swing.parameters[0]), *Swing.parameters[1:])), 3),
        "largest value": describe(_variant(parameters=(_limited(Swing.parameters[0]), *Swing.parameters[1:])), 3),
        "offset of an event": describe(_variant(events=(Swing.events[0], _without_offset(), Swing.events[2])), 3),
        "dependency": describe(_Direct(), 3),
        "announcement": describe(SWING, 3, protocol=EventProtocol("counts")),
        "late policy": describe(SWING, 3, protocol=EventProtocol(late_policy="reject")),
        "communication event": describe(_variant(events=(*Swing.events, CommunicationEvent("heard"))), 3),
    }
    tokens = {what: description.instantiationToken for what, description in changed.items()} | {"none": token}
    assert len(set(tokens.values())) == len(tokens), tokens


def _tunable(signal: Any) -> Any:
    return parameter(signal.name, signal.unit, signal.start, min=signal.min, size=signal.size, variability="tunable")


def _limited(signal: Any) -> Any:
    return parameter(signal.name, signal.unit, signal.start, min=signal.min, max=9.0, size=signal.size)


def _without_offset() -> Any:
    return replace(Swing.events[1], offset=None)  # type: ignore[type-var]


class _Direct(Swing):
    """One output depends on one more input."""

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        values = super().output(t, x, u, p)
        return values | {"energy": values["energy"] + 0.0 * u.torque + u.wind[0]}


def test_options_of_one_class_give_different_tokens() -> None:
    cls = OBSERVERS["takagi_sugeno_cdo"]
    tokens = {describe(cls(premise=p), 3).instantiationToken for p in ("live", "estimated", "frozen")}
    assert len(tokens) == 3


def test_other_equations_give_another_token() -> None:
    class Stiffer(Swing):
        def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
            return {name: 2.0 * value for name, value in super().flow(t, x, u, p).items()}

    assert describe(Stiffer(), 3).instantiationToken != describe(SWING, 3).instantiationToken

"""What an observer can know of the train in a scenario: what the scenario says, and what a recorded run of it shows.

Runs nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cosim.choice.playback import ScenarioParts
from cosim.evaluation.roles import recorded
from cosim.results.result import Result
from cosim.run.component_models import make_declared, make_system, values_in_use
from cosim.run.connections import recorded_link, transformation
from cosim.run.plausible_masses import HEAVIEST, LIGHTEST, PER_UNIT_MASS
from cosim.scenario.scenario_tables import ComponentTable
from cosim.simulation.scenario import Scenario
from cosim.starter.guessed_signal import in_si
from cosim.starter.inspected_fmu import inspect_fmu
from cosim.starter.starter_roles import plant_roles
from cosim.starter.train_starter import DAVIS, usual_resistance
from fmus.tables.numbers import number
from plant_models.hybrid import Signal

Known = Mapping[str, tuple[float, str]]
"""Values by the name of a parameter, and who says so."""

MASS = "mass"
_START_POSITION = ("estimated_position", "predicted_position")
_START_SPEED = ("estimated_speed", "odometer_speed", "held_speed")
_OF_THE_TRAIN = (MASS, *DAVIS, "wheel_radius", "wheel_inertia", "n_axles", "brake_coefficient")
_PERIOD, _SPACING = "odometer_period", "expected_spacing"
SHARED_PARAMETERS = (*_OF_THE_TRAIN, *_START_POSITION, *_START_SPEED, _PERIOD, _SPACING)
"""What train observers want to know of the train, of its odometer and balises, and where they believe it to start."""

_FITTED = "fitted to effort and speed of the recorded run"
_MOVING = 0.5  # [m/s]: from here on a run says something of mass


def settable(system: Any) -> tuple[Signal, ...]:
    """What a component's table may say to a model: its parameters and, of a hybrid system, its states at the start.

    Args:
        system: a hybrid system, or a model of plain Python.
    """
    return (*system.parameter_signals, *getattr(system, "states", ()))


def stated_parameters(scenario: Scenario, parts: ScenarioParts) -> dict[str, tuple[float, str]]:
    """What the scenario says of the train that an observer should know too.

    What its own observers, as far as they want to know it, agree on comes first; then parameters, preset and defaults
    of the plant, or the start values of its FMU; then the period of the declared odometer.

    Args:
        scenario: for paths. parts: of it.
    """
    found = _agreed(parts)
    if parts.train:
        plant = parts.table.components[parts.train]
        for name, value in _plant_values(scenario, plant).items():
            found.setdefault(name, (value, f"as for {parts.train}"))
    period = _declared_period(parts)
    if period is not None:
        found.setdefault(_PERIOD, (period, "of the odometer"))
    return found


def derived_parameters(known: Known, parts: ScenarioParts, run: Result) -> dict[str, tuple[float, str]]:
    """What is known, and what a recorded run shows besides: the start, the spacing of balises, the period of the
    odometer, and, where nobody states them, mass and resistance of the train.

    Args:
        known: by the scenario. parts: of it. run: its recorded run.
    """
    found = dict(known)
    position, speed = (recorded(run, name) for name in true_signals(parts))
    for names, values in ((_START_POSITION, position), (_START_SPEED, speed)):
        if values is not None and len(values):
            found |= {n: (float(values[0]), "start of the recorded run") for n in names if n not in found}
    spacing = _seen_spacing(run)
    if spacing is not None:
        found.setdefault(_SPACING, (spacing, "median of the recorded run"))
    period = _seen_period(run, parts.template["odometer"][0]) if "odometer" in parts.template else None
    if period is not None:
        found.setdefault(_PERIOD, (period, "changes in the recorded run"))
    if not _is_of_a_train(found) and speed is not None and "effort" in parts.template:
        mass = _fitted_mass(run.time, speed, _received(parts, run, "effort"))
        if mass is not None:
            doubt = (
                f", since {number(found[MASS][0])} kg ({found[MASS][1]}) is that of no train" if MASS in found else ""
            )
            found[MASS] = mass, f"{_FITTED}{doubt}; check it"
    if MASS in found:
        by_mass = {name: (value, "usual for this mass") for name, value in usual_resistance(found[MASS][0]).items()}
        found = by_mass | found
    return found


def mass_remarks(known: Known) -> list[str]:
    """What is doubtful about the mass that observers are measured with, in words, or nothing.

    Args:
        known: from `derived_parameters`.
    """
    if MASS not in known:
        return []
    value, source = known[MASS]
    if source.startswith(_FITTED):
        return [f"mass = {number(value)} kg, {source}."]
    if _is_of_a_train(known):
        return []
    return [
        f"mass = {number(value)} kg ({source}) is that of no train, and observers are measured with it: those that "
        "need one will look bad. State it [kg] as a parameter of an observer in the scenario (see cosim new)."
    ]


def _is_of_a_train(known: Known) -> bool:
    """Whether a mass is known that may be a train's, or the one of models whose forces are per unit mass."""
    return MASS in known and (known[MASS][0] == PER_UNIT_MASS or LIGHTEST <= known[MASS][0] <= HEAVIEST)


# -- what the scenario says -------------------------------------------------------------------------------------------


def _agreed(parts: ScenarioParts) -> dict[str, tuple[float, str]]:
    """What the scenario's own observers agree on, as far as they want to know it."""
    found: dict[str, tuple[float, str]] = {}
    tables = [parts.table.components[name] for name in parts.observers]
    settables = [
        set(SHARED_PARAMETERS) if t.observer is None else {s.name for s in settable(make_declared(t, ""))}
        for t in tables
    ]
    for parameter in SHARED_PARAMETERS:
        wanting = [table for table, known in zip(tables, settables, strict=True) if parameter in known]
        stated = [table.parameters.get(parameter) for table in wanting]
        values = {value for value in stated if isinstance(value, int | float) and not isinstance(value, bool)}
        if len(values) == 1 and None not in stated:
            found[parameter] = float(values.pop()), "as for the observers of the scenario"
    return found


def _plant_values(scenario: Scenario, table: ComponentTable) -> dict[str, float]:
    """Parameters of a plant that an observer has too, with their defaults."""
    if table.fmu is not None:
        return _fmu_values(scenario, table)
    system = make_system(table, "")
    if system is None:
        return {n: float(v) for n in _OF_THE_TRAIN if isinstance(v := table.parameters.get(n), int | float)}
    values = values_in_use(table, system)
    scalars = {signal.name for signal in system.parameter_signals if signal.size is None}
    return {name: float(getattr(values, name)) for name in _OF_THE_TRAIN if name in scalars}


def _fmu_values(scenario: Scenario, table: ComponentTable) -> dict[str, float]:
    """The same of an FMU: parameters of these names, and the mass by what it is called; set, or start values."""
    inspected = inspect_fmu((scenario.folder / str(table.fmu)).resolve(), table.units)
    signals = {signal.name: signal for signal in inspected.parameters}
    named = {name: signals[name] for name in _OF_THE_TRAIN if name in signals}
    mass = plant_roles(inspected).mass
    if mass is not None and mass.signal.readable:
        named.setdefault(MASS, mass.signal)
    stated = {n: table.parameters.get(signal.name, signal.start) for n, signal in named.items()}
    found = {n: in_si(replace(named[n], start=float(v))) for n, v in stated.items() if isinstance(v, int | float)}
    return {name: value for name, value in found.items() if name != MASS or value > 0.0}


def _declared_period(parts: ScenarioParts) -> float | None:
    """Time between two readings of the declared odometer [s], or between two packets; None where a model says none."""
    network, source = parts.table.network, parts.odometer
    if source is None:
        return None
    if network is not None and any(source in names for names in network.nodes.values()):
        turn = None if network.period is None else network.period * len(network.nodes)
        if (network.cycle or turn) is not None:
            return network.cycle or turn
    table = parts.table.components.get(source.partition(".")[0])
    system = None if table is None or table.model is None else make_system(table, "")
    if table is None or system is None:
        return None
    values = values_in_use(table, system)
    periods = [float(getattr(values, event.period)) for event in system.periodic_events]
    return min(periods, default=None)


# -- what a run shows -------------------------------------------------------------------------------------------------


def true_signals(parts: ScenarioParts) -> tuple[str | None, str | None]:
    """Names of the true position and speed; None for what nobody names.

    Args:
        parts: of a scenario.
    """
    balises, report = parts.table.balises, parts.table.report
    position, speed = (None, None) if balises is None else (balises.position, balises.speed)
    return report.true_position or position, report.true_speed or speed


def _seen_spacing(run: Result) -> float | None:
    """Median way between two balises [m]; None with fewer than two."""
    places = sorted({event.position for event in run.events if event.kind == "true"})
    return float(np.median(np.diff(places))) if len(places) > 1 else None


def _seen_period(run: Result, name: str) -> float | None:
    """Median time between two changes of a reading [s]; None where it hardly changes."""
    values = recorded(run, name)
    if values is None:
        return None
    changes = run.time[1:][np.diff(values) != 0.0]
    return round(float(np.median(np.diff(changes))), 9) if len(changes) > 2 else None


def _received(parts: ScenarioParts, run: Result, name: str) -> np.ndarray | None:
    """What observers hear as this input in a recorded run, in their unit; None where it is not recorded."""
    link = recorded_link(parts.template[name], parts.table, parts.folder)
    values, stated = recorded(run, link[0]), transformation(link)
    return None if values is None else stated.factor * values + stated.offset


def _fitted_mass(time: np.ndarray, speed: np.ndarray, effort: np.ndarray | None) -> float | None:
    """Mass with which efforts and speeds go together, with the resistance that is usual for it [kg]; None for none.

    ``F = M (dv/dt + a + b v + c v^2)`` by least squares, with the acceleration over a second.

    Args:
        time: of the rows [s], shape (rows,). speed: [m/s]. effort: [N].
    """
    if effort is None or len(time) < 3:
        return None
    grid = np.arange(time[0], time[-1], 1.0)
    if len(grid) < 3:
        return None
    way = np.interp(grid, time, np.concatenate(([0.0], np.cumsum(effort[:-1] * np.diff(time)))))
    forwards = -1.0 if np.sum(speed) < 0.0 else 1.0
    v = forwards * np.interp(grid, time, speed)
    push, mean = forwards * np.diff(way), 0.5 * (v[1:] + v[:-1])
    per_mass = np.diff(v) + sum(share * mean**power for power, share in enumerate(usual_resistance(1.0).values()))
    moving = mean > _MOVING
    weight = float(np.sum(per_mass[moving] ** 2))
    mass = float(np.sum(push[moving] * per_mass[moving]) / weight) if weight > 0.0 else 0.0
    return float(f"{mass:.3g}") if np.isfinite(mass) and mass > 0.0 else None

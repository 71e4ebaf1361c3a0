"""The starter of a plant: the FMU with an odometer, a driver where it can be driven, an observer and balises."""

from __future__ import annotations

from collections.abc import Set
from math import inf
from typing import Any

from cosim.run.component_models import make_declared
from cosim.run.plausible_masses import LIGHTEST
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import step_count
from cosim.starter.guessed_signal import Guess, fits, in_si
from cosim.starter.inspected_fmu import InspectedFmu, number
from cosim.starter.starter_roles import PlantRoles
from cosim.starter.toml_lines import GuessedLink, guessed, one_line
from fmus.fmi.capabilities import read_capabilities

PLANT, OBSERVER = "plant", "observer"
DEFAULT_OBSERVER, WITHOUT_EFFORT, DENSE = "quasi_lpv_uio", "odometer_reset", "differentiator_cdo"
"""What a stranger gets beside an effort, and without one; and what is far better with a balise every half second at all
times, which no FMU says and no train has that starts from standstill, so it is named only."""
HORIZON, STEP, SHORTEST, LONGEST = 60.0, 0.01, 1e-3, 0.5
_JOURNEY = 10.0  # [s]: what an FMU names below it is a default of its tool
RADIUS, PERIOD = 0.5, 0.01
PRESETS = {"takagi_sugeno_cdo": "long_gaps"}
"""What is offered beside balises laid by distance, whose gaps nobody knows beforehand: gains that no gap makes
unstable.
"""
USUAL_MASS = 90e3  # [kg]
DAVIS = ("davis_a", "davis_b", "davis_c")
_RESISTANCE = (0.01, 3.6e-4, 1.8365e-5)
"""Davis coefficients by mass [N/kg], [N.s/(m.kg)], [N.s2/(m2.kg)]: those of the locomotive that ships."""


def usual_resistance(mass: float) -> dict[str, float]:
    """Davis coefficients that are usual for a mass, by name.

    Args:
        mass: of the train [kg].
    """
    return {name: share * mass for name, share in zip(DAVIS, _RESISTANCE, strict=True)}


def default_observer(roles: PlantRoles) -> str:
    """The observer for a plant of which nobody says more.

    Args:
        roles: what its signals were guessed to be.
    """
    return WITHOUT_EFFORT if roles.effort is None and roles.applied is None else DEFAULT_OBSERVER


def train(
    inspected: InspectedFmu, roles: PlantRoles, observer: str, place: str, radius: float | None = None
) -> dict[str, Any]:
    """What the template of this starter inserts.

    Args:
        inspected: what the FMU says.
        roles: what its signals were guessed to be.
        observer: name of the observer, or ``file.py:Class``. place: the same as the scenario file says it.
        radius: of the wheels [m]; None where it is not known.

    Returns:
        Values by name.
    """
    stop, step, source = train_times(inspected)
    start, stop, span = (0.0, stop, "") if roles.effort else _own_span(inspected, stop, step)
    declared = declared_observer(observer)
    known = {signal.name for signal in (*declared.parameter_signals, *getattr(declared, "states", ()))}
    driven = roles.effort.signal.name if roles.effort else None
    needed = {"position": roles.position, "speed": roles.speed}
    return {
        "title": f"{one_line(inspected.path.name)} beside one observer",
        "start": start,
        "stop": stop,
        "span": span,
        "step": step,
        "source": source,
        "links": _links(roles, {signal.name for signal in declared.inputs}, radius),
        "roles": roles,
        "others": [s for s in inspected.inputs if s.name != driven],
        "settings": [s for s in inspected.parameters if s.start is not None and not s.name.endswith("]")],
        "observer": place,
        "period": PERIOD,
        "dense": DENSE,
        "preset": PRESETS.get(observer),
        "believed": [line for line in _believed(inspected, roles) if line[0] in known],
        "lacking": [what for what, found in needed.items() if found is None or not found.signal.readable],
    }


def _believed(inspected: InspectedFmu, roles: PlantRoles) -> list[tuple[str, float, str]]:
    """What an observer is to know of the train: parameter, value, and a remark."""
    lines = [_mass(roles)]
    parameters = {signal.name: signal for signal in inspected.parameters if signal.start is not None}
    for name, value in usual_resistance(lines[0][1]).items():
        if name in parameters:
            lines.append((name, in_si(parameters[name]), f"start value of {name}"))
        else:
            lines.append((name, float(f"{value:.3g}"), "usual for this mass: WRITE THE RESISTANCE OF YOUR TRAIN"))
    lines.append(("odometer_period", PERIOD, "[s] of the odometer above"))
    return [*lines, ("estimated_speed", 0.0, "[m/s] what it believes at the start")]


def _mass(roles: PlantRoles) -> tuple[str, float, str]:
    """The mass, its value [kg], and where it comes from."""
    signal = roles.mass.signal if roles.mass is not None else None
    if roles.mass is None or signal is None or not signal.start or signal.start < 0.0:
        return "mass", USUAL_MASS, "[kg] WRITE THE MASS OF YOUR TRAIN: the FMU has no parameter that looks like it"
    value, source = in_si(signal), f"start value of {one_line(signal.name)}"
    if value < LIGHTEST:
        return "mass", value, f"[kg] {source}, NO MASS OF A TRAIN: where tonnes are meant write {1e3 * value:g}"
    return "mass", value, f"[kg] {source}; {guessed(roles.mass).removeprefix('  # ')}"


def declared_observer(name: str) -> Any:
    """What an observer declares, see `cosim.run.component_models.make_declared`.

    Args:
        name: of the observer, or ``file.py:Class``.

    Raises:
        ScenarioError: there is no such observer, or it cannot be loaded.
    """
    return make_declared(ComponentTable.model_validate({"observer": name}), "observer")


def train_times(inspected: InspectedFmu) -> tuple[float, float, str]:
    """When the run stops and how long its steps are: the FMU's own where it names one to communicate at.

    Args:
        inspected: what the FMU says.

    Returns:
        Stop and step [s], and where the step comes from.
    """
    fixed = read_capabilities(inspected.description).fixedInternalStepSize
    advised = inspected.description.defaultExperiment
    for length, source in (
        (fixed, "the FMU's own step"),
        (number(advised.stepSize) if advised else None, "from the FMU's default experiment"),
    ):
        if length is not None and SHORTEST <= length <= LONGEST:
            stop = round(round(HORIZON / length) * length, 9)
            try:
                step_count(0.0, stop, length)
            except ValueError:
                continue
            return stop, length, source
    return HORIZON, STEP, "communication step"


def _own_span(inspected: InspectedFmu, stop: float, step: float) -> tuple[float, float, str]:
    """Start and stop [s] of the journey that is in an FMU without an input to drive it, and where they come from."""
    advised = inspected.description.defaultExperiment
    begin, end = (number(advised.startTime) or 0.0, number(advised.stopTime)) if advised else (0.0, None)
    if end is None or not _JOURNEY <= end - begin < inf:
        return 0.0, stop, ""
    end = round(begin + round((end - begin) / step) * step, 9)
    return begin, end, "from the FMU's default experiment"


# -- connections ------------------------------------------------------------------------------------------------------


def _links(roles: PlantRoles, wanted: Set[str], radius: float | None) -> list[GuessedLink]:
    """Connections of the train, its odometer and its driver, and to the inputs that an observer wants."""
    links: list[GuessedLink] = []
    effort = f"{OBSERVER}.effort"
    if roles.effort is not None:
        links.append(_from_driver(roles.effort))
    elif roles.applied is not None and "effort" in wanted:
        found = roles.applied
        links.append(GuessedLink(f"{PLANT}.{found.signal.name}", [effort], guessed(found), _factor(found)))
    links.append(_to_odometer(roles, radius))
    readers = ["driver.odometer"] if roles.effort is not None else []
    links.append(GuessedLink("odometer.reading", [*readers, f"{OBSERVER}.odometer"]))
    if roles.effort is not None and "effort" in wanted:
        links.append(GuessedLink("driver.effort", [effort]))
    return links


def _from_driver(effort: Guess) -> GuessedLink:
    remark = guessed(effort)
    if effort.signal.unit is None:
        remark += "; it declares no unit: N is assumed"
    factor = _factor(effort)
    if factor is not None:
        remark += f"; its unit {one_line(str(effort.signal.unit))} is not understood: write the factor from N to it"
    return GuessedLink("driver.effort", [f"{PLANT}.{effort.signal.name}"], remark, factor)


def _to_odometer(roles: PlantRoles, radius: float | None) -> GuessedLink:
    found = roles.wheel_speed or roles.speed
    assert found is not None
    signal, remark = found.signal, guessed(found)
    if roles.wheel_speed is None:
        remark += "; no speed of a wheel was found, so this odometer never slips"
    if fits(signal, "rad/s"):
        assert signal.meaning is not None
        seen = f"{radius:g} m by a probe run" if radius else f"{RADIUS} m: WRITE YOURS"
        remark += f"; times the wheel radius, {seen}"
        rim = (radius or RADIUS) * signal.meaning.factor
        return GuessedLink(f"{PLANT}.{signal.name}", ["odometer.wheel_speed"], remark, rim)
    if signal.unit is None:
        remark += "; it declares no unit: m/s is assumed"
    factor = _factor(found)
    if factor is not None:
        remark += f"; its unit {one_line(str(signal.unit))} is not understood: write the factor to m/s"
    return GuessedLink(f"{PLANT}.{signal.name}", ["odometer.wheel_speed"], remark, factor)


def _factor(found: Guess) -> float | None:
    """A factor to be edited where nobody can convert the unit."""
    return None if found.signal.readable else 1.0

"""The starter of a plant: the FMU with an odometer, a driver where it can be driven, an observer and balises."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.scenario.schema import step_count
from cosim.starter.guess import Guess, fits
from cosim.starter.look import Look, number
from cosim.starter.roles import PlantRoles
from cosim.starter.toml_lines import Link, comment, entry, guessed, one_line
from fmu_observer import OBSERVERS
from fmus.fmi.capabilities import read_capabilities

PLANT, OBSERVER = "plant", "observer"
DEFAULT_OBSERVER = "takagi_sugeno_cdo"
HORIZON, STEP, SHORTEST, LONGEST = 60.0, 0.01, 1e-3, 0.5
RADIUS = 0.5
ASSUMED = {"position": "m", "true_position": "m", "speed": "m/s", "true_speed": "m/s", "true_adhesion_force": "N"}
ODOMETER = ("[components.odometer]", 'model = "odometer"', "parameters = { noise_std = 0.01, seed = 1 }  # [m/s]", "")
PRESETS = {DEFAULT_OBSERVER: "long_gaps"}
"""What is offered beside balises laid by distance, whose gaps nobody knows beforehand: gains that no gap makes
unstable.
"""


def train(look: Look, fmu: str, roles: PlantRoles, observer: str) -> list[str]:
    """The lines of the scenario.

    Args:
        look: what the FMU says. fmu: its path in the file. roles: what its signals were guessed to be. observer: name.
    """
    stop, step, source = train_times(look)
    links = [line for link in _links(roles) for line in link.lines()]
    return [
        entry("title", f"{one_line(look.path.name)} beside one observer"),
        f"{entry('stop', stop)}  # [s]",
        f"{entry('step', step)}  # [s] {source}",
        "",
        *(
            []
            if roles.effort
            else comment("No input was found that drives the train (an effort in N), so there is no driver.")
        ),
        "connections = [",
        *links,
        "]",
        "",
        *_plant(look, fmu, roles),
        *_driver(roles),
        *ODOMETER,
        *observer_table(observer, roles.mass),
        *_balises(roles.position, roles.speed),
        *_report(roles),
        *expectations(),
    ]


def train_times(look: Look) -> tuple[float, float, str]:
    """Stop and step [s], and where the step comes from: the FMU's own where it says so and it is one to communicate
    at.
    """
    fixed = read_capabilities(look.description).fixedInternalStepSize
    advised = look.description.defaultExperiment
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


# -- connections
# --------------------------------------------------------------------------------------------------------


def _links(roles: PlantRoles) -> list[Link]:
    links: list[Link] = []
    if roles.effort is not None:
        links.append(_from_driver(roles.effort))
    elif roles.applied is not None:
        links.append(
            Link(
                f"{PLANT}.{roles.applied.signal.name}",
                [f"{OBSERVER}.effort"],
                guessed(roles.applied),
                _factor(roles.applied),
            )
        )
    links.append(_to_odometer(roles))
    readers = ["driver.odometer"] if roles.effort is not None else []
    links.append(Link("odometer.reading", [*readers, f"{OBSERVER}.odometer"]))
    if roles.effort is not None:
        links.append(Link("driver.effort", [f"{OBSERVER}.effort"]))
    return links


def _from_driver(effort: Guess) -> Link:
    remark = guessed(effort)
    if effort.signal.unit is None:
        remark += "; it declares no unit: N is assumed"
    factor = _factor(effort)
    if factor is not None:
        remark += f"; its unit {one_line(str(effort.signal.unit))} is not understood: write the factor from N to it"
    return Link("driver.effort", [f"{PLANT}.{effort.signal.name}"], remark, factor)


def _to_odometer(roles: PlantRoles) -> Link:
    found = roles.wheel_speed or roles.speed
    assert found is not None
    signal, remark = found.signal, guessed(found)
    if roles.wheel_speed is None:
        remark += "; no speed of a wheel was found, so this odometer never slips"
    if fits(signal, "rad/s"):
        assert signal.meaning is not None
        remark += f"; times the wheel radius, {RADIUS} m: WRITE YOURS"
        return Link(f"{PLANT}.{signal.name}", ["odometer.wheel_speed"], remark, RADIUS * signal.meaning.factor)
    if signal.unit is None:
        remark += "; it declares no unit: m/s is assumed"
    factor = _factor(found)
    if factor is not None:
        remark += f"; its unit {one_line(str(signal.unit))} is not understood: write the factor to m/s"
    return Link(f"{PLANT}.{signal.name}", ["odometer.wheel_speed"], remark, factor)


def _factor(found: Guess) -> float | None:
    """A factor to be edited where nobody can convert the unit."""
    return None if found.signal.readable else 1.0


# -- components
# ---------------------------------------------------------------------------------------------------------


def _plant(look: Look, fmu: str, roles: PlantRoles) -> list[str]:
    lines = [f"[components.{PLANT}]", entry("fmu", fmu), ""]
    used = roles.effort.signal.name if roles.effort else None
    others = [s for s in look.inputs if s.name != used]
    settings = [s for s in look.parameters if s.start is not None and not s.name.endswith("]")]
    if not others and not settings:
        return lines
    lines += comment("Other inputs keep their start values, and so do parameters; take away a # to set one.")
    lines += [f"[components.{PLANT}.parameters]"]
    lines += [
        f"# {entry(s.name, s.start or 0.0)}  # [{one_line(s.unit or '-')}] input: {one_line(s.description)}"
        for s in others[:10]
    ]
    lines += [
        f"# {entry(s.name, s.start)}  # [{one_line(s.unit or '-')}] {one_line(s.description)}" for s in settings[:20]
    ]
    lines += [f"# ... and {len(settings) - 20} more, see: cosim info"] if len(settings) > 20 else []
    return [*lines, ""]


def _driver(roles: PlantRoles) -> list[str]:
    if roles.effort is None:
        return []
    return [
        *comment(
            "A driver who follows a speed profile by the odometer: 50 km/h in 20 s, hold. Its gains suit 90 t; scale "
            "them "
            "and the effort limit with the mass of your train."
        ),
        "[components.driver]",
        'model = "driver"',
        "",
        "[components.driver.parameters]",
        "# effort_limit = 350e3  # [N]",
        "# profile_time = [0.0, 20.0, 65.0, 85.0, 85.0, 85.0, 85.0, 85.0]  # [s]",
        "# profile_speed = [0.0, 13.9, 13.9, 0.0, 0.0, 0.0, 0.0, 0.0]  # [m/s]",
        "",
    ]


def observer_table(observer: str, mass: Guess | None) -> list[str]:
    """The table of a shipped observer, with the mass of the train where it wants one."""
    system = OBSERVERS[observer]()
    known = {s.name: s.start for s in (*system.parameters, *system.states)}
    lines = [f"[components.{OBSERVER}]", entry("observer", observer)]
    if observer in PRESETS:
        lines.append(f"{entry('preset', PRESETS[observer])}  # trusts the odometer between balises: stable at any gap")
    lines += ["", f"[components.{OBSERVER}.parameters]"]
    if "mass" in known:
        lines.append(_mass(mass, known["mass"]))
    if "estimated_speed" in known:
        lines.append(f"{entry('estimated_speed', 0.0)}  # [m/s] what it believes at the start")
    return [*lines, ""]


def _mass(found: Guess | None, otherwise: object) -> str:
    start = None if found is None else found.signal.start
    if found is None or start is None or not start > 0.0:
        return (
            f"{entry('mass', otherwise)}  # [kg] WRITE THE MASS OF YOUR TRAIN: the FMU has no parameter that looks "
            f"like it"
        )
    factor = found.signal.meaning.factor if found.signal.meaning is not None else 1.0
    said = guessed(found).strip().removeprefix("# ")
    return f"{entry('mass', start * factor)}  # [kg] start value of {one_line(found.signal.name)}; {said}"


# -- balises, report, expectations
# --------------------------------------------------------------------------------------


def _balises(position: Guess | None, speed: Guess | None) -> list[str]:
    """The table of balises; as comment where they cannot be found."""
    lacking = [
        what for what, found in (("position", position), ("speed", speed)) if found is None or not found.signal.readable
    ]
    lines = [
        "[balises]",
        _role("position", position),
        _role("speed", speed),
        'odometer = "odometer.reading"',
        'layout = "spacing"',
        "spacing = 100.0  # [m]",
        "first = 50.0  # [m]",
        "track_end = 5000.0  # [m]",
        "expected_speed = 5.0  # [m/s] the slowest, to predict the gaps between balises for the certificate",
        "latency = 0.05  # [s] from crossing to delivery",
        "",
    ]
    if not lacking:
        return lines
    words = (
        f"No output was found for the train's {' and '.join(lacking)} (or its unit is not understood): balises need it."
    )
    return [*comment(words + " Write its name and take away the #."), *(f"# {line}" if line else "" for line in lines)]


def _role(key: str, found: Guess | None) -> str:
    if found is None:
        return f'{key} = "{PLANT}.NAME"'
    unit = f"; it declares no unit: {ASSUMED[key]} is assumed" if found.signal.unit is None and key in ASSUMED else ""
    return entry(key, f"{PLANT}.{found.signal.name}") + guessed(found) + unit


def _report(roles: PlantRoles) -> list[str]:
    lines = ["[report]"]
    for key, found in (
        ("true_position", roles.position),
        ("true_speed", roles.speed),
        ("true_slip", roles.slip),
        ("true_adhesion_force", roles.adhesion),
    ):
        usable = found is not None and found.signal.readable
        lines.append(_role(key, found) if usable else f'# {key} = "{PLANT}.NAME"  # not found')
    lines += ['odometer = "odometer.reading"']
    lines += ['speed_reference = "driver.speed_reference"'] if roles.effort is not None else []
    return [*lines, "evaluate_after = 5.0  # [s] errors count from here on", ""]


def expectations(observers: Sequence[str] = (OBSERVER,)) -> list[str]:
    """A hint how the run becomes a test."""
    return [
        *comment(
            "What the run must fulfil; cosim run ends with 1 where it does not. Write your own limit and take away the "
            "#."
        ),
        "# [[expect]]",
        '# check = "speed_error"',
        f'# of = "{observers[0]}"',
        "# from = 10.0  # [s]",
        "# max = 0.5  # [m/s]",
    ]

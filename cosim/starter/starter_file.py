"""Writing a starter scenario: inspect an FMU, guess, write a file that loads. Touches that file only."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmpy.model_description import DefaultExperiment, ModelVariable

from cosim.components.start_values import declared_start, start_values
from cosim.errors import CosimError, OutputError, ScenarioError, nearest
from cosim.scenario.paths import move_file, relative
from cosim.scenario.schema import step_count
from cosim.simulation.scenario import Scenario
from cosim.starter.guessed_signal import Guess
from cosim.starter.inspected_fmu import InspectedFmu, number
from cosim.starter.known_facts import find_facts
from cosim.starter.starter_roles import ObserverRoles, PlantRoles, is_observer, observer_roles, plant_roles
from cosim.starter.toml_lines import LISTED, GuessedLink, comment, entry, guessed, inline, listing, one_line
from cosim.starter.train_starter import declared_observer, default_observer, train, train_times
from fmu_observer import OBSERVERS
from fmus.fmi.types import NUMERIC_TYPES
from fmus.templates import environment
from plant_models.user_file import names_code

_WANTED = "odometer"
"""Input that an observer must have for a starter to connect it."""


STOP, STEP, STEPS = 10.0, 0.01, 1000
_COLUMNS_NAMED = 6


def _observer_beside(inspected: InspectedFmu, roles: ObserverRoles) -> dict[str, Any]:
    """What the template of this starter inserts."""
    stop, step, source = train_times(inspected)
    links = [
        GuessedLink("driver.effort", ["plant.effort"]),
        GuessedLink("plant.wheel_speed", ["odometer.wheel_speed"]),
        GuessedLink("odometer.reading", ["driver.odometer"]),
        *_to_observer("driver.effort", roles.effort),
        *_to_observer("odometer.reading", roles.odometer),
    ]
    title = f"{one_line(inspected.path.name)} beside the shipped locomotive"
    return {"title": title, "stop": stop, "step": step, "source": source, "links": links}


def _to_observer(source: str, found: Guess | None) -> list[GuessedLink]:
    if found is None:
        return []
    factor = None if found.signal.readable else 1.0
    return [GuessedLink(source, [f"observer.{found.signal.name}"], guessed(found), factor)]


def alone(inspected: InspectedFmu) -> dict[str, Any]:
    """What the template of this starter inserts.

    Args:
        inspected: what the FMU says.

    Returns:
        Values by name.
    """
    stop, step, source = times(inspected)
    inputs = [v for v in inspected.component.variables.values() if v.causality == "input"]
    hidden = inspected.component.event_references()
    names = [v.name for v in inputs if v.type in NUMERIC_TYPES and v.valueReference not in hidden]
    return {
        "title": f"{one_line(inspected.path.name)} alone",
        "stop": stop,
        "step": step,
        "source": source,
        "has_inputs": bool(inputs),
        "inputs": [_input(inspected, v) for v in inputs[:LISTED] if v.valueReference not in hidden],
        "columns": ["time", *map(one_line, names[:_COLUMNS_NAMED]), *(["..."] if len(names) > _COLUMNS_NAMED else [])],
        "first": names[0] if names else "NAME",
    }


def times(inspected: InspectedFmu) -> tuple[float, float, str]:
    """When the run stops and how long its steps are.

    Args:
        inspected: what the FMU says.

    Returns:
        Stop and step [s], and where they come from.
    """
    advised = inspected.description.defaultExperiment or DefaultExperiment()
    stop, length = number(advised.stopTime), number(advised.stepSize)
    start = number(advised.startTime) or 0.0
    if stop is None or start != 0.0 or stop <= 0.0:
        return STOP, STEP, "the FMU names no end of a run; write your own"
    try:
        step_count(0.0, stop, length or 0.0)
    except ValueError:
        length = None
    return stop, length or stop / STEPS, "from the FMU's default experiment"


def _input(inspected: InspectedFmu, variable: ModelVariable) -> str:
    """An input's start value, as a comment where it has none or the master would not take it."""
    unit, said = inspected.component.unit_name(variable.name) or "-", one_line(variable.description or "")
    remark = f"  # [{one_line(unit)}] {said}".rstrip()
    value = declared_start(variable)
    if value is None:
        kind = f"{variable.type} array" if variable.shape else str(variable.type)
        return f"# {entry(variable.name, 0.0).rpartition(' = ')[0]} = ...{remark} ({kind})"
    try:
        start_values(inspected.component, {variable.name: value})
    except CosimError as error:
        return (
            f"# {entry(variable.name, value)}{remark} - its own start value does not fit it: "
            f"{one_line(str(error), 200)}"
        )
    return entry(variable.name, value) + remark


def _render(kind: str, **values: Any) -> str:
    """A scenario file as text."""
    files = environment("cosim.starter")
    filters: dict[str, Any] = {
        "comment": comment,
        "guessed": guessed,
        "one_line": one_line,
        "python": repr,
        "shell": shlex.quote,
    }
    files.filters |= filters | {"toml": inline}
    return files.get_template(f"{kind}.toml.j2").render(entry=entry, listing=listing, **values)


@dataclass(frozen=True)
class Starter:
    """A starter scenario.

    Args:
        text: of the file.
        kind: ``train``, ``observer`` or ``alone``.
        remarks: what the user should know, a line each.
    """

    text: str
    kind: str
    remarks: list[str]


@dataclass(frozen=True)
class StarterWishes:
    """How a starter is to be made.

    Args:
        observer: name of the observer to put beside a plant, or ``file.py:Class``; by default `quasi_lpv_uio`, and
            `odometer_reset` beside a plant without an effort.
        assumed: what is known of the FMU's variables, as ``vIst=km/h``, ``Fsoll=effort,kN`` or ``x=-m/s`` each.
        probe: whether an FMU that declares too little is run for some seconds, in a process of its own.
    """

    observer: str | None = None
    assumed: Sequence[str] = ()
    probe: bool = True


USUAL = StarterWishes()


def starter(fmu: str | Path, target: str | Path, wishes: StarterWishes = USUAL) -> Starter:
    """A starter scenario for an FMU; nothing is written. An FMU that declares its units is not executed.

    Args:
        fmu: path of the FMU. target: the scenario file to be; paths in the text are relative to it. wishes: see there.

    Returns:
        The text of the file, and what the user should know.

    Raises:
        FmuLoadError: the FMU cannot be read, or offers no co-simulation. CouplingError: what is assumed cannot be.
        ScenarioError: there is no such observer, or it does not listen to an odometer.
    """
    observer = wishes.observer
    _check_observer(observer)
    path, target = Path(fmu), Path(target)
    known = find_facts(path, wishes.assumed, probing=wishes.probe)
    inspected = known.inspected
    place = relative(path, target.parent)
    roles = plant_roles(inspected)
    beside = observer or default_observer(roles)
    written = move_file(beside, lambda file: relative(file, target.parent))
    if is_observer(inspected):
        kind, values = "observer", _observer_beside(inspected, observer_roles(inspected))
    elif roles.is_train:
        kind, values = "train", train(inspected, roles, beside, written, known.radius)
    else:
        kind, values = "alone", alone(inspected)
    shared = {
        "inspected": inspected,
        "fmu": place,
        "target": target.name,
        "about": _about(inspected),
        "listed": LISTED,
    }
    text = _render(kind, guesses=kind != "alone", known=known, **shared, **values)
    return Starter(text, kind, [*known.remarks, *_remarks(inspected, kind, roles, observer)])


def write_starter(
    fmu: str | Path, target: str | Path, wishes: StarterWishes = USUAL, *, force: bool = False
) -> Starter:
    """Write a starter scenario for an FMU, see `starter`.

    Args:
        fmu: path of the FMU. target: the scenario file; paths in it are relative to it. wishes: see there.
        force: replace a file that exists.

    Returns:
        The text of the file, and what the user should know.

    Raises:
        OutputError: the file exists, or cannot be written.
        CosimError: as `starter`.
    """
    target = Path(target)
    if target.suffix != ".toml":
        raise OutputError(f"{target}: a scenario file ends in .toml.")
    made = starter(fmu, target, wishes)  # first, since without an FMU there is nothing to write
    if target.exists() and not force:
        raise OutputError(f"{target} exists already; choose another name with -o, or replace it with --force.")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(made.text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"The scenario cannot be written to {target}: {error.strerror or error}.") from error
    _remark_on_structure(made, target)
    return made


def _remark_on_structure(made: Starter, target: Path) -> None:
    """What a run of the written file would warn of, or refuse."""
    try:
        structure = Scenario.load(target).structure()
    except CosimError as error:
        made.remarks.append(f"As written it would be refused; edit it first: {error}")
    else:
        made.remarks.extend(structure.warnings)


def _check_observer(observer: str | None) -> None:
    if observer is None:
        return
    known = names_code(observer) or observer in OBSERVERS
    if not (known and _WANTED in {s.name for s in declared_observer(observer).inputs}):
        able = [name for name in OBSERVERS if _listens(name)]
        raise ScenarioError(f"No observer {observer!r} that listens to an odometer; {nearest(observer, able)}")


def _listens(name: str) -> bool:
    try:
        return _WANTED in {s.name for s in declared_observer(name).inputs}
    except ScenarioError:  # of an installed package that is wrong
        return False


def _about(inspected: InspectedFmu) -> str:
    """What the FMU is, on one line."""
    description = inspected.description
    about = f"{one_line(inspected.path.name)}: {one_line(str(description.modelName))}, FMI {description.fmiVersion}"
    return about + (f", made with {one_line(description.generationTool)}" if description.generationTool else "")


def _remarks(inspected: InspectedFmu, kind: str, roles: PlantRoles, observer: str | None) -> Iterator[str]:
    if inspected.runs_here != "yes":
        reason = inspected.runs_here.removeprefix("no, it ").removesuffix(".")
        yield f"The scenario will not run here yet: {inspected.path.name} {reason}."
    if kind == "alone":
        yield "Nothing in the FMU looks like the position or speed of a train: the scenario runs it alone."
    if kind != "train" and observer is not None:
        yield f"{observer} was not used."
    if kind == "train":
        found = {
            "position": roles.position,
            "speed": roles.speed,
            "wheel speed": roles.wheel_speed,
            "effort": roles.effort,
        }
        for what, role in found.items():
            yield f"{what}: " + (
                "not found" if role is None else f"{role.signal.name} ({role.sureness}, {role.reason})"
            )

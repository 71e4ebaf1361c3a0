"""Which observers an FMU or a scenario can drive: those whose inputs and events it has something for. Reads
descriptions only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from cosim.run.connections import parse_connections
from cosim.run.described_components import describe_component
from cosim.run.task import RunTask
from cosim.simulation.scenario import Scenario
from cosim.starter.inspected_fmu import inspect_fmu
from cosim.starter.starter_roles import plant_roles
from fmu_observer import OBSERVERS
from fmu_observer.recommended import RECOMMENDED
from fmus.catalogue import CatalogueEntry

BALISE, PACKET = "balise", "packet"
"""Events that a scenario triggers."""


@dataclass(frozen=True)
class FittingObservers:
    """Which observers fit.

    Args:
        available: names of signals and events that there is something for. names: of the observers that fit, the
            recommended ones first. misfits: what each of the others lacks.
    """

    available: Set[str]
    names: Sequence[str]
    misfits: Mapping[str, str]


def find_fitting(path: Path, known: Mapping[str, CatalogueEntry]) -> FittingObservers:
    """The observers that an FMU or a scenario can drive.

    Args:
        path: of the FMU, or file or name of the scenario. known: the catalogue.

    Raises:
        CosimError: the file cannot be read.
    """
    available = _of_fmu(path) if path.suffix.lower() == ".fmu" else _of_scenario(path)
    order = [*RECOMMENDED, *(name for name in OBSERVERS if name not in RECOMMENDED)]
    misfits = {name: _misfit(known[name], available) for name in order}
    fitting = [name for name in order if not misfits[name]]
    return FittingObservers(available, fitting, {name: why for name, why in misfits.items() if why})


def _of_fmu(path: Path) -> Set[str]:
    """Names of inputs and events that a starter scenario of an FMU has a source for."""
    inspected = inspect_fmu(path)
    roles = plant_roles(inspected)
    names = {signal.name for signal in inspected.outputs}
    names |= {"effort"} if roles.effort is not None or roles.applied is not None else set()
    names |= {"odometer"} if roles.speed is not None or roles.wheel_speed is not None else set()
    return names | ({BALISE} if roles.position is not None and roles.speed is not None else set())


def _of_scenario(path: Path) -> Set[str]:
    """Names of outputs, of inputs that are connected, and of events, in a scenario."""
    scenario = Scenario.load(path)
    table = scenario.table()
    links = parse_connections(table.connections, scenario.where)
    task = RunTask(table, scenario.name, scenario.folder, scenario.where)
    with task.named_in_errors():
        names = {
            output
            for name, component in table.components.items()
            for output in describe_component(name, component, task.folder, task.where, links=links).names("output")
        }
    for source, target, *_ in links:
        names |= {end.partition(".")[2] for end in (source, target)}
    names |= {BALISE} if table.balises is not None else set()
    return names | ({PACKET} if table.network is not None else set())


def _misfit(entry: CatalogueEntry, available: Set[str]) -> str:
    """What an observer lacks, or an empty text."""
    missing = [name for name in entry.inputs if name not in available]
    if missing:
        return f"nothing gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if entry.events and not set(entry.events) & available:
        return f"nothing triggers its event{'s' if len(entry.events) > 1 else ''} {', '.join(entry.events)}"
    return ""

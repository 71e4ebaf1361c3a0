"""Which observers an FMU or a scenario can drive: those whose inputs and events it has something for. Reads
descriptions only.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from pathlib import Path

from cosim.run.connections import parse_connections
from cosim.run.described_components import describe_component
from cosim.simulation.scenario import Scenario
from cosim.starter.inspected_fmu import inspect_fmu
from cosim.starter.starter_roles import plant_roles
from fmu_observer import OBSERVERS
from fmu_observer.recommended import RECOMMENDED
from fmus.catalogue import CatalogueEntry
from fmus.cli.list_command import COLUMNS, summary
from fmus.cli.output import Output
from fmus.tables.table import Table

BALISE, PACKET = "balise", "packet"
"""Events that a scenario triggers."""


def fitting_output(path: Path, known: Mapping[str, CatalogueEntry]) -> Output:
    """The observers that fit, the recommended ones first, and why the others do not.

    Args:
        path: an FMU or a scenario. known: the catalogue.

    Raises:
        CosimError: the file cannot be read.
    """
    given = _of_fmu(path) if path.suffix.lower() == ".fmu" else _of_scenario(path)
    order = [*RECOMMENDED, *(name for name in OBSERVERS if name not in RECOMMENDED)]
    misfits = {name: _misfit(known[name], given) for name in order}
    fitting = [name for name in order if not misfits[name]]
    table = Table("observers", COLUMNS, [[name, RECOMMENDED.get(name) or summary(known[name])] for name in fitting])
    used = {name for entry in OBSERVERS for name in (*known[entry].inputs, *known[entry].events)}
    signals = ", ".join(sorted(given & used)) or "nothing that an observer reads"
    said = [f"{path} has: {signals}.", "observers that fit:" if fitting else "No observer fits."]
    end = f"{len(order) - len(fitting)} others need what is not there; --json names it for each."
    data = {"available": sorted(given), "observers": fitting, "misfits": {n: why for n, why in misfits.items() if why}}
    return Output([*said, table, end], data)


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
    names = {
        output
        for name, component in table.components.items()
        for output in describe_component(name, component, scenario.folder, scenario.where).names("output")
    }
    for source, target, *_ in parse_connections(table.connections, scenario.where):
        names |= {end.partition(".")[2] for end in (source, target)}
    names |= {BALISE} if table.balises is not None else set()
    return names | ({PACKET} if table.network is not None else set())


def _misfit(entry: CatalogueEntry, given: Set[str]) -> str:
    """What an observer lacks, or an empty text."""
    missing = [name for name in entry.inputs if name not in given]
    if missing:
        return f"nothing gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if entry.events and not set(entry.events) & given:
        return f"nothing triggers its event{'s' if len(entry.events) > 1 else ''} {', '.join(entry.events)}"
    return ""

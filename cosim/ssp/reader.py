"""The balise reader of an exported system: it notifies the observers of balises where no master does.

Other tools know nothing of balises. The FMU `balise_reader`, wired to the watched plant and to every observer that is
notified by counts, finds them from position and speed. Read back, the package's own master takes its place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

from cosim.balises.layout import TrackLayout
from cosim.run.balise_service import BALISE_EVENT
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable
from cosim.ssp.common import FAMILIES, INTEGER
from cosim.ssp.interfaces import Interface
from plant_models.railway.track.balise_layout import UNUSED

NAME = "balise_reader"
READS_BALISES = "reads_balises"
"""Key of the annotation of the reader: it was added for other tools, and goes when the system is read back."""
NOTIFIED = ("count", "time", "position")
PAGE = 16
_PARALLEL = 0
"""Tools that read SSP step all components with the outputs of the step before (OMSimulator, libcosim)."""


@dataclass(frozen=True)
class Reader:
    """A reader on its way into a package.

    Args:
        name: of its component. table: of that. links: its connections, as a scenario writes them.
    """

    name: str
    table: ComponentTable
    links: Sequence[str]


def make_reader(
    table: BalisesTable, layout: TrackLayout, interfaces: Mapping[str, Interface], taken: set[str], version: int
) -> Reader | None:
    """The reader that a system needs, or None where it has no observer that is notified by counts.

    Args:
        table: of the balises. layout: where they lie. interfaces: of all components.
        taken: inputs that have a source, as ``component.input``. version: of FMI.
    """
    listeners = [
        n
        for n, interface in interfaces.items()
        if is_notified_by_counts(interface) and (table.receivers is None or n in table.receivers)
    ]
    listeners = [n for n in listeners if not {f"{n}.{BALISE_EVENT}_{field}" for field in NOTIFIED} & taken]
    if not listeners or table.position is None or table.speed is None:
        return None
    name = NAME
    while name in interfaces:
        name += "_"
    links = [f"{table.position} -> {name}.position", f"{table.speed} -> {name}.speed"]
    links += [f"{name}.{BALISE_EVENT}_{field} -> {n}.{BALISE_EVENT}_{field}" for n in listeners for field in NOTIFIED]
    options, parameters = _track(table, [float(position) for position in layout.positions])
    component: dict[str, Any] = {"model": "balise_reader", "as": f"fmu{version}", "options": options}
    component["parameters"] = {"input_instant": _PARALLEL, **parameters}
    return Reader(name, ComponentTable.model_validate(component), links)


def _track(table: BalisesTable, places: list[float]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Options and parameters of the reader for balises at these places."""
    if table.layout == "spacing":
        return {}, {"first_balise": places[0], "balise_spacing": table.spacing, "balise_total": len(places)}
    capacity = PAGE * ceil(len(places) / PAGE)  # few different FMUs, so that most need not be built
    return {"layout": "positions", "balise_capacity": capacity}, {
        "positions": places + [UNUSED] * (capacity - len(places))
    }


def is_notified_by_counts(interface: Interface) -> bool:
    """Whether an FMU takes balises as a count, an instant and a position.

    Args:
        interface: of a component's FMU.
    """
    inputs = {v.name: FAMILIES[str(v.type)] for v in interface.variables.values() if v.causality == "input"}
    fields = [f"{BALISE_EVENT}_{field}" for field in NOTIFIED]
    return all(field in inputs for field in fields) and inputs[fields[0]] == INTEGER

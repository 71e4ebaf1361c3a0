"""Connections of a scenario: lines ``source -> target, target`` and tables, as names with what happens between them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cosim.coupling.connection import Link
from cosim.coupling.transformation import Transformation
from cosim.errors import ScenarioError
from cosim.run.described_components import describe_component
from cosim.scenario.merging import BETWEEN_TARGETS
from cosim.scenario.scenario_tables import ConnectionTable
from cosim.scenario.schema import ScenarioTable
from plant_models.hybrid.units import UnitError


def parse_connections(items: Iterable[str | ConnectionTable], where: str) -> list[Link]:
    """Links (source, target) from lines such as ``driver.effort -> locomotive.effort, observer.effort``, with a
    transformation from tables.

    Args:
        items: as they stand in the scenario. where: name of the scenario, for messages.

    Raises:
        ScenarioError: a line has no arrow or an empty side.
    """
    links: list[Link] = []
    for number, item in enumerate(items, start=1):
        if isinstance(item, ConnectionTable):
            links.append((item.source, item.target, _transformation(item)))
            continue
        source, arrow, targets = (part.strip() for part in item.partition("->"))
        names = [target.strip() for target in BETWEEN_TARGETS.split(targets)]
        if not arrow or not source or not all(names):
            raise ScenarioError(
                f"{where}: connections, line {number}: {item!r} is not 'source.signal -> target.signal'."
            )
        links += [(source, name) for name in names]
    return links


def recorded_link(link: Link, table: ScenarioTable, folder: Path) -> Link:
    """A connection from a recording in place of a component: what is recorded stands in SI, and becomes the component's
    own number where the connection takes numbers without their unit.

    Args:
        link: of the scenario. table: of the scenario. folder: start of relative paths.
    """
    stated, (name, _, signal) = transformation(link), link[0].partition(".")
    if stated.convert_units or name not in table.components:
        return link
    source = describe_component(name, table.components[name], folder, table.title)
    try:
        unit = source.unit(signal)
    except UnitError:  # nobody understands it: it was recorded as it is
        return link
    return link if unit is None else (link[0], link[1], stated.of_converted(unit.factor, unit.offset))


def transformation(link: Link) -> Transformation:
    """What a connection does to a number besides units.

    Args:
        link: the connection.
    """
    return link[2] if len(link) == 3 else Transformation()


def _transformation(table: ConnectionTable) -> Transformation:
    return Transformation(table.factor, table.offset, table.units == "convert", tuple(table.values))

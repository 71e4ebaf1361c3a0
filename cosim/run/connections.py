"""Connections of a scenario: lines ``source -> target, target`` and tables, as names with what happens between them."""

from __future__ import annotations

from collections.abc import Iterable

from cosim.coupling.connection import Link
from cosim.coupling.transformation import Transformation
from cosim.errors import ScenarioError
from cosim.scenario.merging import BETWEEN_TARGETS
from cosim.scenario.scenario_tables import ConnectionTable


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


def _transformation(table: ConnectionTable) -> Transformation:
    return Transformation(table.factor, table.offset, table.units == "convert", tuple(table.values))

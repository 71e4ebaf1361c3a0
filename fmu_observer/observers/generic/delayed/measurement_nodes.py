"""Which node of a network each measurement of a model is on. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid.option import require_whole


def nodes_of_measurements(observer: str, model: ObserverModel, nodes: Sequence[int]) -> tuple[int, ...]:
    """Number of the node, from 1, of each measurement.

    Args:
        observer: its name, for messages. model: whose measurements. nodes: as given; empty for a node each.

    Raises:
        ValueError: not one whole number from 1 for each measurement.
    """
    count = len(model.measurements)
    if not nodes:
        return tuple(range(1, count + 1))
    require_whole(observer, **{f"nodes, entry {i}": node for i, node in enumerate(nodes, 1)})
    if len(nodes) != count:
        raise ValueError(
            f"{observer}: nodes has {len(nodes)} entries; expected one for each of the {count} "
            f"measurements of the model {model.name!r}: {', '.join(s.name for s in model.measurements)}."
        )
    return tuple(map(int, nodes))


def turns_of_nodes(nodes: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Measurements of each node, from 0: the turns of a round.

    Args:
        nodes: of each measurement, as `nodes_of_measurements` gives them.
    """
    return tuple(tuple(i for i, of in enumerate(nodes) if of == node) for node in sorted(set(nodes)))

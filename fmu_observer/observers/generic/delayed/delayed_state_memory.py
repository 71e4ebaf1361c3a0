"""Memory of the delayed-state observer, and which node of the network each of its measurements is on."""

from __future__ import annotations

from collections.abc import Sequence

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid import Signal, memory
from plant_models.hybrid.option import require_whole


def declared_memory(model: ObserverModel, predictors: int, places: int, input_places: int) -> tuple[Signal, ...]:
    """What is remembered, a row of a matrix for each input, predictor, or rate of a predictor.

    Args:
        model: of the observer; predictions start at its start. predictors: how many there are. places: of the rates of
            each predictor. input_places: mean inputs of each input.
    """
    n, m = model.order, len(model.inputs)
    start = model.start
    newest = "the newest first"
    of_inputs = (
        memory("past_input", "1", 0.0, f"Mean inputs of the last periods, {newest}", shape=(m, input_places)),
        memory("delayed_input", "1", 0.0, "Mean inputs a delay ago, which act on the delayed state", size=m),
    )
    of_predictors = (
        memory("distance_root", "1", 0.0, "Signed roots of the distances s of the predictors", shape=(predictors, n)),
        memory(
            "prediction",
            "1",
            start,
            "Predicted states at the last reading, predictor by predictor",
            shape=(predictors, n),
        ),
        memory("past_rate", "1", 0.0, f"Rates f of the predictors, {newest}", shape=(predictors * n, places)),
        memory("prediction_offset", "1", 0.0, "State now less the delayed one, at the last reading", size=n),
        memory("prediction_offset_rate", "1", 0.0, "Rate of it", size=n),
    )
    return (
        *(of_inputs if m else ()),
        *(of_predictors if predictors else ()),
        memory("reading_time", "1", 0.0, "Instant of the last reading", size=1),
        memory("reading_begun", "1", 0.0, "1 after the first reading", size=1),
    )


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

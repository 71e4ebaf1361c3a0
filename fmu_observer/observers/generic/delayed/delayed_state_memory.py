"""Declaration of the memory of the delayed-state observer."""

from __future__ import annotations

from fmu_observer.models.observer_model import ObserverModel
from plant_models.hybrid import Signal, memory


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

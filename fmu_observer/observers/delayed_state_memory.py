"""Memory of the delayed-state observer: what is declared, and its parts by name. Pure; knows no system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fmu_observer.models import ObserverModel
from plant_models.hybrid import Signal, memory
from plant_models.hybrid.system import Array


class DelayedStateMemory(NamedTuple):
    """Memory of the observer.

    Args:
        means: mean inputs, of each the newest first. acting: inputs that act on the delayed state.
        roots: signed roots of the distances, by predictor. predictions: states at the last reading, by predictor.
        rates: by predictor and state, the newest first. offset: state now less the delayed one. drift: its rate.
        read_at: instant of the last reading [s]. begun: 1 after the first reading.
    """

    means: list[list[Array]]
    acting: list[Array]
    roots: list[list[Array]]
    predictions: list[list[Array]]
    rates: list[list[list[Array]]]
    offset: list[Array]
    drift: list[Array]
    read_at: Array
    begun: Array


class MemorySizes(NamedTuple):
    """How much is remembered.

    Args:
        states: n of the model. inputs: of the model. predictors: m. places: of the rates of each predictor.
        input_places: mean inputs of each input.
    """

    states: int
    inputs: int
    predictors: int
    places: int
    input_places: int

    def unpack(self, values: Sequence[Array]) -> DelayedStateMemory:
        """The memory by name.

        Args:
            values: of the declared memory, in its order.
        """
        cursor, (n, m, k) = 0, self[:3]

        def take(count: int) -> list[Array]:
            nonlocal cursor
            cursor += count
            return [values[i] for i in range(cursor - count, cursor)]

        means = [take(self.input_places) for _ in range(m)]
        acting = take(m)
        roots, predictions = [take(n) for _ in range(k)], [take(n) for _ in range(k)]
        rates = [[take(self.places) for _ in range(n)] for _ in range(k)]
        offset, drift = (take(n), take(n)) if k else ([], [])
        read_at, begun = take(2)
        return DelayedStateMemory(means, acting, roots, predictions, rates, offset, drift, read_at, begun)


def declared_memory(model: ObserverModel, sizes: MemorySizes) -> tuple[Signal, ...]:
    """Declaration of the memory, in the order in which `MemorySizes.unpack` takes it.

    Args:
        model: of the observer; predictions start at its start. sizes: how much is remembered.
    """
    n, m, k = sizes[:3]
    starts = prediction_starts(model, k)
    offset = n if k else 0
    entries = (
        ("past_input", m * sizes.input_places, None, "Mean inputs of the last periods, the newest first"),
        ("delayed_input", m, None, "Mean inputs a delay ago, which act on the delayed state"),
        ("distance_root", n * k, None, "Signed roots of the distances s of the predictors"),
        ("prediction", n * k, starts, "Predicted states at the last reading, predictor by predictor"),
        ("past_rate", n * k * sizes.places, None, "Rates f of the predictors, the newest first"),
        ("prediction_offset", offset, None, "State now less the delayed one, at the last reading"),
        ("prediction_offset_rate", offset, None, "Rate of it"),
        ("reading_time", 1, None, "Instant of the last reading"),
        ("reading_begun", 1, None, "1 after the first reading"),
    )
    return tuple(
        memory(name, "1", 0.0 if start is None else start, text, size=size)
        for name, size, start, text in entries
        if size
    )


def prediction_starts(model: ObserverModel, predictors: int) -> tuple[float, ...]:
    """Starts of the predictions, predictor by predictor.

    Args:
        model: of the observer. predictors: how many there are.
    """
    return tuple(float(s.start_values[0]) for s in model.states) * predictors

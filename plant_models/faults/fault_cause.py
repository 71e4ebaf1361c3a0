"""The cause of a fault: when a signal is wrong, by how much, and which way. Knows the hybrid foundation alone.

A new file with a `FaultCause` in ``plant_models/faults/causes`` is a cause of all systems that pass signals on.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np

from plant_models.hybrid import Array
from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import Signal, input_signal, parameter

UNLIMITED = 1e9  # [N]; the adhesion where nobody says what it is
EFFORT = input_signal("effort", "N", 0.0, "Effort demanded of the train: traction > 0, brake < 0")
ADHESION_LIMIT = input_signal("adhesion_limit", "N", UNLIMITED, "Largest force that the rails can take", optional=True)
BRAKE_RELEASED = input_signal(
    "brake_released", "1", 0.0, "1 while the brake is released because of a fault", optional=True
)
RELEASE_TIME = parameter("release_time", "s", 0.146, "From the release of the brake to a wheel that rolls", min=1e-6)


class Fault(NamedTuple):
    """What is wrong at an instant: a signal becomes ``value (1 + depth) + added``.

    Args:
        depth: share of the signals that is missing (negative) or too much (positive) [1].
        added: what is added to each of the signals, in their unit.
        acting: 1 while a fault acts that `depth` does not show, else 0 [1].
        unfinished: number of faults that are not over yet [1].
    """

    depth: Array = 0.0
    added: Sequence[Array] = ()
    acting: Array = 0.0
    unfinished: Array = 0.0


class Carrier(NamedTuple):
    """What a cause acts on.

    Args:
        unit: of the signals. channels: number of them. fault_count: number of faults, for causes that list them.
    """

    unit: str = "1"
    channels: int = 1
    fault_count: int = 1


class FaultCause(ABC):
    """Base of all causes: signals, states and equations that join those of the system that passes signals on.

    The contract:

    1. A subclass sets `name` and `description`, and what it has of `parameters`, `inputs`, `states` (continuous ones
       first), `switchings` and `events`, as class attributes, or in ``__init__`` behind that of the base.
    2. An input or parameter that the system has too is the system's (`effort` of `wheel_fault`); any other name is new.
    3. `fault`, `rates`, `switching` and `jump` are pure NumPy without branching on values, as in `HybridSystem`. They
       take the time `t` [s], by name the states `x`, inputs `u` (with noises) and parameters `p` of the whole system,
       as `passed` 1 for each switching function that is not negative, else 0, and the `values` of the signals.
    4. `turned` says what the same faults with the other sign are, `ranges` from where to where studies draw which
       parameters [unit of each].

    Args:
        carrier: what the cause acts on.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    ranges: ClassVar[tuple[tuple[str, float, float], ...]] = ()
    inputs: tuple[Signal, ...] = ()
    parameters: tuple[Signal, ...] = ()
    states: tuple[Signal, ...] = ()
    switchings: tuple[str, ...] = ()
    events: tuple[PeriodicEvent, ...] = ()

    def __init__(self, carrier: Carrier) -> None:
        self.carrier = carrier

    @abstractmethod
    def fault(self, t: Array, x: Any, u: Any, p: Any, passed: Array, values: Sequence[Array]) -> Fault:
        """What is wrong now with the values that `carried` gives."""

    def carried(self, x: Any, values: Sequence[Array]) -> Sequence[Array]:
        """The values on which faults act: the signals themselves unless a cause holds them."""
        return values

    def rates(self, t: Array, x: Any, u: Any, p: Any, passed: Array) -> dict[str, Array]:
        """Derivatives of the continuous states of the cause."""
        return {}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        """Functions that change their sign where a fault begins or ends, so that this is an exact event."""
        return ()

    def jump(self, t: Array, x: Any, u: Any, p: Any, values: Sequence[Array]) -> dict[str, Array]:
        """What the events of the cause change."""
        return {}

    def requirements(self, p: Any) -> dict[str, Array]:
        """What the parameters must fulfil together, see `HybridSystem.requirements`."""
        return {}

    def turned(self, p: Any) -> dict[str, Array] | None:
        """Values of the parameters with which all faults have the other sign; None where no parameter decides it."""
        return None


class TimedFaults(FaultCause):
    """Up to `fault_count` faults by their instants: fault i acts from ``fault_onset[i]`` on, for `lasting`.

    Its first switching functions are the onsets, then the ends.

    Args:
        carrier: what the cause acts on.
    """

    EDGES: ClassVar[tuple[str, ...]] = ("from", "to")

    def __init__(self, carrier: Carrier) -> None:
        super().__init__(carrier)
        self.count = carrier.fault_count
        self.switchings = tuple(f"fault_{edge}[{i + 1}]" for edge in self.EDGES for i in range(self.count))

    @abstractmethod
    def lasting(self, i: int, p: Any) -> Array:
        """For how long fault i acts [s]; 0 where it is not used."""

    def over(self, i: int, passed: Array) -> Array:
        """1 where fault i is over, else 0 [1]."""
        return passed[self.count + i]

    def window(self, i: int, passed: Array) -> Array:
        """1 while fault i acts, else 0 [1]."""
        return passed[i] * (1.0 - self.over(i, passed))

    def unfinished(self, p: Any, passed: Array) -> Array:
        """Number of the faults in use that are not over yet [1]."""
        return sum(one_where(self.lasting(i, p) > 0.0) * (1.0 - self.over(i, passed)) for i in range(self.count))

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        faults = range(self.count)
        begun = [t - p.fault_onset[i] for i in faults]
        return [*begun, *(t - (p.fault_onset[i] + self.lasting(i, p)) for i in faults)]


def one_where(condition: Array) -> Array:
    """1 where a condition holds, else 0 [1].

    Args:
        condition: a comparison, of numbers, batches or symbols.
    """
    return np.where(condition, 1.0, 0.0)

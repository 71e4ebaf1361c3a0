"""Why a wheel jams or skids: the states, parameters and equations of each cause.

A cause is what `wheel_fault` is made of; it knows the hybrid foundation and nothing of distances.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import Signal
from plant_models.hybrid.system import Array


class Fault(NamedTuple):
    """What the wheel does at an instant.

    Args:
        depth: share of the speed that is missing (negative, jam) or too much (positive, skid) [1].
        unfinished: number of faults that are not over yet [1].
    """

    depth: Array
    unfinished: Array


class FaultCause(Protocol):
    """States and equations of one cause.

    Attributes:
        parameters: beyond those that all causes share. continuous: states that flow. remembered: memory.
        switchings: names of the switching functions. events: periodic.
    """

    parameters: tuple[Signal, ...]
    continuous: tuple[Signal, ...]
    remembered: tuple[Signal, ...]
    switchings: tuple[str, ...]
    events: tuple[PeriodicEvent, ...]

    def fault(self, t: Array, x: Any, passed: Array, u: Any, p: Any) -> Fault:
        """What the wheel does.

        Args:
            t: time [s]. x: states of the wheel by name. passed: 1 for switching functions that are not
                negative, else 0, shape (k,). u: inputs. p: parameters.
        """

    def rates(self, t: Array, x: Any, passed: Array, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the continuous states.

        Args:
            t: time [s]. x: states of the wheel by name. passed: switches, shape (k,). u: inputs. p: parameters.
        """

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> list[Array]:
        """Switching functions.

        Args:
            t: time [s]. x: states of the wheel by name. u: inputs. p: parameters.
        """

    def jump(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What the periodic event of the cause changes.

        Args:
            t: time [s]. x: states of the wheel by name. u: inputs with the noises. p: parameters.
        """

    def requirements(self, p: Any) -> dict[str, Array]:
        """What the parameters of the cause must fulfil, see `HybridSystem.requirements`.

        Args:
            p: parameters.
        """


def one_where(condition: Array) -> Array:
    """1 where a condition holds, else 0 [1].

    Args:
        condition: a comparison, of numbers, batches or symbols.
    """
    return np.where(condition, 1.0, 0.0)


def braking_stopped(u: Any) -> Array:
    """1 while a brake is released by command, else 0 [1].

    Args:
        u: inputs of the wheel.
    """
    return one_where(u.brake_released > 0.5)

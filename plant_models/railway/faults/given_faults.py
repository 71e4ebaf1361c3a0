"""Faults of the wheel by their instants: each with onset, length, depth and kind.

One of the causes of `wheel_fault`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid.arrays import Array, vector
from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import Signal, parameter, state
from plant_models.railway.faults.fault_cause import Fault, braking_stopped, one_where


class GivenFaults:
    """Up to `count` faults in the order of time, fault i in ``[fault_onset[i], fault_onset[i] + fault_length[i])``.

    A jam ends earlier where the brake was released for `release_time` in it.

    Args:
        count: number of faults.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.parameters: tuple[Signal, ...] = (
            parameter("fault_onset", "s", 0.0, "Instant at which each fault begins", size=count),
            parameter("fault_length", "s", 0.0, "Length of each fault; 0 where it is not used", min=0.0, size=count),
            parameter("fault_depth", "1", 1.0, "Depth of each fault, 0 none to 1 full", min=0.0, max=1.0, size=count),
            parameter("fault_kind", "1", -1.0, "Kind of each fault: -1 jam, 1 skid", size=count),
        )
        self.continuous: tuple[Signal, ...] = (
            state("released_for", "s", 0.0, "For how long the brake was released in each jam", size=count),
        )
        self.remembered: tuple[Signal, ...] = ()
        self.switchings: tuple[str, ...] = tuple(
            f"fault_{edge}[{i + 1}]" for edge in ("from", "to", "freed") for i in range(count)
        )
        self.events: tuple[PeriodicEvent, ...] = ()

    def fault(self, t: Array, x: Any, passed: Array, u: Any, p: Any) -> Fault:
        """See `FaultCause.fault`.

        Args:
            t: time [s]. x: states of the wheel by name. passed: switches, shape (k,). u: inputs. p: parameters.
        """
        depth = sum(self._active(i, passed) * self._sign(i, p) * p.fault_depth[i] for i in range(self.count))
        over = [1.0 - (1.0 - passed[self.count + i]) * (1.0 - passed[2 * self.count + i]) for i in range(self.count)]
        used = [one_where(p.fault_length[i] > 0.0) for i in range(self.count)]
        return Fault(depth, sum(used[i] * (1.0 - over[i]) for i in range(self.count)))

    def rates(self, t: Array, x: Any, passed: Array, u: Any, p: Any) -> dict[str, Array]:
        """See `FaultCause.rates`.

        Args:
            t: time [s]. x: states of the wheel by name. passed: switches, shape (k,). u: inputs. p: parameters.
        """
        released = braking_stopped(u)
        jams = [one_where(p.fault_kind[i] < 0.0) for i in range(self.count)]
        return {"released_for": vector(*(released * self._active(i, passed) * jam for i, jam in enumerate(jams)))}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> list[Array]:
        """See `FaultCause.switching`.

        Args:
            t: time [s]. x: states of the wheel by name. u: inputs. p: parameters.
        """
        faults = range(self.count)
        begun = [t - p.fault_onset[i] for i in faults]
        ended = [t - (p.fault_onset[i] + p.fault_length[i]) for i in faults]
        return [*begun, *ended, *(x.released_for[i] - p.release_time for i in faults)]

    def jump(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Nothing jumps.

        Args:
            t: time [s]. x: states of the wheel by name. u: inputs. p: parameters.
        """
        return {}

    def requirements(self, p: Any) -> dict[str, Array]:
        """Faults are jams or skids, listed in the order of time, and do not overlap.

        Args:
            p: parameters.
        """
        needed: dict[str, Array] = {}
        latest: Array = -np.inf
        for i in range(self.count):
            text = f"fault {i + 1} is neither jam nor skid: fault_kind[{i + 1}] must be -1 (jam) or 1 (skid)"
            needed[text] = one_where(np.abs(np.abs(p.fault_kind[i]) - 1.0) < 1e-3)
            used = one_where(p.fault_length[i] > 0.0)
            if i:
                text = (
                    f"fault {i + 1} overlaps one before it in the list, or is listed behind a later one: set "
                    f"fault_onset[{i + 1}] behind the ends of those before it"
                )
                needed[text] = 1.0 - used * one_where(p.fault_onset[i] < latest)
            latest = np.where(used > 0.0, np.maximum(latest, p.fault_onset[i] + p.fault_length[i]), latest)
        return needed

    def _active(self, i: int, passed: Array) -> Array:
        n = self.count
        return passed[i] * (1.0 - passed[n + i]) * (1.0 - passed[2 * n + i])

    @staticmethod
    def _sign(i: int, p: Any) -> Array:
        return np.where(p.fault_kind[i] < 0.0, -1.0, 1.0)

"""Faults of the wheel caused by the adhesion that the train has: too much brake locks it, too much traction spins it.

One of the causes of `wheel_fault`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import Signal, parameter, state
from plant_models.hybrid.system import Array
from plant_models.railway.faults.fault_cause import Fault, braking_stopped, one_where


class AdhesionFaults:
    """The wheel goes to lock, linearly in `lock_time`, where the brake demanded is above the adhesion limit; to a skid
    of `spin_depth` where traction is; and back to rolling, at a full lock's length in `release_time`, where the demand
    is below `sliding_share` of the limit.

    Between the two limits a wheel that is more than half-way goes on, one that is less goes back: the hysteresis.
    """

    def __init__(self) -> None:
        self.parameters: tuple[Signal, ...] = (
            parameter("lock_time", "s", 0.1, "From rolling to a full lock or skid", min=1e-4),
            parameter("spin_depth", "1", 0.3, "Depth of a full skid", min=1e-3, max=1.0),
            parameter(
                "sliding_share", "1", 0.8, "Sliding adhesion over adhesion limit: below it a wheel rolls again", min=0.0
            ),
        )
        self.continuous: tuple[Signal, ...] = (state("slide", "1", 0.0, "Depth at start: -1 locked, 0 rolling"),)
        self.remembered: tuple[Signal, ...] = ()
        self.frictions: tuple[str, ...] = ("slide",)
        self.switchings: tuple[str, ...] = ("locked", "half_locked", "half_spun", "spun")
        self.events: tuple[PeriodicEvent, ...] = ()

    def fault(self, t: Array, s: list[Array], passed: Array, u: Any, p: Any) -> Fault:
        """See `FaultCause.fault`.

        Args:
            t: time [s]. s: states of the cause. passed: switches, shape (4,). u: inputs. p: parameters.
        """
        return Fault(np.clip(s[0], -1.0, p.spin_depth), 0.0)

    def rates(self, t: Array, s: list[Array], passed: Array, u: Any, p: Any) -> list[Array]:
        """See `FaultCause.rates`.

        Args:
            t: time [s]. s: states of the cause. passed: switches, shape (4,). u: inputs. p: parameters.
        """
        locking, spinning = _wanted(passed[1], passed[2], u, p)
        return [(-locking * passed[0] + spinning * (1.0 - passed[3]) * p.spin_depth) / p.lock_time]

    def friction(self, t: Array, s: list[Array], u: Any, p: Any) -> list[Array]:
        """See `FaultCause.friction`: what brings the wheel back to rolling, and no further.

        Args:
            t: time [s]. s: states of the cause. u: inputs. p: parameters.
        """
        locking, spinning = _wanted(*(one_where(beyond >= 0.0) for beyond in self.switching(t, s, u, p)[1:3]), u, p)
        return [(1.0 - locking - spinning) / p.release_time]

    def switching(self, t: Array, s: list[Array], u: Any, p: Any) -> list[Array]:
        """See `FaultCause.switching`.

        Args:
            t: time [s]. s: states of the cause. u: inputs. p: parameters.
        """
        return [s[0] + 1.0, s[0] + 0.5, s[0] - 0.5 * p.spin_depth, s[0] - p.spin_depth]

    def jump(self, t: Array, s: list[Array], u: Any, p: Any) -> list[Array]:
        """Nothing jumps.

        Args:
            t: time [s]. s: states of the cause. u: inputs. p: parameters.
        """
        return s

    def requirements(self, p: Any) -> dict[str, Array]:
        """Sliding adhesion is not above the limit.

        Args:
            p: parameters.
        """
        return {"sliding_share must be at most 1": one_where(p.sliding_share <= 1.0)}


def _wanted(above_half_lock: Array, above_half_spin: Array, u: Any, p: Any) -> tuple[Array, Array]:
    """1 where the wheel goes to lock, and 1 where it goes to spin, else 0."""
    brake = np.maximum(-u.effort, 0.0) * (1.0 - braking_stopped(u))
    traction = np.maximum(u.effort, 0.0)
    sliding = p.sliding_share * u.adhesion_limit
    locking = np.maximum(one_where(brake > u.adhesion_limit), (1.0 - above_half_lock) * one_where(brake > sliding))
    spinning = np.maximum(one_where(traction > u.adhesion_limit), above_half_spin * one_where(traction > sliding))
    return locking, spinning

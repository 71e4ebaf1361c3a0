"""Faults by their instants: each with onset, length, depth and kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models.faults.fault_cause import BRAKE_RELEASED, RELEASE_TIME, Carrier, Fault, TimedFaults, one_where
from plant_models.hybrid import Array, vector
from plant_models.hybrid.signal import parameter, state


class StatedFaults(TimedFaults):
    """Faults in the order of time, fault i in ``[fault_onset[i], fault_onset[i] + fault_length[i])``.

    A jam ends earlier where the brake was released for `release_time` in it.

    Args:
        carrier: what the cause acts on.
    """

    name = "stated"
    description = "Jams and skids by onset, length, depth and kind"
    ranges = (("fault_depth", 0.05, 1.0),)
    EDGES = ("from", "to", "freed")
    inputs = (BRAKE_RELEASED,)

    def __init__(self, carrier: Carrier) -> None:
        super().__init__(carrier)
        n = self.count
        self.parameters = (
            RELEASE_TIME,
            parameter("fault_onset", "s", 0.0, "Instant at which each fault begins", size=n),
            parameter("fault_length", "s", 0.0, "Length of each fault; 0 where it is not used", min=0.0, size=n),
            parameter("fault_depth", "1", 1.0, "Depth of each fault, 0 none to 1 full", min=0.0, max=1.0, size=n),
            parameter("fault_kind", "1", -1.0, "Kind of each fault: -1 jam, 1 skid", size=n),
        )
        self.states = (state("released_for", "s", 0.0, "For how long the brake was released in each jam", size=n),)

    def lasting(self, i: int, p: Any) -> Array:
        """The length of fault i [s]."""
        return p.fault_length[i]

    def over(self, i: int, passed: Array) -> Array:
        """1 where fault i has ended or the wheel was freed, else 0 [1]."""
        return 1.0 - (1.0 - passed[self.count + i]) * (1.0 - passed[2 * self.count + i])

    def fault(self, t: Array, x: Any, u: Any, p: Any, passed: Array, values: Sequence[Array]) -> Fault:
        """The depth of the fault that is on, with the sign of its kind."""
        signs = [np.where(p.fault_kind[i] < 0.0, -1.0, 1.0) for i in range(self.count)]
        depth = sum(self.window(i, passed) * sign * p.fault_depth[i] for i, sign in enumerate(signs))
        return Fault(depth, unfinished=self.unfinished(p, passed))

    def rates(self, t: Array, x: Any, u: Any, p: Any, passed: Array) -> dict[str, Array]:
        """The clocks of the jams run while the brake is released."""
        released = one_where(u.brake_released > 0.5)
        jams = [one_where(p.fault_kind[i] < 0.0) for i in range(self.count)]
        return {"released_for": vector(*(released * self.window(i, passed) * jam for i, jam in enumerate(jams)))}

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Sequence[Array]:
        """Onsets, ends, and where a jam is freed."""
        return [*super().switching(t, x, u, p), *(x.released_for[i] - p.release_time for i in range(self.count))]

    def requirements(self, p: Any) -> dict[str, Array]:
        """Faults are jams or skids, listed in the order of time, and do not overlap."""
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

    def turned(self, p: Any) -> dict[str, Array]:
        """Jams are skids."""
        return {"fault_kind": -np.asarray(p.fault_kind)}

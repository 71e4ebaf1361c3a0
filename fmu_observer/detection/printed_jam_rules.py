"""The jam rules as printed: Aguiar Cota 2019, Algorithm 3-3. Pure functions.

They can stay on for ever: while the odometer is discarded nothing corrects the estimate, and where the reading only
falls, as in a braking, no rule fires that believes it again.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.detection.jam_rules import ROUNDING, Judgement, Reading, Rules
from plant_models.hybrid import Array, Signal, memory, parameter
from plant_models.hybrid.arrays import indicator


class PrintedRules(Rules):
    """Algorithm 3-3 with ``|r|`` for r: (3.59) is negative in a jam.

    States N, F (measurement diverging), R (converging again); with the sample ``v_k`` and the estimate ``vh``

    1. ``|r| > eps`` and ``vh > v_k``: F = 1, N = 0
    2. F = 1 and ``v_{k-1} < v_k``: R = 1
    3. R = 1 and ``v_{k-1} > v_k``: R = F = 0, N = 1
    4. N = 1 and ``v_{k-1} < v_k``: R = F = 1, N = 0 (parameter `rule_4`)
    5. N = 0 and ``v_k = 0``: F = 1, N = 0

    New values take effect at the next sample (parameter `rule_delay`): the first reading of a jam is then used as any
    other. Rule 4 calls a noisy reading a fault: with a deceleration of 0.9 m/s2
    samples 0.2 s apart fall by 0.18 m/s, and noise of 0.05 m/s makes some of them rise. No rule is applied before
    `arming_delay` [ours; the print has none].
    """

    memory: tuple[Signal, ...] = (
        memory("fault_state", "1", 0.0, "F of Algorithm 3-3, in force"),
        memory("recovering_state", "1", 0.0, "R of Algorithm 3-3, in force"),
        memory("next_fault_state", "1", 0.0, "F from the next sample on"),
        memory("next_recovering_state", "1", 0.0, "R from the next sample on"),
        memory("last_odometer", "m/s", 0.0, "Reading before"),
        memory("samples", "1", 0.0, "Readings since the start"),
    )
    parameters: tuple[Signal, ...] = (
        parameter("rule_4", "1", 1.0, "1 where rule 4 is applied", min=0.0, max=1.0),
        parameter(
            "rule_delay", "1", 1.0, "Samples until a verdict takes effect: 1 printed, 0 at once", min=0.0, max=1.0
        ),
    )

    def at_sample(self, m: Any, reading: Reading, p: Any) -> Judgement:
        """Judge an odometer sample; it takes effect at the next one, or at once."""
        fault, recovering = m.next_fault_state, m.next_recovering_state  # in force from this sample on
        y, last = reading.odometer, m.last_odometer
        known = indicator(m.samples > 0.0)
        rises, falls = known * indicator(last < y), known * indicator(last > y)
        first = indicator(np.abs(reading.residual) > p.threshold) * indicator(reading.speed > y)
        fourth = (1.0 - fault) * rises * indicator(p.rule_4 > 0.5)
        new_fault, new_recovering = np.where(first > 0.0, 1.0, fault), np.where(fault * rises > 0.0, 1.0, recovering)
        done = recovering * falls
        new_fault, new_recovering = np.where(done > 0.0, 0.0, new_fault), np.where(done > 0.0, 0.0, new_recovering)
        new_fault = np.where(fourth > 0.0, 1.0, new_fault)
        new_recovering = np.where(fourth > 0.0, 1.0, new_recovering)
        new_fault = np.where(fault * indicator(y == 0.0) > 0.0, 1.0, new_fault)
        armed = indicator((m.samples + ROUNDING) * p.odometer_period >= p.arming_delay)
        new_fault, new_recovering, late = armed * new_fault, armed * new_recovering, p.rule_delay > 0.5
        after = {
            "fault_state": np.where(late, fault, new_fault),
            "recovering_state": np.where(late, recovering, new_recovering),
            "next_fault_state": new_fault,
            "next_recovering_state": new_recovering,
            "last_odometer": y,
            "samples": m.samples + 1.0,
        }
        return Judgement(after)

    def fault(self, m: Any) -> Array:
        """1 while F is in force."""
        return m.fault_state

    def recovering(self, m: Any) -> Array:
        """1 while R is in force."""
        return m.recovering_state

    def limit(self, m: Any, p: Any) -> Array:
        """eps [m/s], always."""
        return p.threshold

    def settled_time(self, m: Any, p: Any) -> Array:
        """Time since the start [s]: `arming_delay` is all that the printed rules wait for."""
        return m.samples * p.odometer_period

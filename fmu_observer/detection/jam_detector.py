"""The jam detector as a block of its own: whether an odometer lies, from the residual of any observer. Uses the rules
and nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from fmu_observer.detection.jam_rules import ROUNDING, SHARED_PARAMETERS, JamVerdict, Reading, Rules
from fmu_observer.detection.repaired_jam_rules import RepairedRules, certain_fault, doubt_limit
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.arrays import indicator
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, memory, parameter


class _PrintedRules(Rules):
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

    def at_sample(self, m: Any, reading: Reading, p: Any) -> JamVerdict:
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
        return JamVerdict(after)

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


NOISE = "odometer_noise"
RuleChoice = Literal["repaired", "printed"]
RULES: Mapping[str, Rules] = {"repaired": RepairedRules(), "printed": _PrintedRules()}
FAULT_OUTPUTS = (
    discrete_output("odometer_fault", "1", "1 while the odometer is judged to lie, else 0"),
    discrete_output("recovering", "1", "1 while it begins to be believed again, else 0"),
    discrete_output("residual_limit", "m/s", "Size of the residual at which the verdict changes"),
)
_SETTLED_TIME = discrete_output("settled_time", "s", "Time with a small residual; without any no fault is ever judged")
ODOMETER_SAMPLE = PeriodicEvent("odometer_sample", "odometer_period", description="The odometer is read")


def verdict(rules: Rules, m: Any, p: Any) -> dict[str, Array]:
    """Values of `FAULT_OUTPUTS`.

    Args:
        rules: that judge. m: named tuple with their `memory`.
    """
    return {
        "odometer_fault": rules.fault(m),
        "recovering": rules.recovering(m),
        "residual_limit": rules.limit(m, p),
    }


def stated_bounds(rules: Rules) -> dict[str, str]:
    """The parameter that bounds the noise of an input, by its name; the printed rules know nothing of noise.

    Args:
        rules: that judge.
    """
    return {"odometer": NOISE} if any(s.name == NOISE for s in rules.parameters) else {}


def noise_warnings(p: Any) -> list[str]:
    """What a user should read before a run where faults are judged by noise and not by the threshold, in words."""
    if not hasattr(p, NOISE) or doubt_limit(p) <= p.threshold:
        return []
    half, sure = float(doubt_limit(p) / p.residual_gain), float(certain_fault(p))
    return [
        f"readings are stated to be within {float(p.odometer_noise):.3g} m/s of the speed ({NOISE}), which makes a "
        f"residual of {float(doubt_limit(p)):.3g} m/s, beyond the threshold of {float(p.threshold):.3g} m/s. The rules "
        f"take the former, and find a fault that moves a reading by {half:.3g} m/s in one of two cases, by "
        f"{sure:.3g} m/s always; smaller ones are noise to them. A longer period or more teeth make less noise."
    ]


class JamDetector(HybridSystem):
    """Jams and skids of the wheel that the odometer counts, from an observer's residual: Aguiar Cota 2019, Algorithm
    3-3.

    The inputs are read every `odometer_period`: the `residual` ``M (y - vh)`` of an observer, the `odometer` y and the
    `estimated_speed` vh, and the `effort`, of which the sign alone counts (zero where it is not connected: jams and
    skids are then possible at all times). With the repaired rules (`RepairedRules`) a fault is reported at the sample
    that shows it, with the printed ones (`_PrintedRules`) at the next.

    The detector says that the odometer lies; it does not keep it from the observer. While it says so the repaired rules
    take it that the observer runs on its model alone, and that its speed is set to the odometer when the fault ends.
    `quasi_lpv_uio` has the rules built in and does both. Beside an observer that goes on following a lying odometer the
    residual fades, and the end of the fault is reported too early.

    Args:
        rules: ``repaired`` or ``printed``.

    Presets: `as_published` (default): eps = 0.9 and M = 2.3 of section 3.3.4; `as_published_5_3_1`: 0.65 and 3.36.
    """

    name = "jam_detector"
    description = "Jams and skids of the odometer's wheel from the residual of an observer"
    source = "Aguiar Cota 2019, Algorithm 3-3; the repaired rules ours"
    internal_step = 1e-2
    inputs = (
        input_signal("residual", "m/s", 0.0, "Residual of the observer, M (y - vh)"),
        input_signal("odometer", "m/s", 0.0, "Odometer speed"),
        input_signal("estimated_speed", "m/s", 0.0, "Train speed that the observer estimates"),
        input_signal("effort", "N", 0.0, "Effort at the wheel rim: traction positive, brake negative"),
    )
    outputs = (*FAULT_OUTPUTS, _SETTLED_TIME)
    events = (ODOMETER_SAMPLE,)
    presets = {
        "as_published": {"threshold": 0.9, "residual_gain": 2.3},
        "as_published_5_3_1": {"threshold": 0.65, "residual_gain": 3.36},
    }
    default_preset = "as_published"
    option_choices = {"rules": tuple(RULES)}

    def __init__(self, rules: RuleChoice = "repaired") -> None:
        require_chosen(self.name, self.option_choices, rules=rules)
        self.rules = RULES[rules]
        self.states = self.rules.memory
        self.parameters = (*SHARED_PARAMETERS, *self.rules.parameters)
        self.stated_bounds = stated_bounds(self.rules)
        super().__init__(rules=rules)

    def working_point(self, p: Any) -> list[str]:
        """Which faults are hidden by the noise of a reading, in words; nothing where the threshold is beyond it."""
        return noise_warnings(p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        reading = Reading(u.odometer, u.estimated_speed, u.residual, u.effort)
        return self.rules.at_sample(x, reading, p).memory

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {**verdict(self.rules, x, p), "settled_time": self.rules.settled_time(x, p)}

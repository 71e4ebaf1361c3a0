"""The jam detector as a block of its own: whether an odometer lies, from the residual of any observer. Uses the rules
and nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

from fmu_observer.detection.jam_rules import (
    SHARED_PARAMETERS,
    Reading,
    RepairedRules,
    Rules,
    certain_fault,
    doubt_limit,
)
from fmu_observer.detection.printed_jam_rules import PrintedRules
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, discrete_output, input_signal
from plant_models.hybrid.option import require_chosen

NOISE = "odometer_noise"
RuleChoice = Literal["repaired", "printed"]
RULES: Mapping[str, Rules] = {"repaired": RepairedRules(), "printed": PrintedRules()}
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
    """The parameter that bounds the noise of an input, by its name; the printed rules are told nothing of noise.

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
        f"readings are told to be within {float(p.odometer_noise):.3g} m/s of the speed ({NOISE}), which makes a "
        f"residual of {float(doubt_limit(p)):.3g} m/s, beyond the threshold of {float(p.threshold):.3g} m/s. The rules "
        f"take the former, and find a fault that moves a reading by {half:.3g} m/s in one of two cases, by "
        f"{sure:.3g} m/s always; smaller ones are noise to them. A longer period or more teeth make less noise."
    ]


class JamDetector(HybridSystem):
    """Jams and skids of the wheel that the odometer counts, from an observer's residual: Aguiar Cota 2019, Algorithm
    3-3.

    The inputs are read every `odometer_period`: the `residual` ``M (y - vh)`` of an observer, the `odometer` y and the
    `estimated_speed` vh, and the `effort`, of which the sign alone counts (zero where it is not connected: jams and
    skids are then possible at all times). With the repaired rules (`RepairedRules`) a fault is told at the sample that
    shows it, with the printed ones (`PrintedRules`) at the next.

    The detector says that the odometer lies; it does not keep it from the observer. While it says so the repaired rules
    take it that the observer runs on its model alone, and that its speed is set to the odometer when the fault ends.
    `quasi_lpv_uio` has the rules built in and does both. Beside an observer that goes on following a lying odometer the
    residual fades, and the end of the fault is told too early.

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
    presets: Mapping[str, Mapping[str, Any]] = {
        "as_published": {"threshold": 0.9, "residual_gain": 2.3},
        "as_published_5_3_1": {"threshold": 0.65, "residual_gain": 3.36},
    }
    default_preset = "as_published"
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {"rules": tuple(RULES)}

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

"""Event protocol: how a model with triggered events is notified of them, and what it does with one that comes too late.

The same words for the Python block and the exported FMU. Standard library only.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Literal

Announcement = Literal["clocks", "counts"]
LatePolicy = Literal["replay", "reject", "late"]
LATE_POLICIES: tuple[LatePolicy, ...] = ("replay", "reject", "late")
"""In the order of their numbers in an FMU, where they count from one."""

DEFAULT_REPLAY_HORIZON = 10.0

JOURNAL_CAPACITY = 4096
"""Records of the past remembered at most, in the block and in the exported FMU; an event before them is out of
reach.
"""


OUTCOME_TEXTS = {
    "accepted": "Events that took effect so far, on time or not",
    "replayed": "Of the accepted events, the late ones applied at their stamps",
    "late": "Of the accepted events, the late ones applied when they arrived",
    "rejected": "Late events without effect so far",
    "lost": "Events announced so far of which nothing else is known",
    "doubted": "Of the accepted events, those that the model doubted",
    "ignored": "Events that the model doubted and kept out",
}
"""What became of events, and what its count says; in the order of `Outcome` in an FMU."""

OUTCOME_VARIABLES = {f"events.{outcome}": outcome for outcome in OUTCOME_TEXTS}
"""Local variables that count outcomes. No signal of a model can be called so: its name has no dot."""


@dataclass(frozen=True)
class EventProtocol:
    """How events are announced, and what becomes of late ones.

    Args:
        announcement: by ``clocks`` (FMI 3 only: a triggered input clock, set in event mode) or by ``counts`` (an input
            ``<event>_count`` that is raised by one before the step; for masters that know no event mode); None for what
            is usual in the FMI version: clocks in FMI 3, counts in FMI 2.
        late_policy: what to do with an event stamped before the current time: ``replay``, ``reject`` or ``late``;
            None for what the model declares, usually ``replay``. In an FMU it is the start value of the parameter
            ``late_policy``.
        replay_horizon: how far back ``replay`` can go [s]; the start value of the parameter ``replay_horizon``.

    Raises:
        ValueError: an unknown announcement or policy, or a horizon that is not a finite time.
    """

    announcement: Announcement | None = None
    late_policy: LatePolicy | None = None
    replay_horizon: float = DEFAULT_REPLAY_HORIZON

    def __post_init__(self) -> None:
        if self.announcement not in (None, "clocks", "counts"):
            raise ValueError(f"announcement {self.announcement!r} is unknown; use 'clocks' or 'counts'.")
        if self.late_policy not in (None, *LATE_POLICIES):
            raise ValueError(f"late_policy {self.late_policy!r} is unknown; use one of {', '.join(LATE_POLICIES)}.")
        if not (isfinite(self.replay_horizon) and self.replay_horizon >= 0.0):
            raise ValueError(f"replay_horizon = {self.replay_horizon!r} s; expected zero or more seconds.")

    def policy_number(self, declared: LatePolicy) -> int:
        """Number of the late policy in an FMU, from one.

        Args:
            declared: by the model, for where none is asked for.
        """
        return LATE_POLICIES.index(self.late_policy or declared) + 1

    def counts(self, fmi_version: int) -> bool:
        """Whether events are announced by counts in this FMI version.

        Args:
            fmi_version: 2 or 3.

        Raises:
            ValueError: clocks are asked for in FMI 2, which has none.
        """
        if self.announcement is None:
            return fmi_version == 2
        if self.announcement == "clocks" and fmi_version == 2:
            raise ValueError("FMI 2 has no clocks; events are announced by counts there.")
        return self.announcement == "counts"

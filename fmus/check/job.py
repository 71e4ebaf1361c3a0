"""A job for the child process: which checks of which unpacked FMU, as plain data. Standard library only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field


@dataclass(frozen=True)
class CheckJob:
    """What a child process is asked to do.

    Args:
        folder: where the FMU was unpacked.
        interface: ``coSimulation`` or ``modelExchange``.
        checks: names of the checks, in order.
        step: communication step [s]. start_time: [s]. starts: start values by name.
        budget: time that one check may take [s]. steps: of the longest run.
        places: of checks that the program has registered, ``file.py:Class`` by name.
        ends: whether instances are terminated and freed. digest: of the content of the FMU's file.
    """

    folder: str
    interface: str
    checks: tuple[str, ...]
    step: float
    start_time: float
    budget: float
    steps: int
    starts: Mapping[str, float] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)
    ends: bool = True
    digest: str = ""

    def to_json(self) -> str:
        """As one line of text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> CheckJob:
        """The job that `to_json` wrote.

        Args:
            text: from `to_json`.
        """
        data = json.loads(text)
        return cls(**data | {"checks": tuple(data["checks"])})

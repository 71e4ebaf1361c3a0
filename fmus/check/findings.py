"""Findings: what one check saw, with a verdict. Standard library only; findings travel between processes as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """How a check ended."""

    PASS = "pass"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class Outcome:
    """What a check function returns.

    Args:
        verdict: how it ended.
        detail: what was seen, or why it was skipped.
    """

    verdict: Verdict
    detail: str = ""


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Args:
        check: name of the check.
        verdict: how it ended.
        detail: what was seen, or why it was skipped.
    """

    check: str
    verdict: Verdict
    detail: str = ""

    def to_dict(self) -> dict[str, str]:
        """For JSON."""
        return {name: str(value) for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Finding:
        """The finding that `to_dict` described."""
        return cls(str(data["check"]), Verdict(data["verdict"]), str(data["detail"]))


def passed(detail: str = "") -> Outcome:
    """All is as it should be."""
    return Outcome(Verdict.PASS, detail)


def warned(detail: str) -> Outcome:
    """Legal or harmless, but a master should know."""
    return Outcome(Verdict.WARN, detail)


def failed(detail: str) -> Outcome:
    """The FMU breaks the standard or its own word."""
    return Outcome(Verdict.FAIL, detail)


def skipped(reason: str) -> Outcome:
    """Not checked, and why."""
    return Outcome(Verdict.SKIPPED, reason)

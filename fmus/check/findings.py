"""Findings: what one check saw, and what it means for a co-simulation run. Standard library only; they travel as plain
data.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """What the outcome of a check means for a co-simulation run, from nothing to everything."""

    SKIPPED = "skipped"
    PASS = "pass"
    NOTE = "note"
    ERROR = "error"
    LIMIT = "limit"
    DISTRUST = "distrust"

    @property
    def rank(self) -> int:
        """The higher, the worse."""
        return list(Verdict).index(self)


class Class(StrEnum):
    """What is to be done with an FMU as a whole."""

    USE = "use as it is"
    LIMITS = "use with these limits"
    DISTRUST = "do not trust"


@dataclass(frozen=True)
class CheckOutcome:
    """What a check function returns.

    Args:
        verdict: what it means; None where it failed, and the catalogue says what that means.
        detail: what was seen, or why it was skipped.
        advice: what to do about it, where the catalogue does not know.
    """

    verdict: Verdict | None
    detail: str = ""
    advice: str = ""


@dataclass(frozen=True)
class CheckFinding:
    """One line of the report.

    Args:
        check: name of the check.
        verdict: what it means.
        detail: what was seen, or why it was skipped.
        advice: what to do about it, where it is a limit.
    """

    check: str
    verdict: Verdict
    detail: str = ""
    advice: str = ""

    def to_dict(self) -> dict[str, str]:
        """For JSON."""
        return {name: str(value) for name, value in asdict(self).items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> CheckFinding:
        """The finding that `to_dict` described.

        Args:
            data: from `to_dict`.
        """
        return cls(str(data["check"]), Verdict(data["verdict"]), str(data["detail"]), str(data["advice"]))


def class_of(findings: Iterable[CheckFinding]) -> Class:
    """The class of an FMU: that of its worst finding. What an error of the check left unseen is a limit.

    Args:
        findings: of all checks that ran.
    """
    worst = max((finding.verdict for finding in findings), key=lambda verdict: verdict.rank, default=Verdict.PASS)
    if worst in (Verdict.LIMIT, Verdict.ERROR):
        return Class.LIMITS
    return Class.DISTRUST if worst is Verdict.DISTRUST else Class.USE


def passed(detail: str = "") -> CheckOutcome:
    """All is as it should be.

    Args:
        detail: what was seen, in words.
    """
    return CheckOutcome(Verdict.PASS, detail)


def noted(detail: str) -> CheckOutcome:
    """For information: it changes nothing in a run of this package's master.

    Args:
        detail: what was seen, in words.
    """
    return CheckOutcome(Verdict.NOTE, detail)


def limited(detail: str, advice: str = "") -> CheckOutcome:
    """A run is right as long as the advice, or that of the catalogue, is followed.

    Args:
        detail: what was seen, in words.
    """
    return CheckOutcome(Verdict.LIMIT, detail, advice)


def failed(detail: str) -> CheckOutcome:
    """The FMU breaks the standard or its own word; what that means stands in the catalogue.

    Args:
        detail: what was seen, in words.
    """
    return CheckOutcome(None, detail)


def skipped(reason: str) -> CheckOutcome:
    """Not checked, and why.

    Args:
        reason: why, in words.
    """
    return CheckOutcome(Verdict.SKIPPED, reason)

"""Trust: what a master can rely on, in sentences, from the findings. Knows the names of the checks and nothing of
FMUs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fmus.check.findings import CheckFinding, Verdict

ENDS = ("crashed", "no answer", "ended", "started more", "took more")
"""How a finding begins where the process came to an end."""


def what_to_trust(findings: Iterable[CheckFinding]) -> list[str]:
    """Sentences for people who will step this FMU.

    Args:
        findings: all findings of a run.
    """
    by_name = {finding.check: finding for finding in findings}
    if "stepping" not in by_name:
        return ["Nothing: it was not run."]
    if by_name["stepping"].verdict in (Verdict.DISTRUST, Verdict.ERROR, Verdict.SKIPPED):
        return ["Nothing: it could not be stepped."]
    sentences = [
        _variable_step(by_name),
        _rollback(by_name),
        _reset(by_name),
        _instances(by_name),
        _events(by_name),
        _process(by_name),
    ]
    return [sentence for sentence in sentences if sentence]


def _good(findings: Mapping[str, CheckFinding], *names: str) -> bool:
    return all(name in findings and findings[name].verdict is Verdict.PASS for name in names)


def _failed(findings: Mapping[str, CheckFinding], *names: str) -> bool:
    return any(name in findings and findings[name].verdict.rank >= Verdict.LIMIT.rank for name in names)


def _why_not(findings: Mapping[str, CheckFinding], name: str) -> str:
    return "not declared" if "declare" in findings[name].detail else findings[name].detail


def _variable_step(findings: Mapping[str, CheckFinding]) -> str:
    if _good(findings, "divided steps", "short step"):
        return "Variable step: yes. A master may shorten a step to hit an instant."
    lies = _failed(findings, "divided steps", "short step")
    reason = "it declares them and does something else" if lies else _why_not(findings, "divided steps")
    return f"Variable step: no ({reason}). Keep to one communication step; an event inside it can only be interpolated."


def _rollback(findings: Mapping[str, CheckFinding]) -> str:
    if _good(findings, "state round trip"):
        return "Rollback: yes. A restored state gives the identical continuation, so steps may be redone."
    if "within the tolerance" in findings["state round trip"].detail:
        return (
            "Rollback: to within the tolerance of its solver. Steps may be redone, and what is redone differs by as "
            "much."
        )
    reason = (
        "states are not restored" if _failed(findings, "state round trip") else _why_not(findings, "state round trip")
    )
    return f"Rollback: no ({reason}). Do not redo steps."


def _reset(findings: Mapping[str, CheckFinding]) -> str:
    if _good(findings, "reset and re-run"):
        return "Reset: yes. A run after a reset is identical."
    return "Reset: no. Make a new instance for each run."


def _instances(findings: Mapping[str, CheckFinding]) -> str:
    if _good(findings, "two instances"):
        return "Several instances in one process: yes."
    return "Several instances in one process: no. Give each a process of its own."


def _events(findings: Mapping[str, CheckFinding]) -> str:
    if _good(findings, "events"):
        return f"Events: yes; {findings['events'].detail}."
    if "events" in findings and findings["events"].verdict is not Verdict.SKIPPED:
        return f"Events: no; {findings['events'].detail}."
    return "Events: none are declared; what happens inside a step reaches it through ordinary inputs at the next one."


def _process(findings: Mapping[str, CheckFinding]) -> str:
    lost = [f.check for f in findings.values() if f.detail.startswith(ENDS)]
    return f"Run it in a process of its own: it died or hung in {', '.join(lost)}." if lost else ""

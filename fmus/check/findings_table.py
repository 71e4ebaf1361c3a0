"""Report: the findings as a table of text and as plain data for JSON."""

from __future__ import annotations

from typing import Any

from fmus.check.findings import Verdict
from fmus.check.run import CheckReport
from fmus.fmi.standard import INTERFACES
from fmus.tables.table import Parts, Table, name_column, text_column

_BULLET = "  - "


_COLUMNS = (name_column("check"), name_column("verdict"), text_column("detail"))


def check_parts(report: CheckReport) -> Parts:
    """The report for people: what was checked, one row a finding, the verdict with its limits, what to trust."""
    rows = [[finding.check, str(finding.verdict), finding.detail] for finding in report.findings]
    verdict = [f"Verdict: {report.verdict} ({_counts(report)}, {report.seconds:.1f} s)"]
    verdict += [f"{_BULLET}{advice} ({', '.join(checks)})" for advice, checks in _reasons(report).items()]
    trust = ["What to trust:", *(f"{_BULLET}{sentence}" for sentence in report.trust)]
    return [_heading(report), Table("findings", _COLUMNS, rows), "\n".join(verdict), "\n".join(trust)]


def as_data(report: CheckReport) -> dict[str, Any]:
    """The report as plain data, ready for JSON."""
    return {
        "file": str(report.archive.path),
        "model": report.archive.description.modelName,
        "fmiVersion": report.archive.description.fmiVersion,
        "generationTool": report.archive.description.generationTool,
        "interfaces": report.archive.interfaces,
        "platforms": list(report.archive.platforms),
        "communicationStepSize": report.step,
        "starts": dict(report.starts),
        "steps": report.steps,
        "verdict": str(report.verdict),
        "limits": [{"check": finding.check, "advice": finding.advice} for finding in report.limits],
        "findings": [finding.to_dict() for finding in report.findings],
        "trust": list(report.trust),
        "seconds": round(report.seconds, 3),
    }


def _heading(report: CheckReport) -> str:
    description = report.archive.description
    interfaces = ", ".join(INTERFACES[name] for name in report.archive.interfaces)
    return f"{description.modelName}: FMI {description.fmiVersion}, {interfaces}; communication step {report.step:g} s"


def _reasons(report: CheckReport) -> dict[str, list[str]]:
    """The checks behind the verdict, by the advice that comes of them."""
    reasons: dict[str, list[str]] = {}
    for finding in report.findings:
        if finding.advice:
            reasons.setdefault(finding.advice, []).append(finding.check)
    return reasons


def _counts(report: CheckReport) -> str:
    numbers = {verdict: sum(f.verdict is verdict for f in report.findings) for verdict in Verdict}
    return ", ".join(f"{number} {verdict}" for verdict, number in numbers.items() if number)

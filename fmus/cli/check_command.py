"""Command line: ``fmus check FILE.fmu``.

Exit codes: 0 use it as it is, or with the limits that are reported; 1 do not trust it, with ``--strict`` also where
there are limits; 2 the file cannot be checked, the check itself failed, or a mistake of the user.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Any

from fmus.check.findings import Class, Verdict
from fmus.check.run import CheckReport, check_count, check_fmu
from fmus.cli.colour import Role
from fmus.cli.commands import argument, one_of, repeated
from fmus.cli.output import Output
from fmus.cli.parsers import no_number
from fmus.cli.progress import ProgressBar
from fmus.fmi.archive import open_archive
from fmus.fmi.standard import INTERFACES
from fmus.tables.table import Parts, Table, name_column, text_column

CLEAN, PROBLEMS, _UNCHECKED = 0, 1, 2
_TRUTH = {"true": 1.0, "false": 0.0}

_BULLET = "  - "


_COLUMNS = (name_column("check"), name_column("verdict"), text_column("detail"))

GROUP = "FMUs"
PLACE = 2
HELP = "how far an FMU can be trusted: validity and behaviour"
LOOKS = False
EXAMPLES = ("fmus check vendor.fmu",)
PARSER = {
    "epilog": (
        "Exit codes: 0 use it as it is, or with the limits that are reported, 1 do not trust it, with --strict also "
        "where there are limits, 2 it cannot be checked."
    )
}
ARGUMENTS = (
    argument("file", type=Path, metavar="FILE", help="an FMU, FMI 2.0 or 3.0"),
    argument("--step", type=float, metavar="H", help="communication step in s (default: the FMU's own)"),
    repeated("--start", "K=V", "start value"),
    argument("--timeout", type=float, default=30.0, metavar="S", help="time limit of each check in s (default 30)"),
    one_of(
        argument("--steps", type=int, metavar="N", help="steps of the longest run (default 50, within its experiment)"),
        argument("--until", type=float, metavar="T", help="end of the longest run in s, in place of --steps"),
    ),
    argument("--strict", action="store_true", help="limits end with exit code 1 too"),
    argument("-o", "--output", type=Path, metavar="FILE", help="also write the report as JSON to a file"),
)


def execute(options: argparse.Namespace) -> Output:
    """Check a file, as the options ask.

    Raises:
        ValueError, OSError: the file cannot be checked, or a mistake of the user; the program ends with 2 then.
    """
    report = _checked(options)
    data, failure = _data(report), None
    try:
        if options.output is not None:
            options.output.write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    except OSError as error:  # the report is shown all the same
        failure = OSError(f"{options.output} cannot be written: {error.strerror or error}.")
    code = _exit_code(report, options.strict)
    verdict = f"Verdict: {report.verdict} ({_counts(report)}, {report.seconds:.1f} s)"
    role: Role = "good" if report.clean else "doubtful" if code == CLEAN else "bad"
    return Output(_parts(report), data, code=code, error=failure, verdict=verdict, role=role)


def _exit_code(report: CheckReport, strict: bool) -> int:
    if report.verdict is Class.DISTRUST:
        return PROBLEMS
    if any(finding.verdict is Verdict.ERROR for finding in report.findings):
        return _UNCHECKED
    return PROBLEMS if strict and not report.clean else CLEAN


def _checked(options: argparse.Namespace) -> CheckReport:
    starts = _starts(options.start)
    checks, number = check_count(open_archive(options.file)), count(1)
    with ProgressBar("check") as bar:
        return check_fmu(
            options.file,
            step=options.step,
            starts=starts,
            timeout=options.timeout,
            steps=options.steps,
            until=options.until,
            progress=lambda name: bar(next(number), checks, name),
        )


def _starts(words: Sequence[str]) -> dict[str, float]:
    starts = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not name:
            raise ValueError(f"--start {word!r}: write it as name=number, e.g. --start mass=80e3.")
        try:
            starts[name] = _TRUTH[value.lower()] if value.lower() in _TRUTH else float(value)
        except ValueError:
            raise ValueError(f"--start {name}: {no_number(value)}.") from None
    return starts


def _parts(report: CheckReport) -> Parts:
    """The report for people: what was checked, one row a finding, its limits, what to trust."""
    rows = [[finding.check, str(finding.verdict), finding.detail] for finding in report.findings]
    limits = [f"{_BULLET}{advice} ({', '.join(checks)})" for advice, checks in _reasons(report).items()]
    trust = ["What to trust:", *(f"{_BULLET}{sentence}" for sentence in report.trust)]
    return [
        _heading(report),
        Table("findings", _COLUMNS, rows),
        "\n".join(["What limits it:", *limits]) if limits else "",
        "\n".join(trust),
    ]


def _data(report: CheckReport) -> dict[str, Any]:
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

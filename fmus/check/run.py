"""A whole check run: look at the archive, validate, run the FMU in child processes, say what to trust."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from time import perf_counter

from fmpy.model_description import ModelDescription

from fmus.check.archive import Archive, open_archive
from fmus.check.catalogue import CATALOGUE
from fmus.check.checks.static import platforms, validation
from fmus.check.findings import Finding, Verdict
from fmus.check.instance import NUMERIC_TYPES
from fmus.check.isolated import run_isolated
from fmus.check.job import Job
from fmus.check.library import SCHEDULED_EXECUTION
from fmus.check.trust import what_to_trust

TIMEOUT = 30.0
DEFAULT_STEP = 0.01
STEPS_TO_STOP = 1000
UNSETTABLE = frozenset({"output", "independent", "calculatedParameter"})
STATIC = {"validation": validation, "platforms": platforms}


@dataclass(frozen=True)
class CheckReport:
    """What a check run found.

    Args:
        archive: the file. step: communication step [s]. starts: start values by name.
        findings: one for each check. trust: what a master can rely on, in sentences. seconds: time it took [s].
    """

    archive: Archive
    step: float
    starts: Mapping[str, float]
    findings: tuple[Finding, ...]
    trust: tuple[str, ...]
    seconds: float

    @property
    def clean(self) -> bool:
        """Whether every check passed or was skipped."""
        return all(finding.verdict in (Verdict.PASS, Verdict.SKIPPED) for finding in self.findings)

    def finding(self, check: str) -> Finding:
        """The finding of a check by its name.

        Raises:
            KeyError: there is none.
        """
        for finding in self.findings:
            if finding.check == check:
                return finding
        raise KeyError(check)


def check_fmu(
    path: Path | str, *, step: float | None = None, starts: Mapping[str, float] | None = None, timeout: float = TIMEOUT,
    progress: Callable[[str], None] = lambda _: None,
) -> CheckReport:  # fmt: skip
    """Check what an FMU really does. Its code runs in child processes; a crash there is a finding.

    Args:
        path: the FMU file.
        step: communication step [s]; by default that of the default experiment, a thousandth of its length, or 0.01 s.
        starts: start values of scalar numeric variables by name.
        timeout: time limit of each check [s].
        progress: is called with the name of each check that begins.

    Raises:
        NotAnFmuError: the file is no FMU, is dangerous, or has no library for this platform.
        ValueError: step, timeout or a start value cannot be.
    """
    begin = perf_counter()
    archive = open_archive(Path(path))
    archive.demand_this_platform()
    description = archive.description
    size = default_step(description) if step is None else step
    if not 0.0 < size < float("inf") or not 0.0 < timeout < float("inf"):
        raise ValueError(f"The communication step ({size:g} s) and the time limit ({timeout:g} s) must be positive and finite.")
    chosen = dict(starts or {})
    _demand_settable(description, chosen)
    start_time = float(getattr(description.defaultExperiment, "startTime", None) or 0.0)
    findings = []
    for name, static in STATIC.items():
        progress(name)
        outcome = static(archive)
        findings.append(Finding(name, outcome.verdict, outcome.detail))
    with archive.unpacked() as folder:
        for interface in archive.interfaces:
            if interface == SCHEDULED_EXECUTION:
                findings.append(Finding("scheduled execution", Verdict.SKIPPED, "looked at, never run"))
                continue
            names = tuple(check.name for check in CATALOGUE[interface])
            findings += run_isolated(Job(str(folder), interface, names, size, start_time, timeout, chosen), progress)
    found = _merged(findings)
    return CheckReport(archive, size, chosen, found, tuple(what_to_trust(found)), perf_counter() - begin)


def check_count(archive: Archive) -> int:
    """How many checks `check_fmu` will begin at most, for a progress bar."""
    return len(STATIC) + sum(len(CATALOGUE.get(interface, ())) for interface in archive.interfaces)


def default_step(description: ModelDescription) -> float:
    """The communication step to check with [s]."""
    experiment = description.defaultExperiment
    if experiment is None:
        return DEFAULT_STEP
    if experiment.stepSize:
        return float(experiment.stepSize)
    length = float(experiment.stopTime or 0.0) - float(experiment.startTime or 0.0)
    return length / STEPS_TO_STOP if length > 0.0 else DEFAULT_STEP


def _demand_settable(description: ModelDescription, starts: Mapping[str, float]) -> None:
    variables = {v.name: v for v in description.modelVariables}
    for name in starts:
        found = variables.get(name)
        if found is None:
            near = get_close_matches(name, list(variables), 3, 0.5)
            hint = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
            raise ValueError(f"There is no variable {name!r} to set{hint}")
        if found.causality in UNSETTABLE or found.variability == "constant":
            raise ValueError(f"{name} cannot be set: it is '{found.causality}' and '{found.variability}'.")
        if found.type not in NUMERIC_TYPES or found.shape:
            raise ValueError(f"{name} cannot be set: it is a {found.type}{list(found.shape or ())}; only scalar numbers can.")


def _merged(findings: list[Finding]) -> tuple[Finding, ...]:
    """One finding for each name: where two interfaces report the same, the worse one stands, at the end."""
    rank = {Verdict.SKIPPED: 0, Verdict.PASS: 1, Verdict.WARN: 2, Verdict.FAIL: 3}
    worst: dict[str, Finding] = {}
    for finding in findings:
        held = worst.pop(finding.check, None)
        worst[finding.check] = held if held is not None and rank[held.verdict] > rank[finding.verdict] else finding
    return tuple(worst.values())

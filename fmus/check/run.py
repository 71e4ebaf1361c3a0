"""A whole check run: examine the archive, validate, run the FMU in child processes, say what to trust."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from time import perf_counter

from fmpy.model_description import ModelDescription

from fmus.check.check import Check
from fmus.check.checked_instance import LOADING
from fmus.check.checks.archive_checks import platforms, validation
from fmus.check.conclusions import what_to_trust
from fmus.check.findings import CheckFinding, Class, Verdict, class_of
from fmus.check.isolated import run_isolated
from fmus.check.job import CheckJob
from fmus.check.known_checks import CHECKS
from fmus.check.runner import end_of_experiment
from fmus.fmi.archive import Archive, NotAnFmuError, open_archive
from fmus.fmi.instance import INSTANTIATING
from fmus.fmi.standard import CO_SIMULATION, MODEL_EXCHANGE, SCHEDULED_EXECUTION
from fmus.fmi.types import NUMERIC_TYPES, why_not_set
from plant_models.disk_cache.files import file_digest
from plant_models.registry import log_left_out
from plant_models.user_file import UserFileError, name_of

_TIMEOUT = 30.0
_DEFAULT_STEP = 0.01
_STEPS_TO_STOP = 1000
STEPS = 50
"""Of the longest run, where nothing else is asked for."""

WHOLE = 1e-6
"""Share of a step by which an end may miss a whole number of steps."""

_UNRUNNABLE = (f"{LOADING} failed", f"{INSTANTIATING} failed")
_NO_SLAVE = "there is neither co-simulation nor model exchange: nothing here can step it"
_SOLVED = "there is no co-simulation: what was stepped is its model exchange, by the solver that runs use (CVODE)"
_OF_LIBRARY = ("loading", "exported symbols")
"""Checks of what model exchange has of its own."""
_STATIC = {"validation": validation, "platforms": platforms}


@dataclass(frozen=True)
class CheckReport:
    """What a check run found.

    Args:
        archive: the file. step: communication step [s]. starts: start values by name.
        findings: one for each check. trust: what a master can rely on, in sentences. seconds: time it took [s].
        steps: of the longest run.
    """

    archive: Archive
    step: float
    starts: Mapping[str, float]
    findings: tuple[CheckFinding, ...]
    trust: tuple[str, ...]
    seconds: float
    steps: int = 0

    @property
    def verdict(self) -> Class:
        """What is to be done with it."""
        return class_of(self.findings)

    @property
    def clean(self) -> bool:
        """Whether it can be used as it is."""
        return self.verdict is Class.USE

    @property
    def limits(self) -> tuple[CheckFinding, ...]:
        """What it must be used with, and what was not seen for an error of the check."""
        return tuple(f for f in self.findings if f.verdict in (Verdict.LIMIT, Verdict.ERROR))

    def finding(self, check: str) -> CheckFinding:
        """The finding of a check by its name.

        Raises:
            KeyError: there is none.
        """
        for finding in self.findings:
            if finding.check == check:
                return finding
        raise KeyError(check)


def check_fmu(
    path: Path | str,
    *,
    step: float | None = None,
    starts: Mapping[str, float] | None = None,
    timeout: float = _TIMEOUT,
    steps: int | None = None,
    until: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> CheckReport:
    """Check what an FMU really does. Its code runs in child processes; a crash there is a finding.

    Args:
        path: the FMU file.
        step: communication step [s]; by default that of the default experiment, a thousandth of its length, or 0.01 s.
        starts: start values of scalar numeric variables by name.
        timeout: time limit of each check [s].
        steps: of the longest run; 50 by default, or what fits into the default experiment.
        until: end of the longest run [s], in place of `steps`.
        progress: is called with the name of each check that begins.

    Raises:
        NotAnFmuError: the file is no FMU, is dangerous, or has no library that can be loaded here.
        ValueError: step, steps, until, timeout or a start value cannot be, or a check that this program has registered
            cannot be found by the child processes.
    """
    begin = perf_counter()
    archive = open_archive(Path(path))
    archive.demand_this_platform()
    size = _default_step(archive.description) if step is None else step
    job = _job(archive.description, size, dict(starts or {}), timeout, steps, until)
    found = _merged([*_static_findings(archive, progress), *_run_findings(archive, job, progress)])
    seconds = perf_counter() - begin
    return CheckReport(archive, size, job.starts, found, tuple(what_to_trust(found)), seconds, job.steps)


def _job(
    description: ModelDescription,
    step: float,
    starts: dict[str, float],
    timeout: float,
    steps: int | None,
    until: float | None,
) -> CheckJob:
    """What is the same for all interfaces, of arguments that `check_fmu` was given."""
    if not 0.0 < step < math.inf or not 0.0 < timeout < math.inf:
        raise ValueError(
            f"The communication step ({step:g} s) and the time limit ({timeout:g} s) must be positive and finite."
        )
    _demand_settable(description, starts)
    count = _steps(description, step, steps, until)
    return CheckJob("", "", (), step, _start_time(description), timeout, count, starts)


def _static_findings(archive: Archive, progress: Callable[[str], None]) -> Iterator[CheckFinding]:
    """Of checks that run nothing of the FMU."""
    for name, static in _STATIC.items():
        progress(name)
        outcome = static(archive)
        yield CheckFinding(name, outcome.verdict or Verdict.NOTE, outcome.detail)


def _run_findings(archive: Archive, job: CheckJob, progress: Callable[[str], None]) -> list[CheckFinding]:
    """Of checks that run the FMU, interface by interface.

    Args:
        archive: the file. job: what is the same for all interfaces. progress: see `check_fmu`.
    """
    findings: list[CheckFinding] = []
    left_out: dict[str, str] = {}
    job = replace(job, digest=file_digest(archive.path))
    with archive.unpacked() as folder:
        for interface in _looked_at(archive):
            if interface == SCHEDULED_EXECUTION:
                findings.append(CheckFinding("scheduled execution", Verdict.SKIPPED, "looked at, never run"))
                continue
            names = tuple(_checks_of(interface, left_out.__setitem__))
            if interface not in archive.interfaces:
                names = tuple(name for name in names if name not in _OF_LIBRARY)
            places = _registered_places(names)
            one = replace(job, folder=str(folder), interface=interface, checks=names, places=places)
            findings += _meant(archive, interface, run_isolated(one, progress))
    _demand_runnable(archive, findings)
    findings += [CheckFinding(name, Verdict.NOTE, f"left out: {reason}") for name, reason in left_out.items()]
    if CO_SIMULATION not in _looked_at(archive):
        findings.append(CheckFinding("interface", Verdict.LIMIT, _NO_SLAVE, "use a master that schedules its parts"))
    elif CO_SIMULATION not in archive.interfaces:
        findings.append(CheckFinding("interface", Verdict.NOTE, _SOLVED))
    return findings


def _looked_at(archive: Archive) -> list[str]:
    """Interface types whose checks are made: model exchange alone is stepped by the solver of runs as well."""
    return [*archive.interfaces, *([CO_SIMULATION] if set(archive.interfaces) == {MODEL_EXCHANGE} else [])]


def check_count(archive: Archive) -> int:
    """How many checks `check_fmu` will begin at most, for a progress bar.

    Args:
        archive: the FMU file.
    """
    return len(_STATIC) + sum(len(_checks_of(interface)) for interface in _looked_at(archive))


def _default_step(description: ModelDescription) -> float:
    """The communication step to check with [s]."""
    experiment = description.defaultExperiment
    if experiment is None:
        return _DEFAULT_STEP
    if experiment.stepSize:
        return float(experiment.stepSize)
    length = float(experiment.stopTime or 0.0) - float(experiment.startTime or 0.0)
    return length / _STEPS_TO_STOP if length > 0.0 else _DEFAULT_STEP


def _start_time(description: ModelDescription) -> float:
    return float(getattr(description.defaultExperiment, "startTime", None) or 0.0)


def _steps(description: ModelDescription, step: float, steps: int | None, until: float | None) -> int:
    """Steps of the longest run: as asked, or the usual ones as far as they fit into the default experiment."""
    start = _start_time(description)
    if steps is not None and until is not None:
        raise ValueError("Say how far to look by a number of steps or by an end, not by both.")
    if steps is None and until is None:
        return max(1, min(STEPS, math.floor((end_of_experiment(description, start) - start) / step + WHOLE)))
    if until is not None and not start < until < math.inf:
        raise ValueError(
            f"The end of the longest run ({until:g} s) must lie after the start ({start:g} s) and be finite."
        )
    count = steps if until is None else math.ceil((until - start) / step - WHOLE)
    if count is None or count < 1:
        raise ValueError(f"The longest run must have a step at least, not {count}.")
    return count


def _meant(archive: Archive, interface: str, findings: list[CheckFinding]) -> list[CheckFinding]:
    """Findings by what they mean for co-simulation: beside it those of model exchange are notes."""
    if interface == CO_SIMULATION or CO_SIMULATION not in archive.interfaces:
        return findings
    own = _checks_of(interface)
    meant = {Verdict.LIMIT, Verdict.DISTRUST}
    return [
        replace(f, verdict=Verdict.NOTE, advice="") if f.check in own and f.verdict in meant else f for f in findings
    ]


def _demand_runnable(archive: Archive, findings: list[CheckFinding]) -> None:
    """Refuse an FMU that cannot be loaded or makes no instance on this machine: nothing can be said of it, good or bad.

    Raises:
        NotAnFmuError: it is so for co-simulation, or for model exchange where there is nothing else; the message says
        why.
    """
    prefix = "" if CO_SIMULATION in archive.interfaces else "model exchange: "
    for finding in findings:
        if finding.check in (f"{prefix}loading", f"{prefix}initialise") and finding.detail.startswith(_UNRUNNABLE):
            where = f"{archive.path} cannot be run on this machine (is a library or a licence missing?)"
            raise NotAnFmuError(f"{where}: {finding.detail}")


def _demand_settable(description: ModelDescription, starts: Mapping[str, float]) -> None:
    variables = {v.name: v for v in description.modelVariables}
    for name in starts:
        found = variables.get(name)
        if found is None:
            near = get_close_matches(name, list(variables), 3, 0.5)
            hint = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
            raise ValueError(f"There is no variable {name!r} to set{hint}")
        if objection := why_not_set(found):
            raise ValueError(f"{name} cannot be set: it {objection}.")
        if found.type not in NUMERIC_TYPES or found.shape:
            raise ValueError(
                f"{name} cannot be set: it is a {found.type}{list(found.shape or ())}; only scalar numbers can."
            )


def _merged(findings: list[CheckFinding]) -> tuple[CheckFinding, ...]:
    """One finding for each name: where two interfaces report the same, the worse one stands, at the end."""
    worst: dict[str, CheckFinding] = {}
    for finding in findings:
        held = worst.pop(finding.check, None)
        worst[finding.check] = held if held is not None and held.verdict.rank > finding.verdict.rank else finding
    return tuple(worst.values())


def _checks_of(interface: str, left_out: Callable[[str, str], None] = log_left_out) -> dict[str, type[Check]]:
    """The checks of an interface type by name, in order."""
    found = {name: check for name, check in CHECKS.usable(left_out).items() if check.interface == interface}
    return dict(sorted(found.items(), key=lambda item: item[1].place))


def _registered_places(names: Iterable[str]) -> dict[str, str]:
    """Where a process of their own finds the checks that this program has registered: ``file.py:Class`` by name.

    Args:
        names: of checks.

    Raises:
        ValueError: one stands where no other process finds it.
    """
    places = {}
    for name in names:
        check = CHECKS.own(name)
        if check is None:
            continue
        if check.__module__ == "__main__":
            raise UserFileError(f"the check {name!r} stands in the program itself; put it into a file and import that.")
        places[name] = name_of(check)
    return places

"""The probe: what an FMU really does with steps of any length, saved states and resets, whatever it says about itself.

It works on instances of its own, made and thrown away here, with inputs that make something happen. The master chooses
its localisation method by it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from fmus.check.behaviour import ends_of_divided_steps, honest_step, repeatable
from fmus.check.restoring import ROUNDING, Restores, Restoring, largest, restoring, solver_tolerance
from fmus.check.runner import Runner
from fmus.fmi.instance import FAILURES
from fmus.fmi.slave import Slave


@dataclass(frozen=True)
class ProbeReport:
    """What was declared and what was seen.

    Args:
        component: name.
        declares_variable_step, declares_state: capability flags.
        honest_step: steps of any length did what they say.
        restores: what the same steps gave after save, steps elsewhere and restore: ``exact`` the identical outputs;
            ``within_tolerance`` of the FMU's solver; ``no``, or its state cannot be saved.
        restore_mismatch: largest relative difference after restoring; None where it is not known.
        repeatable: after a reset the same steps gave the identical outputs.
        excited: some input made the outputs move, so that the findings mean something.
        remarks: what failed, in words.
        spread: by output, in its own unit: how far results lay apart that differ by the solver's steps alone, after
            restoring and between a step and its parts. Empty where that was not measured.
        drift: by output, in its own unit for each second: how fast it leaves what a finer tolerance gives. Empty
            likewise.
    """

    component: str
    declares_variable_step: bool
    declares_state: bool
    honest_step: bool
    restores: Restores
    restore_mismatch: float | None
    repeatable: bool
    excited: bool
    remarks: tuple[str, ...] = ()
    spread: Mapping[str, float] = field(default_factory=dict)
    drift: Mapping[str, float] = field(default_factory=dict)

    @property
    def exact_state(self) -> bool:
        """Whether what follows a restored state is identical, bit for bit."""
        return self.restores == "exact"

    def to_dict(self) -> dict[str, Any]:
        """For the summary."""
        numbers = {key: {n: x for n, x in getattr(self, key).items() if x > 0.0} for key in ("spread", "drift")}
        return asdict(self) | {"remarks": list(self.remarks)} | numbers


def probe(make: Callable[[], Slave], starts: Mapping[str, Any], start_time: float, h: float) -> ProbeReport:
    """Probe a component.

    Args:
        make: makes a fresh, not yet instantiated component; it is freed here.
        starts: start values as in the run.
        start_time: [s]. h: communication step of the run [s].

    Returns:
        What was seen; an FMU that fails under the probe is reported, not raised.
    """
    component = make()
    declares: dict[str, Any] = {"declares_variable_step": component.can_vary_step, "declares_state": component.can_save}
    nothing_seen: dict[str, Any] = {
        "honest_step": False,
        "restores": "no",
        "restore_mismatch": None,
        "repeatable": False,
        "excited": False,
    }
    if component.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        component.free()
        remark = "not probed: the FMU allows one instance per process only"
        return ProbeReport(component.name, **declares, **nothing_seen, remarks=(remark,))
    runner = Runner(make, starts, start_time, h, component)
    remarks: list[str] = []
    try:
        seen = _seen(runner, declares, remarks)
    except FAILURES as error:
        seen = nothing_seen
        remarks.append(f"the probe came to an end: {error}")
    finally:
        runner.put_away()
    return ProbeReport(component.name, **declares, **seen, remarks=tuple(remarks))


def _seen(runner: Runner, declares: Mapping[str, bool], remarks: list[str]) -> dict[str, Any]:
    """Find an excitation, then check what is declared. Resets come first: the other checks rely on them where they
    work.
    """
    excited = runner.excite()
    if not excited:
        remarks.append("no input made the outputs move; findings are weak")
    repeats = _attempt(runner, "reset and re-run", repeatable, remarks)
    honest = declares["declares_variable_step"] and _attempt(runner, "steps of other lengths", honest_step, remarks)
    found = _restoring(runner, remarks) if declares["declares_state"] else None
    spread = _spread(runner, found) if honest else {}
    return {
        "honest_step": honest,
        "repeatable": repeats,
        "excited": excited,
        "restores": found.restores if found else "no",
        "restore_mismatch": found.mismatch if found else None,
        "spread": spread,
        "drift": _drift_by_output(runner) if any(spread.values()) else {},
    }


def _restoring(runner: Runner, remarks: list[str]) -> Restoring | None:
    """What a restored state is worth; None where none could be had."""
    found: list[Restoring] = []

    def problem(runner: Runner) -> str:
        found.append(restoring(runner))
        within = " (within the tolerance of its solver)" if found[0].restores == "within_tolerance" else ""
        return found[0].problem + within

    _attempt(runner, "saving and restoring", problem, remarks)
    return found[0] if found else None


def _spread(runner: Runner, found: Restoring | None) -> dict[str, float]:
    """By output: what the solver's own steps make of it, seen after restoring and between a step and its parts."""
    try:
        _, whole, *divided = ends_of_divided_steps(runner, runner.h)
    except FAILURES:
        return {}
    apart = largest(whole, np.array(divided)) + (found.apart if found and found.restores == "within_tolerance" else 0.0)
    apart = np.where(apart <= ROUNDING * np.maximum(np.abs(whole), 1.0), 0.0, apart)
    return dict(zip(runner.output_names, apart.tolist(), strict=True))


def _drift_by_output(runner: Runner) -> dict[str, float]:
    """By output: what the solver's own errors add up to; empty where the FMU cannot be asked."""
    try:
        return dict(zip(runner.output_names, _drift(runner).tolist(), strict=True))
    except FAILURES:
        return {}


def _attempt(runner: Runner, what: str, check: Callable[[Runner], str], remarks: list[str]) -> bool:
    try:
        problem = check(runner)
    except FAILURES as error:
        problem = str(error)
        runner.reset_works = False  # whatever failed, go on with a fresh instance
    if problem:
        remarks.append(f"{what}: {problem}")
    return not problem


_DRIFT_STEPS = 100
_FINER = 0.01
"""Share of the tolerance that the other instance is given."""


def _drift(runner: Runner) -> np.ndarray:
    """Largest difference of each output over the time since the start, shape (q,), in its unit for each second.

    The first half of the steps is left out, where a difference that does not grow would count for much.

    Args:
        runner: the instance under test.

    Raises:
        FAILURES: the FMU refuses the finer tolerance, or cannot be stepped for so long.
    """
    pattern = (runner.h,) * _DRIFT_STEPS
    runner.begin()
    coarse = np.array(runner.steps(pattern))

    def make() -> Slave:
        component = runner.fresh()
        component.tolerance = _FINER * (component.tolerance or solver_tolerance(runner))
        return component

    with runner.twin(make) as other:
        other.begin()
        fine = np.array(other.steps(pattern))
    elapsed = runner.h * np.arange(1, _DRIFT_STEPS + 1)[:, None]
    return np.asarray(np.max((np.abs(coarse - fine) / elapsed)[_DRIFT_STEPS // 2 :], axis=0))

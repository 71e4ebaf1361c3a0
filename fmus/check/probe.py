"""The probe: what an FMU really does with steps of any length, saved states and resets, whatever it says about itself.

It works on instances of its own, made and thrown away here, with inputs that make something happen. The master chooses its
localisation method by it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from fmus.check.behaviour import exact_state, honest_step, repeatable
from fmus.check.bench import Bench
from fmus.check.steppable import FAILURES, Steppable


@dataclass(frozen=True)
class ProbeReport:
    """What was declared and what was seen.

    Args:
        component: name.
        declares_variable_step, declares_state: capability flags.
        honest_step: steps of any length did what they say.
        exact_state: after save, steps elsewhere and restore, the same steps gave the identical outputs.
        repeatable: after a reset the same steps gave the identical outputs.
        excited: some input made the outputs move, so that the findings mean something.
        remarks: what failed, in words.
    """

    component: str
    declares_variable_step: bool
    declares_state: bool
    honest_step: bool
    exact_state: bool
    repeatable: bool
    excited: bool
    remarks: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """For the summary."""
        return asdict(self) | {"remarks": list(self.remarks)}


def probe(make: Callable[[], Steppable], starts: Mapping[str, Any], start_time: float, h: float) -> ProbeReport:
    """Probe a component.

    Args:
        make: makes a fresh, not yet instantiated component; it is freed here.
        starts: start values as in the run.
        start_time: [s]. h: communication step of the run [s].

    Returns:
        What was seen; an FMU that fails under the probe is reported, not raised.
    """
    component = make()
    declares = {"declares_variable_step": component.can_vary_step, "declares_state": component.can_save}
    nothing_seen = {"honest_step": False, "exact_state": False, "repeatable": False, "excited": False}
    if component.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        component.free()
        remark = "not probed: the FMU allows one instance per process only"
        return ProbeReport(component.name, **declares, **nothing_seen, remarks=(remark,))
    bench = Bench(make, starts, start_time, h, component)
    remarks: list[str] = []
    try:
        seen = _seen(bench, declares, remarks)
    except FAILURES as error:
        seen = nothing_seen
        remarks.append(f"the probe came to an end: {error}")
    finally:
        bench.put_away()
    return ProbeReport(component.name, **declares, **seen, remarks=tuple(remarks))


def _seen(bench: Bench, declares: Mapping[str, bool], remarks: list[str]) -> dict[str, bool]:
    """Find an excitation, then check what is declared. Resets come first: the other checks rely on them where they work."""
    excited = bench.excite()
    if not excited:
        remarks.append("no input made the outputs move; findings are weak")
    repeats = _attempt(bench, "reset and re-run", repeatable, remarks)
    honest = declares["declares_variable_step"] and _attempt(bench, "steps of other lengths", honest_step, remarks)
    exact = declares["declares_state"] and _attempt(bench, "saving and restoring", exact_state, remarks)
    return {"honest_step": honest, "exact_state": exact, "repeatable": repeats, "excited": excited}


def _attempt(bench: Bench, what: str, check: Callable[[Bench], str], remarks: list[str]) -> bool:
    try:
        problem = check(bench)
    except FAILURES as error:
        problem = str(error)
        bench.reset_works = False  # whatever failed, go on with a fresh instance
    if problem:
        remarks.append(f"{what}: {problem}")
    return not problem

"""All that is known of an FMU: what its description declares, what the user assumes, and what a probe run shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.components.stated_lines import stated_lines
from cosim.errors import CosimError
from cosim.runs.executors import make_executor
from cosim.starter.guessed_signal import UNITS
from cosim.starter.inspected_fmu import InspectedFmu, inspect_fmu
from cosim.starter.probe_run import ProbeRun
from cosim.starter.probed_facts import Fact, ProbedFacts, is_silent, probe
from cosim.starter.starter_roles import is_observer, plant_roles
from cosim.starter.train_starter import train_times


@dataclass(frozen=True)
class KnownFacts:
    """What is known.

    Args:
        inspected: the FMU, as if it had declared the facts. facts: by name of the variable.
        radius: of a wheel that turns [m]; None where nothing shows it. remarks: what the user should know, a line each.
        probed: whether the FMU was run.
    """

    inspected: InspectedFmu
    facts: Mapping[str, Fact]
    radius: float | None
    remarks: Sequence[str] = ()
    probed: bool = False


def find_facts(path: Path, assumed: Sequence[str], *, probing: bool) -> KnownFacts:
    """Inspect an FMU; one that declares too little is run for some seconds, in a process of its own.

    Args:
        path: of the FMU. assumed: lines as of `cosim.components.stated_lines`. probing: whether it may be run.

    Raises:
        FmuLoadError: the FMU cannot be read, or offers no co-simulation.
        ScenarioError, CouplingError: what is assumed cannot be.
    """
    facts = _assumed(path, assumed)
    inspected = inspect_fmu(path, {name: fact.stated for name, fact in facts.items()})
    if (
        not probing
        or not inspected.runs_here
        or is_observer(inspected)
        or not is_silent(inspected, plant_roles(inspected))
    ):
        return KnownFacts(inspected, facts, None)
    found, remarks = ProbedFacts(), []
    try:
        found = _probed(path, inspected, facts)
    except CosimError as error:
        remarks.append(f"A probe run failed; units and roles are guessed by names alone: {error}")
    facts = found.facts | {name: fact.over(found.facts.get(name)) for name, fact in facts.items()}
    if found.facts:
        remarks.append(f"A probe run of {path.name} showed, since it declares too little:")
        remarks += [f"  {name}: {_described(fact)}" for name, fact in facts.items()]
    elif not remarks:
        remarks.append(
            f"A probe run of {path.name} showed no train: no input drives a speed in a unit that trains have."
        )
    inspected = inspect_fmu(path, {name: fact.stated for name, fact in facts.items()})
    return KnownFacts(inspected, facts, found.radius, remarks, probed=True)


def _assumed(path: Path, lines: Sequence[str]) -> dict[str, Fact]:
    """What the user assumes, by name of the variable."""
    silent = inspect_fmu(path).component
    declared = {name: silent.unit_name(name) for name in silent.variables}
    stated = stated_lines("--assume", lines, declared, UNITS)
    return {name: Fact(one, "as assumed") for name, one in stated.items()}


def _described(fact: Fact) -> str:
    """A fact on one line, for people."""
    stated = fact.stated
    unit = f"{'-' if stated.sign < 0 else ''}{stated.unit or ''}"
    return f"{', '.join(word for word in (stated.meaning, unit) if word)} ({fact.reason})"


def _probed(path: Path, inspected: InspectedFmu, facts: Mapping[str, Fact]) -> ProbedFacts:
    roles, stated = plant_roles(inspected), {name: fact.stated for name, fact in facts.items()}
    outputs = {signal.name for signal in inspected.outputs}
    seen = [guess.signal.name for guess in (roles.position, roles.speed, roles.wheel_speed) if guess is not None]
    hidden = [name for name in seen if name not in outputs]
    with make_executor(1, apart=True) as executor:
        return probe(inspected, roles, ProbeRun(path.resolve(), stated, train_times(inspected)[1], hidden, executor))

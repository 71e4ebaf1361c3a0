"""Whether a recorded run is one of the plant of a scenario, by what its results say of its components. Runs nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from cosim.components.component import Component
from cosim.components.start_values import declared_start
from cosim.results.result import Result
from cosim.run.described_components import describe_component
from cosim.run.run_seeds import SEED
from cosim.scenario.schema import ScenarioTable


def other_plant(recorded: Result, table: ScenarioTable, folder: Path, names: Iterable[str]) -> str:
    """What was another model, or ran with other parameters, in the recorded run than in the scenario, in a sentence;
    empty where nothing was, or where the recording does not say what ran.

    Args:
        recorded: the run. table: of the scenario. folder: start of relative paths. names: components of the plant.

    Raises:
        CosimError: a component of the scenario cannot be described.
    """
    ran = {entry["name"]: entry for entry in recorded.summary.get("components", ())}
    if not ran:
        return ""
    differences = [text for name in names if (text := _difference(name, ran.get(name), table, folder))]
    if not differences:
        return ""
    return f"The recorded run is not one of this scenario: {'; '.join(differences)}. What follows holds for that run."


def _difference(name: str, ran: Mapping[str, Any] | None, table: ScenarioTable, folder: Path) -> str:
    """How one component differs from the recorded one, in words."""
    if ran is None:
        return f"{name} did not run in it"
    stated = table.components[name]
    component = describe_component(name, stated, folder, table.title)
    there = ran.get("model"), ran.get("guid")
    here = component.description.modelName, str(component.description.guid)
    if there != here:
        return f"{name} was {there[0]} (GUID {there[1]}) and is {here[0]} (GUID {here[1]})"
    if ran.get("preset") != stated.preset:
        return f"{name} had the preset {ran.get('preset')!r} and has {stated.preset!r}"
    return ", ".join(_other_parameters(component, ran.get("parameters") or {}, stated.parameters))


def _other_parameters(component: Component, former: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Numbers that were others, in words; what was not set, then or now, had the value that is declared. Arrays are
    left out, and seeds, which every run may have of its own.
    """
    differences = []
    for key in sorted({*former, *now} & {*component.variables} - {SEED}):
        if component.variables[key].shape or "[" in key:
            continue
        declared = declared_start(component.variables[key])
        before, after = former.get(key, declared), now.get(key, declared)
        if isinstance(before, int | float) and isinstance(after, int | float) and before != after:
            differences.append(f"{component.name}.{key} was {before!r} and is {after!r}")
    return differences

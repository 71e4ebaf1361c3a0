"""Models: from the tables of a scenario to components."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import fmu_observer
import fmus
import plant_models
from cosim.components.component import Component
from cosim.components.loading import load_block, load_fmu
from cosim.errors import FmuLoadError, ScenarioError, nearest
from cosim.scenario.schema import ComponentTable
from plant_models.hybrid import HybridSystem

LATE_PARAMETERS = frozenset({"late_policy", "replay_horizon"})


def shipped() -> Mapping[str, type[HybridSystem]]:
    """All shipped systems by name, plants and observers."""
    return {**plant_models.PLANTS, **fmu_observer.OBSERVERS}


def make_system(table: ComponentTable, where: str) -> HybridSystem | None:
    """The hybrid system of a component, or None for an FMU by path.

    Raises:
        ScenarioError: unknown model, option or preset.
    """
    if table.fmu is not None:
        return None
    registry = plant_models.PLANTS if table.model is not None else fmu_observer.OBSERVERS
    name = table.model or table.observer or ""
    if name not in registry:
        kind = "model" if table.model is not None else "observer"
        raise ScenarioError(f"{where}: unknown {kind} {name!r}; {nearest(name, registry)}")
    factory = registry[name]
    _check_options(factory, table.options, where)
    system = factory(**table.options)
    if table.preset is not None and table.preset not in system.presets:
        raise ScenarioError(f"{where}: {name} has no preset {table.preset!r}; {nearest(table.preset, system.presets)}")
    return system


def component_factory(name: str, table: ComponentTable, folder: Path, where: str) -> Callable[[], Component]:
    """A function that makes a fresh component; called once for the run and once for the probe.

    Args:
        name: component name. table: its table. folder: paths are relative to it. where: place for messages.

    Raises:
        ScenarioError, FmuLoadError: the component cannot be made.
    """
    system = make_system(table, where)
    if system is None:
        path = (folder / str(table.fmu)).resolve()
        return lambda: load_fmu(path, name)
    realisation = table.realisation or ("fmu3" if table.model is not None else "block3")
    version: Any = int(realisation[-1])
    if realisation.startswith("block"):
        arguments = {"preset": table.preset, "late_policy": table.late_policy, "replay_horizon": table.replay_horizon}
        return lambda: load_block(system, name, version, **arguments)
    path = native_fmu(system, version, table.preset, where)
    return lambda: load_fmu(path, name)


def protocol_parameters(table: ComponentTable, component: Component, where: str) -> dict[str, float | str]:
    """What the table says about late events, as parameters of an FMU; a block was made with them.

    Raises:
        ScenarioError: the FMU has no such parameter.
    """
    if component.kind != "FMU":
        return {}
    given: dict[str, float | str] = {name: getattr(table, name) for name in sorted(table.model_fields_set & LATE_PARAMETERS)}
    for name in given:
        if name not in component.variables:
            raise ScenarioError(f"{where}: this FMU has no parameter {name}; what it does with late events is its own choice.")
    return given


def native_fmu(system: HybridSystem, version: Any, preset: str | None, where: str) -> Path:
    """The FMU of a shipped system, built where it was not yet.

    Raises:
        FmuLoadError: it cannot be built; `where` is the place for the message.
    """
    try:
        return fmus.cached_fmu(system, fmi_version=version, preset=preset)
    except (OSError, RuntimeError, ValueError) as error:
        raise FmuLoadError(f"{where}: cannot build the FMU of {system.name}: {error}") from error


def _check_options(factory: type[HybridSystem], options: Mapping[str, Any], where: str) -> None:
    for key, value in options.items():
        if key not in factory.option_choices:
            raise ScenarioError(f"{where}: {factory.name} has no option {key!r}; {nearest(key, factory.option_choices)}")
        choices = factory.option_choices[key]
        if choices and value not in choices:
            raise ScenarioError(
                f"{where}: option {key} = {value!r} of {factory.name}; choose from {', '.join(map(repr, choices))}."
            )

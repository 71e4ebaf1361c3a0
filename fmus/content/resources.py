"""Resource files: what an FMU carries in ``resources/``, written from the start values of its vector parameters."""

from __future__ import annotations

from itertools import pairwise

from fmus.content.generate import GenerationError
from plant_models.hybrid import HybridSystem, Resource, scalar_names
from plant_models.hybrid.resource import UNUSED_ENTRY


def resource_files(system: HybridSystem, preset: str | None) -> dict[str, bytes]:
    """The files by name inside the FMU, each a header and one row for every entry in use.

    Args:
        system: the hybrid system. preset: preset of the start values; None for the system's default.

    Raises:
        GenerationError: start values that are to go into a file do not increase.
    """
    names = scalar_names(system.parameter_signals)
    starts = dict(zip(names, map(float, system.start_parameters(preset)), strict=True))
    sizes = {s.name: s.scalar_names for s in system.parameter_signals}
    return {
        f"resources/{resource.file}": _table(system, resource, [starts[name] for name in sizes[resource.parameter]])
        for resource in system.resources
    }


def _table(system: HybridSystem, resource: Resource, values: list[float]) -> bytes:
    used = [value for value in values if value < UNUSED_ENTRY]
    if any(later <= earlier for earlier, later in pairwise(used)):
        raise GenerationError(
            f"{system.name}: the start values of {resource.parameter} must increase; {resource.file} lists them so."
        )
    return "\n".join([resource.column, *map(repr, used), ""]).encode()

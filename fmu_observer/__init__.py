"""What the train believes: observers, detectors, their certificates, and the FMU-style interface over any of them.

Importing this package costs nothing: the registry `OBSERVERS` is built when it is first asked for. It may use
`plant_models`, never `fmus` or `cosim`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plant_models.hybrid import HybridSystem

    OBSERVERS: dict[str, type[HybridSystem]]

__all__ = ["OBSERVERS"]


def __getattr__(name: str) -> Any:
    if name != "OBSERVERS":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from fmu_observer import registry  # noqa: PLC0415 - imports CasADi; only for those who ask

    globals()["OBSERVERS"] = registry.OBSERVERS
    return registry.OBSERVERS

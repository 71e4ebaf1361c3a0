"""CasADi, loaded when something of it is first used: an installation that runs and compares FMUs may be without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.missing_package import LazyPackage, optional_package

PURPOSE = "Tracing of a model, for native FMUs, exact derivatives and designs"

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyPackage("casadi", PURPOSE)

__all__ = ["ca", "demand_casadi"]


def demand_casadi() -> None:
    """That CasADi is there, before a system is called one that cannot be traced: without it none is.

    Raises:
        MissingPackageError: it is not installed.
    """
    optional_package("casadi", PURPOSE)

"""Versions of everything that can change a number. Loads none of it."""

from __future__ import annotations

import platform
from functools import cache

from plant_models.installed import installed_version

PACKAGES = ("fmu-observer", "fmpy", "numpy", "scipy", "casadi")


def versions() -> dict[str, str]:
    """Versions of Python and the packages, and the platform, by name."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    return {"python": platform.python_version(), "platform": platform.platform(), **{p: _version(p) for p in PACKAGES}}


def version_text() -> str:
    """The versions in one line, the package first."""
    known = versions()
    python, system = known.pop("python"), known.pop("platform")
    return f"{', '.join(f'{name} {number}' for name, number in known.items())}, Python {python} on {system}"


def _version(package: str) -> str:
    return installed_version(package) or "not installed"

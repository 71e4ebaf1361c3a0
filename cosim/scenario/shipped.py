"""The scenarios that come with the package: their names, and their files as they stand."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

from cosim.scenario.toml_file import read_toml

SHIPPED = files("cosim") / "scenarios"


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the package."""
    return sorted(Path(str(entry)).stem for entry in SHIPPED.iterdir() if str(entry).endswith(".toml"))


def shipped_file(name: str) -> Path:
    """Where the file of a scenario that comes with the package is, or would be.

    Args:
        name: of the scenario.
    """
    return Path(str(SHIPPED)) / f"{name}.toml"


def shipped_tables(name: str) -> dict[str, Any]:
    """The keys in the file of a scenario that comes with the package, not checked.

    Args:
        name: of the scenario.
    """
    return read_toml(shipped_file(name))

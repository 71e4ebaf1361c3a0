"""Runs that are cheap to make, write and make again: one FMU in C, ten steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.run.outcome import Outcome


def coast(folder: Path, rate: float = 1.0) -> Path:
    """``coast.fmu`` in a folder: v' = -rate v, v(0) = 36."""
    return linear_fmu(folder, "coast", [[-rate]], [[0.0]], [[1.0]], [[0.0]], version=2, x0=[36.0])


def coasting(folder: Path, **tables: Any) -> Scenario:
    """A scenario of ``coast.fmu`` in that folder."""
    return Scenario(stop=1.0, step=0.1, folder=folder, master={"stepper": "python"}, **tables).add(
        "train", fmu="coast.fmu"
    )


def quietly(scenario: Scenario, **arguments: Any) -> Outcome:
    """The outcome, without warnings."""
    return scenario.run(warn=lambda _text: None, **arguments)


def everything(folder: Path) -> dict[str, bytes]:
    """The content of all files in a folder, by relative path."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}

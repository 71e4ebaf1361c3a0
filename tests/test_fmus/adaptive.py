"""A test FMU whose solver takes steps of its own choice, to a tolerance that it can be told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from test_fmus.build import TIME, Define, build_fmu, capability_flags
from test_fmus.description import Variable, Version

W, MIDDLE = 1.5, 0.2


def adaptive_fmu(
    folder: Path,
    name: str = "adaptive",
    *,
    version: Version = 3,
    usual: float = 1e-4,
    finest: float = 0.0,
    forgets: bool = False,
    declared: float | None = None,
) -> Path:
    """An oscillator, ``p = MIDDLE + sin(W t)``: outputs `position`, `speed` and `reported`, the tolerance it got (0:
    none).

    Args:
        usual: tolerance where it is told none. finest: it refuses smaller ones.
        forgets: restored states lack the speed; else they lack the length of the solver's last step.
        declared: tolerance of the default experiment.
    """
    variables = [
        TIME,
        Variable("position", 1, "output", unit="m"),
        Variable("speed", 2, "output", unit="m/s"),
        Variable("reported", 3, "output"),
    ]
    defines: dict[str, Define] = {
        "W": W,
        "MIDDLE": MIDDLE,
        "USUAL_TOLERANCE": usual,
        "FINEST": finest,
        "FORGETS": forgets,
        "TAKES_TOLERANCE": version > 1,
    }
    return build_fmu(
        folder, name, "adaptive.c", version, variables, capability_flags(version), defines, tolerance=declared
    )


def crossings(position: float, until: float) -> np.ndarray:
    """When the oscillator is at a position [m], up to a time [s], shape (n,)."""
    first = np.arcsin(position - MIDDLE)
    turns = 2.0 * np.pi * np.arange(int(until * W / np.pi) + 2)
    times = np.sort(np.concatenate([first + turns, np.pi - first + turns])) / W
    return times[(times > 0.0) & (times <= until)]

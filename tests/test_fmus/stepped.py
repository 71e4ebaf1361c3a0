"""A model exchange FMU as a component that is stepped from where it stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cosim.components.component import Component
from cosim.components.loading import load_fmu

FINE = 1e-10


class Stepped:
    """An FMU that is initialised, its input and its outputs.

    Args:
        path: of the FMU. tolerance: of the solver. start: [s]. value: of the input at the start.
    """

    def __init__(self, path: Path, tolerance: float | None = FINE, start: float = 0.0, value: float = 0.0) -> None:
        self.component: Component = load_fmu(path, "plant", tolerance)
        self.component.instantiate()
        self.component.enter_initialization(start, start + 100.0)
        self.names = self.component.names("output")
        self.outputs = np.zeros(len(self.names))
        self._write, self.input = self.component.writer(["input"])
        self.input[0] = value
        self._write()
        self.component.exit_initialization()
        self._read = self.component.reader(self.names, self.outputs)
        self._read()
        self.time = start

    def to(self, until: float, value: float | None = None) -> np.ndarray:
        """Step to an instant [s] under an input; outputs there."""
        if value is not None:
            self.input[0] = value
            self._write()
        self.component.advance(self.time, until)
        self._read()
        self.time = until
        return self.outputs.copy()

    def free(self) -> None:
        """Free the instance."""
        self.component.terminate()
        self.component.free()

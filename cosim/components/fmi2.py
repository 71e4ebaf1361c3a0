"""The FMI 2.0 dialect of a component."""

from __future__ import annotations

from cosim.components.component import Component
from fmus.fmi.fmi2 import FMI2Slave


class FMI2Component(Component, FMI2Slave):
    """An FMI 2.0 co-simulation slave. Arguments as for `Component`."""

    def _says_why(self) -> bool:
        return bool(self.messages) or self.kind == "block"

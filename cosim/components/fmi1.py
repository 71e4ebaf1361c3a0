"""The FMI 1.0 dialect of a component."""

from __future__ import annotations

from typing import Any

from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.errors import CouplingError
from fmus.fmi.fmi1 import FMI1Slave


class FMI1Component(Component, FMI1Slave):
    """An FMI 1.0 co-simulation slave.

    Args:
        name: name in the scenario.
        slave: object with fmpy's slave call surface.
        description: its model description.
        negated: names of variables with ``alias="negatedAlias"``: the slave holds the value with the other sign.
        more: further arguments of `Component`.

    Raises:
        CouplingError: a declared start value is none of its variable's type.
    """

    def __init__(
        self,
        name: str,
        slave: Any,
        description: ModelDescription,
        *,
        negated: frozenset[str] = frozenset(),
        **more: Any,
    ) -> None:
        super().__init__(name, slave, description, **more)
        self.negated = negated
        self._forget()

    def _forget(self) -> None:
        try:
            super()._forget()
        except ValueError as error:
            raise CouplingError(str(error)) from error

    def set_start(self, name: str, value: Any) -> None:  # noqa: D102 - see Component
        super().set_start(name, value)
        self._hold(name, value)

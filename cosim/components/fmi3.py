"""The FMI 3.0 dialect of a component: structural parameters, inputs set within a step, output clocks by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.components.start_values import STRUCTURAL, StartValue
from cosim.errors import CouplingError
from fmus.fmi.exact_ports import make_exact_writer
from fmus.fmi.fmi3 import FMI3Slave
from fmus.fmi.ports import is_native
from fmus.fmi.sense import shape_fault


class FMI3Component(Component, FMI3Slave):
    """An FMI 3.0 co-simulation slave.

    Args:
        name: name in the scenario.
        slave: object with fmpy's slave call surface.
        description: its model description.
        more: further arguments of `Component`.
    """

    def __init__(self, name: str, slave: Any, description: ModelDescription, **more: Any) -> None:
        super().__init__(name, slave, description, **more)
        self._structure: dict[str, int] = {}
        self._configured: dict[str, int] = {}  # what the slave has of it

    def request_intermediate_updates(self, names: Sequence[str]) -> None:
        """Ask, before `instantiate`, to be called back within steps to set inputs; see `follow_within_step`.

        Args:
            names: of the inputs.
        """
        if self.capabilities.providesIntermediateUpdate and is_native(self.slave):
            self._intermediate.request([self.variable(name, "input") for name in names])

    def follow_within_step(self, names: Sequence[str], handler: Callable[[float], None]) -> bool:
        """Call `handler` whenever inputs may be set within a step.

        Args:
            names: of the inputs.
            handler: is called with the time [s].

        Returns:
            False where that was not arranged by `request_intermediate_updates`.
        """
        if not names or not set(names) <= set(self._intermediate.requested):
            return False
        self._intermediate.handler = handler
        return True

    def output_clock(self, name: str) -> int:
        """Value reference of a triggered output clock.

        Args:
            name: of the clock.
        """
        return int(self.variable(name, "output").valueReference)

    # -- structural parameters --------------------------------------------------------------------------------------

    def configure(self, structure: Mapping[str, Any]) -> None:  # noqa: D102 - see DescribedComponent
        self._structure |= structure
        _resize(self.description, self._structure)

    def set_start(self, name: str, value: StartValue) -> None:  # noqa: D102 - see Component
        if self.variable(name).causality != STRUCTURAL:
            super().set_start(name, value)
            return
        self.configure({name: value})
        if self._structure != self._configured:
            self._configure_slave()
        self.starts[name] = value

    def reset(self) -> None:  # noqa: D102 - see Component
        super().reset()
        self._configure_slave()

    def _instantiate(self) -> None:
        super()._instantiate()
        self._configure_slave()

    def _configure_slave(self) -> None:
        """Structural parameters are set in Configuration Mode, right after the instance was made."""
        if self._structure:
            stated = ", ".join(f"{name} = {value}" for name, value in self._structure.items())
            self.guard(f"setting {stated} in Configuration Mode", self._set_structure)
            self._configured = dict(self._structure)

    def _set_structure(self) -> None:
        self.slave.enterConfigurationMode()
        for name, value in self._structure.items():
            make_exact_writer(self.slave, self.fmi_version, self.variables[name])([value])
        self.slave.exitConfigurationMode()


def _resize(description: ModelDescription, structure: Mapping[str, int]) -> None:
    """Shapes of all arrays for these values of the structural parameters; the others have their start values.

    Args:
        description: whose arrays get their shapes.
        structure: values of structural parameters by name.

    Raises:
        CouplingError: an array would become too large.
    """
    by_reference = {v.valueReference: structure[v.name] for v in description.modelVariables if v.name in structure}
    for variable in description.modelVariables:
        if variable.dimensions:
            variable.shape = tuple(_extent(dimension, by_reference) for dimension in variable.dimensions)
            fault = shape_fault(variable)
            if fault is not None:
                stated = ", ".join(f"{name} = {value}" for name, value in structure.items())
                raise CouplingError(f"With {stated or 'its start values'}: {fault}")


def _extent(dimension: Any, stated: Mapping[int, int]) -> int:
    if dimension.start is not None:
        return int(dimension.start)
    if dimension.valueReference in stated:
        return stated[dimension.valueReference]
    return int(dimension.variable.start)

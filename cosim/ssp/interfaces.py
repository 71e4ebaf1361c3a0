"""Interfaces: what the FMU of a component says of its variables, as far as connections and parameters need it. Loads no
library.
"""

from __future__ import annotations

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import nearest
from cosim.ssp.common import FAMILIES
from cosim.ssp.document import Node, fail
from cosim.ssp.package_data import Connector
from fmus.fmi.types import enumeration_items
from fmus.fmi.units import NamedUnit, Units


class Interface:
    """The variables of an FMU.

    Args:
        description: its model description. what: its name for messages.
    """

    def __init__(self, description: ModelDescription, what: str) -> None:
        self.description, self.what = description, what
        self.variables: dict[str, ModelVariable] = {v.name: v for v in description.modelVariables}
        self._units = Units(description)

    def variable(self, name: str, node: Node) -> ModelVariable:
        """The variable of this name, or of the array it is an element of.

        Args:
            node: element of the document.

        Raises:
            ScenarioError: there is none; the nearest names are suggested.
        """
        if name not in self.variables:
            fail(node, f"{self.what} has no variable {name!r}; {nearest(name, self.variables)}")
        return self.variables[name]

    def unit(self, name: str) -> NamedUnit | None:
        """The unit of a variable, or None where it has none or one that cannot be understood."""
        found = self._units.named(self.variables[name])
        return found if found is not None and found.unit is not None else None

    def items(self, name: str) -> dict[str, int]:
        """Items of an enumeration by name; empty for another type."""
        return enumeration_items(self.variables[name])

    def check(self, connector: Connector) -> None:
        """A connector of the component must be a variable of the FMU, of its kind and type.

        Raises:
            ScenarioError: it is not.
        """
        variable = self.variable(connector.name, connector.node)
        kind, causality = connector.kind, variable.causality or "local"
        if self.description.fmiVersion.startswith("1") and kind not in ("input", "output"):
            causality = kind  # FMI 1.0 has other words for the rest
        if kind not in ("unspecified", causality):
            fail(
                connector.node,
                f"connector {connector.name!r} is of kind {kind!r}, the variable of {self.what} has causality "
                f"{causality!r}.",
            )
        if connector.type is not None and connector.type.family != FAMILIES[variable.type]:
            fail(
                connector.node,
                f"connector {connector.name!r} is of type {connector.type.name}, the variable of {self.what} of type "
                f"{variable.type}.",
            )

"""What a component is, in the words of a scenario: its variables found by name, their units, what can be set. Calls no
slave.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from fmpy.model_description import ModelVariable

from cosim.errors import CouplingError, nearest
from fmu_observer.annotated_variable import can_be_missing
from fmus.fmi import described as fmi
from fmus.fmi.elements import Element, described
from fmus.fmi.standard import OWN_TOOL
from fmus.fmi.types import FLOATING_TYPES, why_not_set
from fmus.fmi.units import NamedUnit, Units
from plant_models.hybrid.units import Unit, UnitError


class DescribedComponent(fmi.Described):
    """A component before anything of it runs. Elements of arrays are named ``x[1]``, ``m[2,3]``."""

    source: str
    """Where it comes from, for people."""

    kind: str
    """``FMU``, ``block`` or another kind of slave."""

    declared_missing: frozenset[str] = frozenset()
    """Signals of which the scenario says that they can be missing."""

    def configure(self, structure: Mapping[str, Any]) -> None:
        """Take the structural parameters, from which the shapes of arrays follow. Before `Component.instantiate`.

        Args:
            structure: values by name, from `cosim.components.start_values.start_values`.

        Raises:
            CouplingError: an array would become too large.
        """

    def declare_missing(self, names: Sequence[str], where: str) -> None:
        """Say of outputs that NaN stands for a missing value, of inputs that the component leaves NaN out.

        Args:
            names: of variables, in the words of a scenario. where: place for messages.

        Raises:
            CouplingError: there is no such input, output or local variable, or its type has no NaN.
        """
        for name in names:
            variable = self.variable(name, "output", "input", "local")
            if variable.type not in FLOATING_TYPES:
                raise CouplingError(
                    f"{where}: can_be_missing: {self.name}.{name} is a {variable.type}, which has no NaN; only a "
                    "floating-point number can be missing."
                )
        self.declared_missing |= frozenset(names)

    def can_be_missing(self, name: str) -> bool:
        """Whether NaN stands for a missing value of a signal, or is left out by an input.

        Args:
            name: variable, or element of an array.
        """
        return not self.declared_missing.isdisjoint((name, name.partition("[")[0])) or can_be_missing(
            self.variables[name]
        )

    def known_values(self, name: str) -> list[tuple[float, str]] | None:
        """Every value that an output will have, and where it first stands; None where only a run shows it.

        Args:
            name: of the output.
        """
        return None

    def texts(self, name: str) -> Sequence[str]:
        """The texts that the numbers of an output stand for, 1 for the first; none where they are numbers.

        Args:
            name: of the output.
        """
        return ()

    def choose_tolerance(self, tolerance: float | str | None) -> None:
        """Another relative tolerance than the declared one. FMI 1.0 knows of none.

        Args:
            tolerance: relative, or ``none``; None changes nothing.
        """
        if tolerance is not None and self.fmi_version > 1:
            self.tolerance = None if isinstance(tolerance, str) else tolerance

    @property
    def restores_exactly(self) -> bool:
        """Whether its states are known to be exact without a probe: those of blocks and of the FMUs this package
        exports.
        """
        return self.can_save and (self.kind == "block" or self.description.generationTool == OWN_TOOL)

    def elements(self, name: str) -> list[Element]:
        """The elements of a variable, row by row; a scalar or a single element is alone.

        Args:
            name: variable, or element of an array.

        Raises:
            CouplingError: there is no such variable or element.
        """
        self.variable(name)
        return self.variables.expanded(name)

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """The variable of this name, or the array that holds the element of this name.

        Args:
            name: variable, or element of an array.
            causalities: those that it may have; none for any.

        Raises:
            CouplingError: there is none, or it has another causality; the nearest names are suggested.
        """
        try:
            found = self.variables[name]
        except KeyError as error:
            array = self.variables.get(name.partition("[")[0])
            if array is not None and array.shape:
                raise CouplingError(
                    f"{self.name}: no element {name!r} in a {described(array)}; the first is 1."
                ) from error
            candidates = [v.name for v in self.variables.values() if not causalities or v.causality in causalities]
            raise CouplingError(f"{self.name}: no variable {name!r}; {nearest(name, candidates)}") from error
        if causalities and found.causality not in causalities:
            raise CouplingError(
                f"{self.name}.{name} has causality '{found.causality}', expected {' or '.join(causalities)}; "
                f"such variables: {', '.join(self.names(causalities[0])) or 'none'}."
            )
        return found

    def unit_name(self, name: str) -> str | None:
        """Name of a variable's unit, its own or that of its declared type; None where there is none.

        Args:
            name: variable, or element of an array.
        """
        return self._units.name(self.variables[name])

    def named_unit(self, name: str) -> NamedUnit | None:
        """The unit of a variable with its name, or None where it declares none.

        Args:
            name: variable, or element of an array.
        """
        return self._units.named(self.variables[name])

    def displayed_unit(self, name: str) -> NamedUnit | None:
        """The display unit of a variable, see `Units.displayed`.

        Args:
            name: variable, or element of an array.
        """
        return self._units.displayed(self.variables[name])

    def unit(self, name: str) -> Unit | None:
        """The unit of a variable from the FMU's own unit definitions, or None where it declares none.

        A relative quantity (a temperature difference) has no offset.

        Args:
            name: variable, or element of an array.

        Raises:
            UnitError: a unit name without definition that cannot be understood.
        """
        try:
            return self._units.of(self.variables[name])
        except UnitError as error:
            raise UnitError(f"{self.name}.{name}: {error}") from error

    def settable(self, name: str) -> ModelVariable:
        """The variable of this name, or the array that holds the element of this name, if a start value can be set.

        Args:
            name: variable, or element of an array.

        Raises:
            CouplingError: there is none, or it cannot be set.
        """
        variable = self.variable(name)
        if objection := why_not_set(variable):
            raise CouplingError(f"{self.name}.{name} cannot be set: it {objection}.")
        return variable

    @cached_property
    def _units(self) -> Units:
        return Units(self.description)

"""Variables that say more than FMI has attributes for: an output that warns, marks such as an optional input.

fmpy's `ModelVariable` knows no annotations. What describes a system makes these variables, what reads a description
from a file makes them again.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from plant_models.hybrid.signal import OutputWarning

_OPTIONAL, CAN_BE_MISSING = "optional", "can_be_missing"
MARKS = {
    _OPTIONAL: ("fmu-observer.optional-input", "OptionalInput"),
    CAN_BE_MISSING: ("fmu-observer.can-be-missing", "CanBeMissing"),
}
"""Marks, which are attributes of a `Signal`: annotation and element by which the description of an exported model
carries each."""


class AnnotatedVariable(ModelVariable):
    """A variable of a model description with what annotations say of it.

    Args:
        warning: what is reported after a run in which an output was not zero; None for nothing.
        marks: some of `MARKS`.
        attributes: those of `ModelVariable`, by name.
    """

    def __init__(self, warning: OutputWarning | None = None, marks: Collection[str] = (), **attributes: Any) -> None:
        super().__init__(**attributes)
        self.warning, self.marks = warning, frozenset(marks)

    @classmethod
    def of(
        cls, variable: ModelVariable, warning: OutputWarning | None = None, marks: Collection[str] = ()
    ) -> AnnotatedVariable:
        """A variable with the attributes of another one.

        Args:
            variable: the other one. warning, marks: see the class.
        """
        made = cls(warning, marks)
        for attribute in ModelVariable.__attrs_attrs__:
            setattr(made, attribute.name, getattr(variable, attribute.name))
        return made

    def __getstate__(self) -> tuple[Any, OutputWarning | None, frozenset[str]]:
        return super().__getstate__(), self.warning, self.marks  # that of attrs keeps its own fields only

    def __setstate__(self, state: tuple[Any, OutputWarning | None, frozenset[str]]) -> None:
        super().__setstate__(state[0])
        self.warning, self.marks = state[1:]


def declared_warnings(description: ModelDescription) -> dict[str, OutputWarning]:
    """What outputs warn of where they are not zero, by name.

    Args:
        description: of a block, or of an FMU as `fmus.fmi.description` reads it.
    """
    annotated = (v for v in description.modelVariables if isinstance(v, AnnotatedVariable))
    return {v.name: v.warning for v in annotated if v.warning is not None}


def is_optional(variable: ModelVariable) -> bool:
    """Whether an input may be left unconnected on purpose.

    Args:
        variable: of a block, or of an FMU as `fmus.fmi.description` reads it; that of another tool never says so.
    """
    return isinstance(variable, AnnotatedVariable) and _OPTIONAL in variable.marks


def can_be_missing(variable: ModelVariable) -> bool:
    """Whether NaN stands for a missing value of an output, or is left out by an input.

    Args:
        variable: of a block, or of an FMU as `fmus.fmi.description` reads it; that of another tool never says so.
    """
    return isinstance(variable, AnnotatedVariable) and CAN_BE_MISSING in variable.marks

"""Variables that say more than FMI has attributes for: an output that warns, an input that is optional.

fmpy's `ModelVariable` knows no annotations. What describes a system makes these variables, what reads a description
from a file makes them again.
"""

from __future__ import annotations

from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from plant_models.hybrid.output_warning import OutputWarning

OPTIONAL_ANNOTATION, OPTIONAL_ELEMENT = "fmu-observer.optional-input", "OptionalInput"
"""Names under which the description of an exported model carries that an input is optional."""


class AnnotatedVariable(ModelVariable):
    """A variable of a model description with what annotations tell of it.

    Args:
        warning: what is told after a run in which an output was not zero; None for nothing.
        optional: whether an input keeps its start value on purpose where nothing is connected to it.
        attributes: those of `ModelVariable`, by name.
    """

    def __init__(self, warning: OutputWarning | None = None, optional: bool = False, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.warning, self.optional = warning, optional

    @classmethod
    def of(
        cls, variable: ModelVariable, warning: OutputWarning | None = None, optional: bool = False
    ) -> AnnotatedVariable:
        """A variable with the attributes of another one.

        Args:
            variable: the other one. warning, optional: see the class.
        """
        made = cls(warning, optional)
        for attribute in ModelVariable.__attrs_attrs__:
            setattr(made, attribute.name, getattr(variable, attribute.name))
        return made

    def __getstate__(self) -> tuple[Any, OutputWarning | None, bool]:
        return super().__getstate__(), self.warning, self.optional  # that of attrs keeps its own fields only

    def __setstate__(self, state: tuple[Any, OutputWarning | None, bool]) -> None:
        super().__setstate__(state[0])
        self.warning, self.optional = state[1:]


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
    return isinstance(variable, AnnotatedVariable) and variable.optional

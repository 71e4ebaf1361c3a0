"""The variable of an output that warns: fmpy's `ModelVariable`, which knows no annotations, and the warning.

What describes a system makes it, what reads a description from a file makes it again.
"""

from __future__ import annotations

from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from plant_models.hybrid.output_warning import OutputWarning


class WarningVariable(ModelVariable):
    """A variable of a model description with what it warns of where it is not zero.

    Args:
        warning: what is told after a run. attributes: those of `ModelVariable`, by name.
    """

    def __init__(self, warning: OutputWarning, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.warning = warning

    @classmethod
    def of(cls, variable: ModelVariable, warning: OutputWarning) -> WarningVariable:
        """A variable with the attributes of another one.

        Args:
            variable: the other one. warning: what is told after a run.
        """
        made = cls(warning)
        for attribute in ModelVariable.__attrs_attrs__:
            setattr(made, attribute.name, getattr(variable, attribute.name))
        return made

    def __getstate__(self) -> tuple[Any, OutputWarning]:
        return super().__getstate__(), self.warning  # that of attrs keeps its own fields only

    def __setstate__(self, state: tuple[Any, OutputWarning]) -> None:
        super().__setstate__(state[0])
        self.warning = state[1]


def declared_warnings(description: ModelDescription) -> dict[str, OutputWarning]:
    """What outputs warn of where they are not zero, by name.

    Args:
        description: of a block, or of an FMU as `fmus.fmi.description` reads it.
    """
    return {v.name: v.warning for v in description.modelVariables if isinstance(v, WarningVariable)}

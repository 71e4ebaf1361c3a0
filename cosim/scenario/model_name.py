"""Names of models in a scenario: a shipped or registered one, ``file.py:Class``, ``package.module:Class``, or in a
script a class or an instance itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from inspect import isabstract
from pathlib import Path
from typing import Annotated, Any

from pydantic import PlainSerializer, PlainValidator, ValidationInfo

from cosim.components.python_model import PythonModel, is_python_model
from cosim.errors import ScenarioError, nearest
from plant_models import SYSTEM
from plant_models.registry import RegistryError, descends_from
from plant_models.user_file import Expected, UserFileError, load_class, name_of, names_code

EXPECTED = Expected(
    "subclass of HybridSystem or class with step(t, inputs, dt)",
    lambda found: isinstance(found, type) and not isabstract(found) and _is_model(found),
)


def _is_model(found: Any) -> bool:
    """Whether an object is a hybrid system or can be stepped as plain Python, or is a class of such."""
    return descends_from(found, SYSTEM) or is_python_model(found)


class ModelName(str):
    """A name as it is written, which remembers what else is known of the model.

    Attributes:
        folder: that the path of a file starts from.
        stated: the class or instance, where a script gave it; None elsewhere.
    """

    folder: Path = Path()
    stated: Any = None

    @classmethod
    def of(cls, stated: Any, folder: Path | None = None) -> ModelName:
        """The name of a model.

        Args:
            stated: a text, or a class or an instance. folder: that the path of a file starts from.

        Raises:
            ValueError: it is neither.
        """
        if isinstance(stated, ModelName) and stated.stated is not None:
            return stated
        if isinstance(stated, str):
            name = cls(stated)
        elif _is_model(stated):
            name = cls(_findable(stated))
            name.stated = stated
        else:
            raise ValueError(
                f"expected the name of a model, file.py:Class, or a {EXPECTED.noun} (got a {type(stated).__name__})"
            )
        name.folder = name.folder if folder is None else folder
        return name

    def __deepcopy__(self, memo: Any) -> ModelName:
        return self  # an instance is copied for each run, and not for each copy of a scenario

    def load(self, registry: Mapping[str, Any], kind: str, where: str) -> Any:
        """The class that the name stands for, or the instance that was given.

        Args:
            registry: classes by name. kind: of its members, for messages. where: place for messages.

        Raises:
            ScenarioError: there is no such model, or it cannot be loaded.
        """
        if self.stated is not None:
            return self.stated
        try:
            if str(self) in registry:
                return registry[str(self)]
            if names_code(self):
                return load_class(self, EXPECTED, self.folder)
        except (RegistryError, UserFileError) as error:
            raise ScenarioError(f"{where}: {error}") from error
        raise ScenarioError(
            f"{where}: unknown {kind} {str(self)!r}; {nearest(self, registry)} A class of no registry is named "
            "package.module:Class."
        )


def settings_of(stated: Any) -> dict[str, dict[str, Any]]:
    """What an instance was made with, as keys of a component's table, so that a file can say it too.

    Args:
        stated: an instance; a class, a text or None has no settings.
    """
    if stated is None or isinstance(stated, str | type):
        return {}
    if descends_from(stated, SYSTEM):
        return {"options": dict(stated.options)} if stated.options else {}
    parameters = {s.name: s.start for s in PythonModel(stated, {}, "script").parameter_signals}
    return {"parameters": parameters} if parameters else {}


def _findable(stated: Any) -> str:
    try:
        return name_of(stated)
    except UserFileError:
        return (stated if isinstance(stated, type) else type(stated)).__qualname__


def _validated(stated: Any, info: ValidationInfo) -> ModelName:
    return ModelName.of(stated, (info.context or {}).get("folder"))


Model = Annotated[ModelName, PlainValidator(_validated), PlainSerializer(str, when_used="json")]


def named(model: Any) -> Any:
    """A class or an instance as a name that remembers it; anything else as it is.

    Args:
        model: as a user gives it.
    """
    return model if isinstance(model, str) or not _is_model(model) else ModelName.of(model)

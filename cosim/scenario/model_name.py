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
        given: the class or instance, where a script gave it; None elsewhere.
    """

    folder: Path = Path()
    given: Any = None

    @classmethod
    def of(cls, given: Any, folder: Path | None = None) -> ModelName:
        """The name of a model.

        Args:
            given: a text, or a class or an instance. folder: that the path of a file starts from.

        Raises:
            ValueError: it is neither.
        """
        if isinstance(given, ModelName) and given.given is not None:
            return given
        if isinstance(given, str):
            name = cls(given)
        elif _is_model(given):
            name = cls(_findable(given))
            name.given = given
        else:
            raise ValueError(
                f"expected the name of a model, file.py:Class, or a {EXPECTED.noun} (got a {type(given).__name__})"
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
        if self.given is not None:
            return self.given
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


def settings_of(given: Any) -> dict[str, dict[str, Any]]:
    """What an instance was made with, as keys of a component's table, so that a file can say it too.

    Args:
        given: an instance; a class, a text or None has no settings.
    """
    if given is None or isinstance(given, str | type):
        return {}
    if descends_from(given, SYSTEM):
        return {"options": dict(given.options)} if given.options else {}
    parameters = {s.name: s.start for s in PythonModel(given, {}, "script").parameter_signals}
    return {"parameters": parameters} if parameters else {}


def _findable(given: Any) -> str:
    try:
        return name_of(given)
    except UserFileError:
        return (given if isinstance(given, type) else type(given)).__qualname__


def _validated(given: Any, info: ValidationInfo) -> ModelName:
    return ModelName.of(given, (info.context or {}).get("folder"))


Model = Annotated[ModelName, PlainValidator(_validated), PlainSerializer(str, when_used="json")]


def named(model: Any) -> Any:
    """A class or an instance as a name that remembers it; anything else as it is.

    Args:
        model: as a user gives it.
    """
    return model if isinstance(model, str) or not _is_model(model) else ModelName.of(model)

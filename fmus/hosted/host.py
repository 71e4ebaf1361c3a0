"""The host: inside the importing process, makes the block that a hosted FMU is for, and puts its failures into words.

Used by the copy of `slave.py` in the FMU, and by the build to examine what it packs. Knows the block, not pythonfmu.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from fmpy.fmi1 import FMICallException

import fmu_observer
from fmu_observer.block import make_block
from plant_models.hybrid import HybridSystem
from plant_models.installed import installed_version

OWN_VERSION = "0.1.0"
_MODEL_FOLDER = "model"
"""Folder of the user's own files in ``resources/``."""

_BLOCK_FOLDER = Path(fmu_observer.__file__).parent

CALLS = (
    "instantiate",
    "setupExperiment",
    "enterInitializationMode",
    "exitInitializationMode",
    "doStep",
    "terminate",
    "reset",
    "getReal",
    "setReal",
)
_STATE_CALLS = ("getFMUstate", "setFMUstate", "serializeFMUstate", "deSerializeFMUstate")


class HostError(ValueError):
    """The model cannot be hosted: what is wrong, and what was expected."""


class Host:
    """One instance of the model behind a hosted FMU.

    Args:
        recipe: what hosted.json holds. resources: the FMU's folder of that name. instance_name: for messages.

    Raises:
        HostError: there is no such class, or it makes neither a hybrid system nor a block.
    """

    def __init__(self, recipe: Mapping[str, Any], resources: Path, instance_name: str) -> None:
        _check_package(recipe["package"])
        self.block = make_hosted_block(recipe, resources, instance_name)
        self.block.instantiate()
        module = sys.modules[recipe["module"]]  # an earlier instance may have loaded it, from another copy of the FMU
        self.folder = Path(module.__file__ or resources).parent

    def describe_failure(self, function: str, error: BaseException, t: float | None) -> str:
        """One line: the call, the time, the error, and the function and line of the model where it came from.

        Args:
            t: time at which it happened [s].
        """
        text = str(error)
        if not isinstance(error, FMICallException):  # a block's own refusal names call and time already
            at = "" if t is None else f" at t = {round(t, 9)!r} s"
            text = f"{function}{at}: {type(error).__name__}: {text}"
        place = self._place(error.__cause__ or error)
        return f"{text} ({place})" if place else text

    def _place(self, error: BaseException) -> str:
        """Function, line and file of the last frame that is the model's, or at least not ours."""
        frames = traceback.extract_tb(error.__traceback__)
        own = [f for f in frames if Path(f.filename).is_relative_to(self.folder)]
        own = own or [f for f in frames[-1:] if not Path(f.filename).is_relative_to(_BLOCK_FOLDER)]
        return f"in {own[-1].name}, line {own[-1].lineno} of {Path(own[-1].filename).name}" if own else ""


def package_version() -> str:
    """Version of fmu-observer; where it is not installed but on the path, the version this file belongs to."""
    return installed_version("fmu-observer") or OWN_VERSION


def _check_package(built_with: str) -> None:
    """Refuse an older `fmu-observer` than the FMU was built with.

    Args:
        built_with: version of this package that built the FMU.

    Raises:
        HostError: it is older.
    """
    here = package_version()
    if _numbers(here) < _numbers(built_with):
        raise HostError(
            f"this FMU was built with fmu-observer {built_with}, here is {here}; update it: pip install -U "
            f"fmu-observer."
        )


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".")[:3] if part.isdecimal())


def make_hosted_block(recipe: Mapping[str, Any], resources: Path, instance_name: str | None = None) -> Any:
    """The block that a recipe describes: of a hybrid system, or the user's own object with the calls of a block.

    Args:
        recipe: what hosted.json holds. resources: the folder it lies in. instance_name: for messages.

    Raises:
        HostError: there is no such class, or it makes neither.
    """
    made = _load_factory(recipe, resources)(**recipe["options"])
    if isinstance(made, HybridSystem):
        return make_block(made, 2, preset=recipe["preset"], instance_name=instance_name, **recipe["arguments"])
    what = f"{recipe['class']} makes a {type(made).__name__}, which is no HybridSystem"
    description = getattr(made, "model_description", None)
    missing = [name for name in CALLS if not callable(getattr(made, name, None))]
    if description is None or missing:
        raise HostError(f"{what} and no block either: it lacks {', '.join(missing) or 'model_description'}.")
    if not str(description.fmiVersion).startswith("2"):
        raise HostError(f"{what}; its model_description is for FMI {description.fmiVersion}, expected 2.0.")
    unable = [name for name in _STATE_CALLS if not callable(getattr(made, name, None))]
    if description.coSimulation is None or (description.coSimulation.canGetAndSetFMUstate and unable):
        raise HostError(
            f"{what}; its model_description promises canGetAndSetFMUstate, but it lacks {', '.join(unable)}."
        )
    return made


def _load_factory(recipe: Mapping[str, Any], resources: Path) -> Any:
    """The class or function of a recipe.

    Raises:
        HostError: the module has no such name, or imports something that is not there.
    """
    try:
        module = _load_module(recipe, resources)
    except ModuleNotFoundError as error:
        raise HostError(
            f"{recipe['file'] or recipe['module']} imports {error.name!r}, which is not installed in this Python "
            f"({sys.prefix}); install it there, or give a file of your own as extra_files when the FMU is built."
        ) from error
    factory = getattr(module, recipe["class"], None)
    if not callable(factory):
        raise HostError(f"{recipe['file'] or recipe['module']} has no class or function {recipe['class']!r}.")
    return factory


def _load_module(recipe: Mapping[str, Any], resources: Path) -> ModuleType:
    """An installed module by its name; a loose file under a name of its own, so that two FMUs may both bring a
    model.py.
    """
    if recipe["file"] is None:
        return importlib.import_module(recipe["module"])
    name = recipe["module"]
    if name in sys.modules:
        return sys.modules[name]
    folder = resources / _MODEL_FOLDER
    spec = importlib.util.spec_from_file_location(name, folder / recipe["file"])
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(folder))
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(folder))
    return module

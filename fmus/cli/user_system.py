"""A user's own system: a class in a Python file, named ``path/to/file.py:ClassName``. Runs that file."""

from __future__ import annotations

import sys
import traceback
from importlib.util import module_from_spec, spec_from_file_location
from inspect import isabstract, signature
from pathlib import Path
from types import ModuleType
from typing import Any

from plant_models.hybrid import HybridSystem


class UserSystemError(ValueError):
    """A file or class that gives no hybrid system; the message says what was found and what was expected."""


def names_a_file(name: str) -> bool:
    """Whether a name is meant as ``file.py:ClassName``."""
    return ".py:" in name or name.endswith(".py")


def load_class(name: str) -> type[HybridSystem]:
    """The class that ``path/to/file.py:ClassName`` names; ``:ClassName`` may be left out where the file has only one
    system.

    Args:
        name: of the class.

    Raises:
        UserSystemError: there is no such file or class, the file fails, or the class is no hybrid system.
    """
    text, _, wanted = name.rpartition(".py:") if ".py:" in name else (name[: -len(".py")], "", "")
    path = Path(f"{text}.py")
    if not path.is_file():
        raise UserSystemError(f"{path} does not exist; write path/to/file.py:ClassName.")
    module = _run(path)
    found: dict[str, type[HybridSystem]] = {
        key: value for key, value in vars(module).items() if _is_system_of(value, module)
    }
    if not wanted and len(found) == 1:
        return next(iter(found.values()))
    wanted_class = getattr(module, wanted, None) if wanted else None
    if isinstance(wanted_class, type) and issubclass(wanted_class, HybridSystem):
        return wanted_class
    has = ", ".join(found) or "none"
    raise UserSystemError(
        f"{path} has no subclass of HybridSystem named {wanted!r}; it has: {has}. Write {path}:ClassName."
    )


def make_system(cls: type[HybridSystem], options: dict[str, Any]) -> HybridSystem:
    """An instance of a user's class.

    Raises:
        UserSystemError: the options do not fit, or its construction fails.
    """
    try:
        signature(cls).bind(**options)
    except TypeError as error:
        raise UserSystemError(
            f"{cls.__name__}: {error}; its options are: {', '.join(signature(cls).parameters) or 'none'}."
        ) from error
    try:
        return cls(**options)
    except Exception as error:
        raise UserSystemError(f"{cls.__name__} cannot be made: {error}{_place(error)}") from error


def _run(path: Path) -> ModuleType:
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    kept, flag = list(sys.path), sys.dont_write_bytecode
    sys.path.insert(0, str(path.parent))  # as when Python runs it, so that it may import its neighbours
    sys.dont_write_bytecode = True
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise UserSystemError(f"{path} cannot be run: {type(error).__name__}: {error}{_place(error)}") from error
    finally:
        sys.path[:], sys.dont_write_bytecode = kept, flag
    return module


def _is_system_of(value: object, module: ModuleType) -> bool:
    own = isinstance(value, type) and issubclass(value, HybridSystem) and value.__module__ == module.__name__
    return own and not isabstract(value)


def _place(error: Exception) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""

"""A user's own classes, named ``path/to/file.py:Class`` or ``package.module:Class``. Runs that file or imports that
module.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from importlib import invalidate_caches
from inspect import isabstract, signature
from pathlib import Path
from types import ModuleType
from typing import Any

from plant_models.code_trust import WHY_NOT, is_looking, remember
from plant_models.explained_error import explained
from plant_models.local_files import files_digest, local_files
from plant_models.registry import load, unwritten

_neighbours: dict[str, tuple[ModuleType, str]] = {}
"""Modules that were imported from beside a user's file as it was run, and the digest of what they rest on."""


class UserFileError(ValueError):
    """A name that gives no class as expected; the message says what was found and what was expected."""


class CodeNotRunError(UserFileError):
    """A class of a file or a module is asked for where nothing is run, see `plant_models.code_trust.looking`."""


@dataclass(frozen=True)
class Expected:
    """What a name must stand for.

    Args:
        noun: for people, ``subclass of HybridSystem``. accepts: whether an object is one.
    """

    noun: str
    accepts: Callable[[Any], bool]


def names_a_file(name: str) -> bool:
    """Whether a name is meant as ``file.py:Class``.

    Args:
        name: of a model.
    """
    return ".py:" in name or name.endswith(".py")


def names_code(name: str) -> bool:
    """Whether a name is meant as ``file.py:Class`` or ``package.module:Class``, and not as one of a registry.

    Args:
        name: of a model.
    """
    return ":" in name or names_a_file(name)


def split_name(name: str) -> tuple[str, str]:
    """The path in ``path/to/file.py:Class``, and the class, empty where it is left out.

    Args:
        name: of a model, for which `names_a_file` is true.
    """
    text, colon, wanted = name.rpartition(".py:")
    return (f"{text}.py", wanted) if colon else (name, "")


def option_files(options: Mapping[str, Any]) -> dict[str, str]:
    """The options of a system that name a class in a file, ``cause = "worn.py:Worn"`` say.

    Args:
        options: by name.
    """
    return {key: value for key, value in options.items() if isinstance(value, str) and names_a_file(value)}


def load_class(name: str, expected: Expected, folder: Path | str = ".") -> Any:
    """What ``path/to/file.py:Class`` or ``package.module:Class`` stands for.

    ``:Class`` may be left out where a file has one such class only.

    Args:
        name: of the class. expected: what it must be. folder: that a relative path starts from.

    Raises:
        UserFileError: there is no such file, module or class, it fails while it is run, or the class is something else.
        CodeNotRunError: nothing is run.
    """
    if is_looking():
        raise CodeNotRunError(f"{name} {WHY_NOT}.")
    if not names_a_file(name):
        found = _imported(name)
        if not expected.accepts(found):
            raise UserFileError(f"{name} is {_kind(found)}, no {expected.noun}.")
        return _whole(found, name)
    text, wanted = split_name(name)
    path = Path(folder, text)
    if not path.is_file():
        raise UserFileError(f"{path} does not exist; write path/to/file.py:Class.")
    module = _run(path.resolve())
    own = {k: v for k, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__}
    fitting = [key for key, value in own.items() if expected.accepts(value)]
    if not wanted and len(fitting) == 1:
        return _whole(own[fitting[0]], name)
    found = getattr(module, wanted or "-", None)
    if expected.accepts(found):
        return _whole(found, name)
    others = {wanted: found} if wanted else {key: value for key, value in own.items() if not fitting}
    named = ", ".join(f"{key} is {_kind(value)}" for key, value in others.items() if value is not None)
    what = f" ({named})" if named else ""
    raise UserFileError(
        f"{path} has no {expected.noun}{wanted and f' named {wanted!r}'}{what}; it has: {', '.join(fitting) or 'none'}."
        + (f" Write {path}:Class." if fitting else "")
    )


def _whole(found: Any, name: str) -> Any:
    if unwritten(found):
        raise UserFileError(f"{name} is not complete: it has no {unwritten(found)}; write it.")
    return found


def make(cls: type, options: Mapping[str, Any]) -> Any:
    """An instance of a user's class.

    Args:
        cls: the class. options: arguments by name.

    Raises:
        UserFileError: the options do not fit, or its construction fails.
    """
    try:
        signature(cls).bind(**options)
    except TypeError as error:
        known = ", ".join(signature(cls).parameters) or "none"
        raise UserFileError(f"{cls.__name__}: {error}; its options are: {known}.") from error
    try:
        return cls(**options)
    except Exception as error:
        raise UserFileError(f"{cls.__name__} cannot be made: {explained(error)}") from error


def name_of(model: Any) -> str:
    """The name by which another process finds a class again: ``package.module:Class``, or ``path/to/file.py:Class``
    where the module is a file alone.

    Args:
        model: the class, or an instance of it.

    Raises:
        UserFileError: it stands within a function, or in no file.
    """
    cls = model if isinstance(model, type) else type(model)
    module = sys.modules.get(cls.__module__)
    if module is None or getattr(module, cls.__qualname__, None) is not cls:
        raise UserFileError(f"{cls.__qualname__} cannot be found again; define it at the top level of a file.")
    if "." in module.__name__:
        return f"{module.__name__}:{cls.__qualname__}"
    file = getattr(module, "__file__", None)
    if file is None:
        raise UserFileError(f"{cls.__qualname__} stands in no file; write it into one.")
    return f"{Path(file).resolve()}:{cls.__qualname__}"


def _kind(found: Any) -> str:
    if isinstance(found, type):
        bases = " and ".join(base.__name__ for base in found.__bases__ if base is not object)
        return (
            f"{'an abstract' if isabstract(found) else 'a'} class {f'of base {bases}' if bases else 'without a base'}"
        )
    return f"of type {type(found).__name__}"


def _imported(name: str) -> Any:
    try:
        return load(name)
    except ModuleNotFoundError as error:
        if not f"{name.partition(':')[0]}.".startswith(f"{error.name}."):  # an import in that module
            raise UserFileError(f"{name} cannot be imported: {explained(error)}") from error
        raise UserFileError(f"{name}: no module named {error.name!r}; {_where_it_may_be(name)}.") from error
    except AttributeError as error:
        raise UserFileError(f"{name}: {error}") from error
    except Exception as error:
        raise UserFileError(f"{name} cannot be imported: {explained(error)}") from error


def _where_it_may_be(name: str) -> str:
    """What to do about a module that Python does not find."""
    module, _, cls = name.partition(":")
    file = Path(*module.split(".")).with_suffix(".py")
    if not file.is_file():
        return "write package.module:Class"
    return f"{file} is here, but Python does not search here: set PYTHONPATH=. or install it, or write {file}:{cls}"


def _run(path: Path) -> ModuleType:
    """The module of a file; one that was run before with this very content, of what it imports beside it too, is not
    run again.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserFileError(f"{path} cannot be read: {error.strerror or error}") from error
    name = f"{path.stem}@{sha256(f'{path} {files_digest(path)}'.encode()).hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    _forget_neighbours(local_files(path))
    remember([path, *local_files(path).values()])
    module = sys.modules[name] = ModuleType(name)  # known before it runs, as dataclasses want
    module.__file__ = str(path)
    kept, flag = list(sys.path), sys.dont_write_bytecode
    sys.path.insert(0, str(path.parent))  # as when Python runs it, so that it may import its neighbours
    sys.dont_write_bytecode = True
    try:
        exec(compile(content, path, "exec"), vars(module))
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, Exception | SystemExit):
            raise UserFileError(f"{path} cannot be run: {explained(error, path)}") from error
        raise
    finally:
        sys.path[:], sys.dont_write_bytecode = kept, flag
        for neighbour, file in local_files(path).items():
            if getattr(sys.modules.get(neighbour), "__file__", None) == str(file):
                _neighbours.setdefault(neighbour, (sys.modules[neighbour], files_digest(file)))
    return module


def _forget_neighbours(files: Mapping[str, Path]) -> None:
    """Where a module beside a user's file has changed since it was imported, or is another one of its name, it is
    imported anew.
    """
    invalidate_caches()
    for name, file in files.items():
        module, digest = _neighbours.get(name, (None, ""))
        if module is None or (module.__file__ == str(file) and digest == files_digest(file)):
            continue
        del _neighbours[name]
        if sys.modules.get(name) is module:
            del sys.modules[name]

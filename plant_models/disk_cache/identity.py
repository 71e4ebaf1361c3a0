"""Identity: digests of what a result follows from, without computing anything: values, code, versions.

A system is its class and what its constructor made of the options. A class counts by all files of its package, so no
import has to be followed; a class of another package cannot be known so, and has no identity.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, cached_property, lru_cache, partial
from importlib.util import find_spec
from io import FileIO
from pathlib import Path
from types import FunctionType, MappingProxyType, MethodType, ModuleType
from typing import Any, cast

import numpy as np

from plant_models.disk_cache.files import file_digest
from plant_models.installed import installed_version

OWN_PACKAGES = ("plant_models", "fmu_observer", "fmus", "cosim")
"""The floors of this project: each uses only those before it."""
_NUMERICAL_PACKAGES = ("numpy", "scipy", "casadi")
"""Packages whose classes and functions count by their version."""
_PLAIN = (bool, int, float, complex, str, bytes)
_CONTAINERS = (dict, list, tuple, set, frozenset, MappingProxyType)
_MAX_DEPTH = 50


class _NoIdentityError(ValueError):
    """Something is not known by its content, so what follows from it cannot be kept; the message names it."""


class _Description:
    """Describes values, and gathers on the way the packages of this project whose classes and functions they use.

    Attributes:
        packages: names of these packages.
    """

    def __init__(self) -> None:
        self.packages: set[str] = set()
        self._special: tuple[tuple[Any, Callable[[Any, int], str]], ...] = (
            ((np.ndarray, np.generic), self._array),
            (Path, lambda path, _: f"file {file_digest(path)}"),
            (type, lambda kind, _: f"class {self._class(kind)}"),
            (FunctionType, self._function),
            (MethodType, lambda method, depth: f"method {self.text((method.__func__, method.__self__), depth)}"),
            (ModuleType, lambda module, _: f"module {self._module(module.__name__)}"),
            (partial, lambda call, depth: f"partial {self.text((call.func, call.args, call.keywords), depth)}"),
        )

    def text(self, value: Any, depth: int = 0) -> str:
        """Describe a value.

        Args:
            value: plain data, arrays, paths (by the content of the file), dataclasses and other objects of this
                project (by their attributes), its classes and functions. depth: how deep within another value it is.

        Returns:
            The description.

        Raises:
            NoIdentityError: something in it is not known by its content, such as an object of a user's class.
            OSError: a file cannot be read.
        """
        if value is None or type(value) in _PLAIN:
            return f"{type(value).__name__} {value!r}"
        if depth > _MAX_DEPTH:
            raise _NoIdentityError(f"{type(value).__qualname__} is nested too deep.")
        for kinds, describe in self._special if type(value) not in _CONTAINERS else ():
            if isinstance(value, kinds):
                return describe(value, depth + 1)
        return f"{self._kind(value)} {{{self._content(value, depth + 1)}}}"

    def _array(self, value: Any, depth: int) -> str:
        array = np.asarray(value)
        what = f"{type(value).__name__} {array.dtype.str} {array.shape}"
        if array.dtype.hasobject:
            return f"{what} {self.text(array.tolist(), depth)}"
        return f"{what} {hashlib.sha256(array.tobytes()).hexdigest()}"

    def _kind(self, value: Any) -> str:
        kind = type(value)
        if kind in _CONTAINERS or (kind.__module__ == "casadi.casadi" and hasattr(value, "serialize")):
            return kind.__qualname__
        if _is_numerical(kind.__module__):
            raise _NoIdentityError(f"What a {kind.__qualname__} holds is not known.")
        return self._class(kind)

    def _content(self, value: Any, depth: int) -> str:
        """What an object holds, in its own order."""
        if isinstance(value, Enum):
            return value.name
        if type(value).__module__ == "casadi.casadi" and hasattr(value, "serialize"):
            return str(value.serialize())
        parts: list[str] = []
        if isinstance(value, list | tuple):
            parts = self._texts(value, depth)
        elif isinstance(value, Mapping):
            keys, values = self._texts(value, depth), self._texts(value.values(), depth)
            parts = [f"{key}: {one}" for key, one in zip(keys, values, strict=True)]
        elif isinstance(value, Set):
            parts = sorted(self._texts(value, depth))
        elif not hasattr(value, "__dict__") and not is_dataclass(value):
            raise _NoIdentityError(f"{type(value).__qualname__} cannot be described.")
        names, attributes = _attributes(value)
        if names:
            parts += [f"{name} = {one}" for name, one in zip(names, self._texts(attributes, depth), strict=True)]
        return ", ".join(parts)

    def _texts(self, values: Iterable[Any], depth: int) -> list[str]:
        """`text` of several; most are plain, so those are described without a call."""
        texts = []
        for value in values:
            kind = type(value)
            plain = kind in _PLAIN or value is None
            texts.append(f"{kind.__name__} {value!r}" if plain else self.text(value, depth))
        return texts

    def _function(self, function: FunctionType, depth: int) -> str:
        """A function by its place in the files of this project, with what it holds of the call that made it."""
        if _is_numerical(function.__module__):
            return f"function {function.__module__}.{function.__qualname__}"
        module, code = sys.modules.get(function.__module__), function.__code__
        if code.co_filename != getattr(module, "__file__", ""):
            raise _NoIdentityError(f"{function.__module__}.{function.__qualname__} is not where it says.")
        self._rests_on(function.__module__)
        held = [cell.cell_contents for cell in function.__closure__ or ()]
        place = f"{function.__module__}.{function.__qualname__} {code.co_firstlineno} {code.co_code.hex()}"
        return f"function {place} {self.text((held, function.__defaults__, function.__kwdefaults__), depth)}"

    def _class(self, kind: type) -> str:
        """The name by which anybody finds this very class; its bases are of this project too, or of Python."""
        if _is_numerical(kind.__module__):
            return f"{kind.__module__}.{kind.__qualname__}"
        for base in kind.__mro__:
            if base is kind or base.__module__.partition(".")[0] not in sys.stdlib_module_names:
                self._rests_on(base.__module__)
                found: Any = sys.modules.get(base.__module__)
                for part in base.__qualname__.split("."):
                    found = getattr(found, part, None)
                if found is not base:
                    raise _NoIdentityError(f"{base.__module__}.{base.__qualname__} is not where it says.")
        return f"{kind.__module__}.{kind.__qualname__}"

    def _module(self, name: str) -> str:
        if not _is_numerical(name) and name.partition(".")[0] not in sys.stdlib_module_names:
            self._rests_on(name)
        return name

    def _rests_on(self, module: str) -> None:
        package = module.partition(".")[0]
        if package not in OWN_PACKAGES:
            raise _NoIdentityError(f"{module} is not of this project.")
        self.packages.add(package)


LOADED_AT = time.time()


def identity(*values: Any, code: tuple[str, ...] = ()) -> str | None:
    """Digest of all that a result follows from.

    Args:
        values: what it is computed from, see `plant_models.disk_cache.description.Description.text`. The packages of
            all classes and functions among them count by their files, and so do the floors below.
        code: what else computes the result: a package of this project, with the floors below (``fmus``), or a folder or
            a file alone (``cosim/run/certificates.py``).

    Returns:
        64 hexadecimal digits; None where one of the values is not known by its content, such as a system of a class of
        the user's, or where the code on disk may not be the code that was loaded.
    """
    description = _Description()
    try:
        parts = [description.text(values), _surroundings()]
        parts += [_folder_digest(name) for name in _with_floors_below({"plant_models", *description.packages, *code})]
    except (_NoIdentityError, OSError):
        return None
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _with_floors_below(names: set[str]) -> list[str]:
    highest = max(floor for floor, package in enumerate(OWN_PACKAGES) if package in names)
    return sorted({*names, *OWN_PACKAGES[:highest]})


@cache
def _folder_digest(name: str) -> str:
    """Digest of the files of a package of this project, or of one of its folders or files; read once in a process."""
    package, _, rest = name.partition("/")
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise _NoIdentityError(f"The files of {name} are not on disk.")
    root = Path(next(iter(spec.submodule_search_locations)), rest)
    digest, length = hashlib.sha256(), len(str(root))
    for path in [str(root)] if root.is_file() else _files(str(root)):
        with FileIO(path) as file:
            if os.fstat(file.fileno()).st_mtime > LOADED_AT:
                raise _NoIdentityError(f"{path} was changed after it was loaded.")
            content = file.read()
        digest.update(f"{path[length:]} {len(content)}\0".encode() + content)
    return f"{name} {digest.hexdigest()}"


def _files(folder: str) -> list[str]:
    """All files in a folder and those in it, without byte code, in an order of their own."""
    walk = os.walk(folder)
    return sorted([f"{at}{os.sep}{name}" for at, _, names in walk if "__pycache__" not in at for name in names])


@cache
def _surroundings() -> str:
    """What computes beside this project: Python, the machine, and the numerical packages."""
    versions = [f"{name} {_version(name)}" for name in _NUMERICAL_PACKAGES]
    core = getattr(np, "_core", None)
    processor = getattr(getattr(core, "_multiarray_umath", None), "__cpu_features__", {})  # BLAS chooses its code by it
    features = " ".join(name for name, present in processor.items() if present)
    return "; ".join([sys.version, sys.platform, platform.machine(), features, *versions])


def _version(name: str) -> str:
    version = installed_version(name)
    if version is None:
        raise _NoIdentityError(f"The version of {name} is not known.")
    return version


def _is_numerical(module: str) -> bool:
    return module.partition(".")[0] in _NUMERICAL_PACKAGES


def _attributes(value: Any) -> tuple[tuple[str, ...], Iterable[Any]]:
    """Names and values of the attributes of an object, without those that follow from the others."""
    held, kind = getattr(value, "__dict__", None), cast("type", type(value))
    names = _attribute_names(kind, None if held is None else tuple(held))
    return names, map(partial(getattr, value) if held is None else held.__getitem__, names)


@lru_cache(1024)
def _attribute_names(kind: type, held: tuple[str, ...] | None) -> tuple[str, ...]:
    """Names of the attributes of an object that follow from no others."""
    if held is not None:
        return tuple(name for name in held if not isinstance(getattr(kind, name, None), cached_property))
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()

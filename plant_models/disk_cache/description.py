"""Descriptions: a text for a value, the same for equal values and for no others, and the packages that it rests on."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import FunctionType, MappingProxyType, MethodType, ModuleType
from typing import Any, cast

import numpy as np

from plant_models.disk_cache.files import file_digest

OWN_PACKAGES = ("plant_models", "fmu_observer", "fmus", "cosim")
"""The floors of this project: each uses only those before it."""
NUMERICAL_PACKAGES = ("numpy", "scipy", "casadi")
"""Packages whose classes and functions count by their version."""
PLAIN = (bool, int, float, complex, str, bytes)
CONTAINERS = (dict, list, tuple, set, frozenset, MappingProxyType)
MAX_DEPTH = 50


class NoIdentityError(ValueError):
    """Something is not known by its content, so what follows from it cannot be kept; the message names it."""


class Description:
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
        if value is None or type(value) in PLAIN:
            return f"{type(value).__name__} {value!r}"
        if depth > MAX_DEPTH:
            raise NoIdentityError(f"{type(value).__qualname__} is nested too deep.")
        for kinds, describe in self._special if type(value) not in CONTAINERS else ():
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
        if kind in CONTAINERS or (kind.__module__ == "casadi.casadi" and hasattr(value, "serialize")):
            return kind.__qualname__
        if _is_numerical(kind.__module__):
            raise NoIdentityError(f"What a {kind.__qualname__} holds is not known.")
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
            raise NoIdentityError(f"{type(value).__qualname__} cannot be described.")
        names, attributes = _attributes(value)
        if names:
            parts += [f"{name} = {one}" for name, one in zip(names, self._texts(attributes, depth), strict=True)]
        return ", ".join(parts)

    def _texts(self, values: Iterable[Any], depth: int) -> list[str]:
        """`text` of several; most are plain, so those are described without a call."""
        texts = []
        for value in values:
            kind = type(value)
            plain = kind in PLAIN or value is None
            texts.append(f"{kind.__name__} {value!r}" if plain else self.text(value, depth))
        return texts

    def _function(self, function: FunctionType, depth: int) -> str:
        """A function by its place in the files of this project, with what it holds of the call that made it."""
        if _is_numerical(function.__module__):
            return f"function {function.__module__}.{function.__qualname__}"
        module, code = sys.modules.get(function.__module__), function.__code__
        if code.co_filename != getattr(module, "__file__", ""):
            raise NoIdentityError(f"{function.__module__}.{function.__qualname__} is not where it says.")
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
                    raise NoIdentityError(f"{base.__module__}.{base.__qualname__} is not where it says.")
        return f"{kind.__module__}.{kind.__qualname__}"

    def _module(self, name: str) -> str:
        if not _is_numerical(name) and name.partition(".")[0] not in sys.stdlib_module_names:
            self._rests_on(name)
        return name

    def _rests_on(self, module: str) -> None:
        package = module.partition(".")[0]
        if package not in OWN_PACKAGES:
            raise NoIdentityError(f"{module} is not of this project.")
        self.packages.add(package)


def _is_numerical(module: str) -> bool:
    return module.partition(".")[0] in NUMERICAL_PACKAGES


def _attributes(value: Any) -> tuple[tuple[str, ...], Iterable[Any]]:
    """Names and values of the attributes of an object, without those that follow from the others."""
    held, kind = getattr(value, "__dict__", None), cast("type", type(value))
    names = _attribute_names(kind, None if held is None else tuple(held))
    return names, map(partial(getattr, value) if held is None else held.__getitem__, names)


@lru_cache(1024)
def _attribute_names(kind: type, held: tuple[str, ...] | None) -> tuple[str, ...]:
    """Names of the attributes of an object that follow from no others.

    Args:
        kind: its class. held: the names in its dictionary; None where it has none, as a data class with slots.
    """
    if held is not None:
        return tuple(name for name in held if not isinstance(getattr(kind, name, None), cached_property))
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()

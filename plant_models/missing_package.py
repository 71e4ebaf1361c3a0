"""Packages that are not installed, in words: what needs one, and the command that installs it. Standard library only.

An installation may be without packages that only some users need: the extras, and what the smallest installation that
runs and compares FMUs leaves out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

OWN = "fmu-observer"
_NAME = re.compile(r"[A-Za-z0-9._-]+")


class MissingPackageError(ModuleNotFoundError):
    """A package is not installed; the message says what needs it and how to install it."""


def optional_package(name: str, purpose: str) -> Any:
    """Import a package that an installation may be without.

    Args:
        name: of the module, e.g. ``pyarrow.parquet``. purpose: what needs it, for the message.

    Raises:
        MissingPackageError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        own = isinstance(error, ModuleNotFoundError) and (error.name or package).partition(".")[0] == package
        why = "is not installed" if own else f"cannot be loaded ({error})"
        raise MissingPackageError(
            f"{purpose}: the package {package} {why}; {installation(package)}", name=package
        ) from error


class LazyPackage:
    """A package that is imported when something of it is first used.

    Args:
        name: of the package. purpose: what needs it, for the message where it is not installed.
    """

    def __init__(self, name: str, purpose: str) -> None:
        self._name, self._purpose = name, purpose

    def __getattr__(self, attribute: str) -> Any:
        """What the package has under this name.

        Raises:
            MissingPackageError: it is not installed.
        """
        if attribute.startswith("__"):  # what copies and inspects asks of every object
            raise AttributeError(attribute)
        found = getattr(optional_package(self._name, self._purpose), attribute)
        setattr(self, attribute, found)
        return found


def is_installed(name: str) -> bool:
    """Whether a package can be imported; it is not imported for that.

    Args:
        name: of the package.
    """
    return find_spec(name) is not None


def installation(package: str) -> str:
    """The command that installs a package in a version that serves.

    Args:
        package: its name.
    """
    return f"pip install '{_requirements().get(package.lower(), package)}'"


def missing_package(error: BaseException) -> str:
    """What is not installed and how it is, where an error is about a package of this project's; else an empty text.

    Args:
        error: what was raised.
    """
    if isinstance(error, MissingPackageError):
        return str(error)
    name = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    if name.lower() not in _requirements():
        return ""
    return f"the package {name} is not installed; {installation(name)}"


@cache
def _requirements() -> Mapping[str, str]:
    """What the metadata of this project names, extras included, by name of the package."""
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415 - dear, and seldom needed

    try:
        lines = distribution(OWN).requires or []
    except PackageNotFoundError:  # a clone on the path
        return {}
    stated = [line.partition(";")[0].strip() for line in lines]
    return {match[0].lower(): text for text in stated if (match := _NAME.match(text)) and match[0] != OWN}

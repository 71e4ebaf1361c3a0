"""Packages that only some users need, with words for those who lack one. Touches no file."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from cosim.errors import OutputError


def optional_module(name: str, extra: str, purpose: str) -> Any:
    """Import a package that comes with an extra of ours.

    Args:
        name: of the module, e.g. ``pyarrow.parquet``. extra: of ours that brings it. purpose: what needs it, for the
            message.

    Raises:
        OutputError: it is not installed; the message says what to install.
    """
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise OutputError(
            f"{purpose} need the package {package} ({error}): pip install 'fmu-observer[{extra}]'."
        ) from error


def is_installed(name: str) -> bool:
    """Whether a package can be imported; it is not imported for that.

    Args:
        name: of the package.
    """
    return find_spec(name) is not None

"""Packages that only some users need, with words for those who lack one. Touches no file."""

from __future__ import annotations

from typing import Any

from cosim.errors import OutputError
from plant_models.missing_package import MissingPackageError, optional_package


def optional_module(name: str, purpose: str) -> Any:
    """Import a package that comes with an extra of ours.

    Args:
        name: of the module, e.g. ``pyarrow.parquet``. purpose: what needs it, for the message.

    Raises:
        OutputError: it is not installed; the message says what to install.
    """
    try:
        return optional_package(name, purpose)
    except MissingPackageError as error:
        raise OutputError(str(error)) from error

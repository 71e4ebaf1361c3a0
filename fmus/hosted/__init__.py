"""Python-hosted export: blocks that cannot be traced become FMUs with Python inside, through the library of pythonfmu.

Importing this package costs nothing; `build_hosted_fmu` is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fmus.hosted.hosted_fmu import HostedExportError, build_hosted_fmu

__all__ = ["HostedExportError", "build_hosted_fmu"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module("fmus.hosted.hosted_fmu"), name)
    return value

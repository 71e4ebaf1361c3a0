"""Python-hosted export: blocks that cannot be traced become FMUs with Python inside, through the library of pythonfmu.

Importing this package costs nothing; `build_hosted_fmu` is loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.registry import lazy_imports

if TYPE_CHECKING:
    from fmus.hosted.hosted_fmu import HostedExportError, build_hosted_fmu

__all__ = ["HostedExportError", "build_hosted_fmu"]

__getattr__, __dir__ = lazy_imports(__name__, dict.fromkeys(__all__, "fmus.hosted.hosted_fmu"))

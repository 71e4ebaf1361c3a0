"""How a model or an observer becomes an FMU: tracing, C generation, the C runtime, the model description, packing.

Importing this package costs nothing and needs no compiler: what does the work is loaded when it is first used. It may
use `plant_models` and `fmu_observer`, never `cosim`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_models.registry import lazy_imports

if TYPE_CHECKING:
    from fmus.batch.error import BatchError
    from fmus.batch.members import Batch
    from fmus.build import build_fmu
    from fmus.cache import cached_fmu
    from fmus.content.generate import GenerationError
    from fmus.recipes import RECIPES, UnknownRecipeError, recipe
    from fmus.toolchain.compile import CompilationError, CompilerMissing
    from plant_models.disk_cache.folder import cache_folder

__all__ = [
    "RECIPES",
    "Batch",
    "BatchError",
    "CompilationError",
    "CompilerMissing",
    "GenerationError",
    "UnknownRecipeError",
    "build_fmu",
    "cache_folder",
    "cached_fmu",
    "recipe",
]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "RECIPES": "fmus.recipes",
        "Batch": "fmus.batch.members",
        "BatchError": "fmus.batch.error",
        "CompilationError": "fmus.toolchain.compile",
        "CompilerMissing": "fmus.toolchain.compile",
        "GenerationError": "fmus.content.generate",
        "UnknownRecipeError": "fmus.recipes",
        "build_fmu": "fmus.build",
        "cache_folder": "plant_models.disk_cache.folder",
        "cached_fmu": "fmus.cache",
        "recipe": "fmus.recipes",
    },
)

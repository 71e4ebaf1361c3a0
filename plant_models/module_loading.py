"""Modules that are loaded when they are needed. Standard library only."""

from __future__ import annotations

import gc
from importlib import import_module
from types import ModuleType


def load_module(name: str) -> ModuleType:
    """A module and all that it loads; meanwhile no garbage is looked for, since nearly all of what modules make stays.

    Args:
        name: of the module, with its packages.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        return import_module(name)
    finally:
        if collects:
            gc.enable()

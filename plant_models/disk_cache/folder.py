"""Folders: where built FMUs and the files of the cross compiler are kept. Creates nothing."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """Where cached FMUs lie: ``$FMU_OBSERVER_CACHE``, else the folder the platform keeps for caches."""
    chosen = os.environ.get("FMU_OBSERVER_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "fmu-observer" / "Cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fmu-observer"

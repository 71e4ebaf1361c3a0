"""Tasks for processes of their own: importable there by the name of this module."""

from __future__ import annotations

import os
import signal
from typing import Any


def task(argument: Any) -> Any:
    """Squares a number; ``die``, ``exit``, ``raise`` and ``pickle`` do what they say, or fail to."""
    if argument == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if argument == "exit":
        os._exit(3)
    if argument == "raise":
        raise KeyError("nothing here")
    return (lambda: None) if argument == "pickle" else argument**2


def process_id(_: Any) -> int:
    """Where this runs."""
    return os.getpid()

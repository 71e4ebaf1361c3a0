"""Jobs for processes of their own: importable there by the name of this module."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cosim.runs.job import Job


@dataclass(frozen=True)
class Task(Job):
    """A function of a module with an argument."""

    function: Callable[[Any], Any]
    argument: Any = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        return f"{self.function.__qualname__} {self.argument}"

    def do(self) -> Any:
        return self.function(self.argument)


def square(argument: Any) -> Any:
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


def linger(folder: str) -> None:
    """Leaves a file with the number of its process, and stays for two minutes."""
    Path(folder, str(os.getpid())).touch()
    time.sleep(120.0)

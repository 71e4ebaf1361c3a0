"""Scripts and commands in processes of their own that need not import the packages anew: a server imports them once,
and forks for each.

As a script this file is the server; as a module it is the handle on it. A script finds modules loaded that it does not
import itself, but no name of them: what it uses it must import. That commands start alone, the tests of commands show.
"""

from __future__ import annotations

import atexit
import json
import os
import runpy
import subprocess
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import entry_points
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

LOADED = (
    "casadi",
    "cosim.cli",
    "cosim.drawing.style",
    "cosim.report",
    "cosim.simulation.scenario",
    "fmpy.fmi2",
    "fmpy.fmi3",
    "fmus.batch",
    "fmus.text_table",
    "matplotlib.backends.backend_agg",
    "matplotlib.pyplot",
    "PIL.PngImagePlugin",
    "scipy.integrate",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
)
ROOMS = (("plant_models", "PLANTS"), ("fmu_observer", "OBSERVERS"))


@dataclass(frozen=True)
class Done:
    """What a command left behind: its exit code, all that it wrote, and its processor time [s]."""

    returncode: int
    output: str
    spent: float


Run = Callable[..., Done]
"""Runs a command line to its end; see `Forked.run`."""


class Forked:
    """The handle on a server, begun with the first command.

    Attributes:
        spent: processor time of all commands together [s].
    """

    def __init__(self) -> None:
        self.spent = 0.0
        self._server: subprocess.Popen[str] | None = None

    def run(
        self,
        words: Sequence[str],
        output: Path,
        folder: Path | None = None,
        environment: Mapping[str, str] = os.environ,
    ) -> Done:
        """Run a command to its end.

        Args:
            words: ``python FILE ...``, ``python -c CODE`` or a program that the package installs, with its arguments.
            output: a file for what it writes. folder: where it runs. environment: its variables.
        """
        place = str(folder or Path.cwd())
        return self._asked(
            {"words": [*words], "output": str(output), "folder": place, "environment": dict(environment)}
        )

    def close(self) -> None:
        """End the server."""
        if self._server is not None:
            self._server.communicate()

    def _asked(self, order: Mapping[str, Any]) -> Done:
        if self._server is None:
            command = [sys.executable, __file__]
            self._server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps(order) + "\n")
        self._server.stdin.flush()
        answer = json.loads(self._server.stdout.readline())
        self.spent += answer["spent"]
        written = Path(order["output"]).read_text(encoding="utf-8", errors="replace")
        return Done(answer["returncode"], written, answer["spent"])


def serve() -> None:
    """Load what scripts use, then run one command a line, each in a child."""
    for name in LOADED:
        import_module(name)
    for module, room in ROOMS:
        registry = getattr(import_module(module), room)
        for name in registry:
            registry[name]
    import_module("matplotlib.pyplot").figure().savefig(BytesIO())  # finds its fonts
    import_module("matplotlib.pyplot").close("all")
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            run(json.loads(line))
        _, status, used = os.wait4(child, 0)
        answer = {"returncode": os.waitstatus_to_exitcode(status), "spent": used.ru_utime + used.ru_stime}
        print(json.dumps(answer), flush=True)


def run(order: Mapping[str, Any]) -> None:
    """Be the process of the command, to its end."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    written = os.open(order["output"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(written, stream)
    os.environ.clear()
    os.environ.update(order["environment"])
    os.chdir(order["folder"])
    code = 0
    try:
        obey(order["words"])
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
        code = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def obey(words: Sequence[str]) -> None:
    """Do what a shell would do with these words; a program ends with its exit code."""
    if words[0] != "python":
        (program,) = entry_points(group="console_scripts", name=words[0])
        sys.argv = [*words]
        sys.exit(program.load()())
    if words[1] == "-c":
        sys.argv, sys.path[0] = ["-c"], ""
        main = sys.modules["__main__"] = ModuleType("__main__")
        exec(compile(words[2], "<string>", "exec", dont_inherit=True), main.__dict__)
        return
    sys.argv = [*words[1:]]
    sys.path[0] = str(Path(words[1]).resolve().parent)
    runpy.run_path(words[1], run_name="__main__")


if __name__ == "__main__":
    serve()

"""Scripts in processes of their own that need not import the packages anew: a server imports them once, and forks for
each script.

As a script this file is the server; as a module it is the handle on it. A script finds modules loaded that it does not
import itself, but no name of them: what it uses it must import. That scripts start alone, the tests of imports and of
commands show.
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
from io import BytesIO
from pathlib import Path
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
    """What a script left behind: its exit code, all that it wrote, and its processor time [s]."""

    returncode: int
    output: str
    spent: float


Run = Callable[[Path, Sequence[str]], Done]
"""Runs a script with its arguments to its end."""


class Forked:
    """The handle on a server, begun with the first script."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[str] | None = None

    def run(self, script: Path, arguments: Sequence[str], output: Path) -> Done:
        """Run a script to its end.

        Args:
            script: its path. arguments: what stands behind it on the command line. output: a file for what it writes.
        """
        order = {"script": str(script), "arguments": [*arguments], "output": str(output)}
        return self._asked(order | {"folder": str(Path.cwd()), "environment": dict(os.environ)})

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
        written = Path(order["output"]).read_text(encoding="utf-8", errors="replace")
        return Done(answer["returncode"], written, answer["spent"])


def serve() -> None:
    """Load what scripts use, then run one a line, each in a child."""
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
    """Be the process of the script, to its end."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    written = os.open(order["output"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(written, stream)
    os.environ.clear()
    os.environ.update(order["environment"])
    os.chdir(order["folder"])
    sys.argv = [order["script"], *order["arguments"]]
    sys.path[0] = str(Path(order["script"]).parent)
    code = 0
    try:
        runpy.run_path(order["script"], run_name="__main__")
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


if __name__ == "__main__":
    serve()

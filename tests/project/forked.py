"""Scripts and commands in processes of their own that need not import the packages of others anew: a server imports
them once, and forks for each. The modules of this project each loads itself, which tells what its result follows from.

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
    "fmpy.fmi2",
    "fmpy.fmi3",
    "fmpy.validation",
    "jinja2",
    "matplotlib.backends.backend_agg",
    "matplotlib.pyplot",
    "PIL.PngImagePlugin",
    "scipy.integrate",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
)
ROOT = Path(__file__).parents[2]
LOADED_BY = ".loaded"
"""Behind the name of the file for the output of a command, one for what it loaded."""


@dataclass(frozen=True)
class Done:
    """What a command left behind: its exit code, all that it wrote, its processor time [s], and what it loaded of this
    project: folders of modules, and single files.
    """

    returncode: int
    output: str
    spent: float
    loaded: Sequence[str]


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
        response = json.loads(self._server.stdout.readline())
        self.spent += response["spent"]
        written = Path(order["output"]).read_text(encoding="utf-8", errors="replace")
        loaded = Path(order["output"] + LOADED_BY).read_text(encoding="utf-8").splitlines()
        return Done(response["returncode"], written, response["spent"], loaded)


def serve() -> None:
    """Load what scripts use, then run one command a line, each in a child."""
    for name in LOADED:
        import_module(name)
    import_module("matplotlib.pyplot").figure().savefig(BytesIO())  # finds its fonts
    import_module("matplotlib.pyplot").close("all")
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            run(json.loads(line))
        _, status, used = os.wait4(child, 0)
        response = {"returncode": os.waitstatus_to_exitcode(status), "spent": used.ru_utime + used.ru_stime}
        print(json.dumps(response), flush=True)


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
    Path(order["output"] + LOADED_BY).write_text("\n".join(sorted(loaded())), encoding="utf-8")
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def loaded() -> set[str]:
    """Folders of modules of this project that this process has loaded, and files of it that are in none."""
    files = {Path(module.__file__) for module in [*sys.modules.values()] if getattr(module, "__file__", None)}
    own = {file for file in files if file.is_relative_to(ROOT) and "site-packages" not in file.parts}
    found = {file.parent if (file.parent / "__init__.py").exists() else file for file in own}
    return {path.relative_to(ROOT).as_posix() for path in found}


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

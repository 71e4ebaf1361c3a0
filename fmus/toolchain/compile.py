"""Compilation: C files become the shared library of an FMU, with the system's C compiler or with the cross compiler."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path

import fmpy

from fmus.toolchain.platforms import Platform, host_platform
from plant_models.disk_cache.folder import cache_folder
from plant_models.left_behind import owned

_CANDIDATES = ("cc", "gcc", "clang")

FLAGS = (
    "-std=c11",
    "-O2",  # as fast as -O3 here, where equations are straight lines, and built in two thirds of the time
    "-ffp-contract=off",  # a fused multiply-add would round differently from Python
    "-fno-math-errno",  # nobody reads errno; without it the same exponential is not computed twice
    "-fno-trapping-math",  # nobody traps floating-point exceptions
    "-fvisibility=hidden",
    "-ffunction-sections",
    "-fdata-sections",
    "-g0",
)
"""The same everywhere: the numbers must be those of the Python runtime, bit for bit."""


class CompilerMissing(RuntimeError):  # noqa: N818 - says what is the matter better than with a suffix
    """No C compiler was found; the message says what to install."""


class CompilationError(RuntimeError):
    """The compiler refused the sources; the message carries what it said."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler with the command line of gcc.

    Args:
        command: program and fixed arguments.
        version: what it says about itself, first line.
        flags: further flags that it needs, compiling and linking.
        zig: whether it is the cross compiler.
    """

    command: tuple[str, ...]
    version: str
    flags: tuple[str, ...] = ()
    zig: bool = False

    def identity(self) -> str:
        """All of it that decides the bytes of a library."""
        return " ".join((*self.command, self.version, *FLAGS, *self.flags))


def find_compiler() -> Compiler:
    """The compiler for this machine: ``$CC``, else the first of cc, gcc, clang, else the cross compiler; the flags in
    ``$CFLAGS`` come last.

    Raises:
        CompilerMissing: there is none, or ``$CC`` names one that does not exist.
    """
    wanted, own = os.environ.get("CC", "").strip(), tuple(shlex.split(os.environ.get("CFLAGS", "")))
    if wanted:
        command = tuple(shlex.split(wanted))
        if shutil.which(command[0]) is None:
            raise CompilerMissing(
                f"The environment variable CC names the compiler {wanted!r}, which does not exist. {_advice()}"
            )
        return _identified(command, own)
    for candidate in _CANDIDATES:
        found = shutil.which(candidate)
        if found is not None:
            return _identified((found,), own)
    if _zig_is_installed() and host_platform().target is not None:
        return cross_compiler(host_platform())
    raise CompilerMissing(f"No C compiler was found (looked for {', '.join(_CANDIDATES)}). {_advice()}")


def cross_compiler(platform: Platform) -> Compiler:
    """The compiler of the package ``ziglang`` for a platform.

    Raises:
        CompilerMissing: the package is not installed, or it cannot build for the platform.
    """
    if platform.target is None:
        raise CompilerMissing(f"Libraries for {platform.name} can be built on such a machine only.")
    if not _zig_is_installed():
        raise CompilerMissing(
            f"Building for {platform.name} needs the package ziglang, which the extra 'cross' brings: {_EXTRA}. "
            "Without it, --platform host builds for this machine with the system's compiler."
        )
    return Compiler(
        (sys.executable, "-m", "ziglang", "cc", "-target", platform.target),
        _zig_version(),
        (*_ZIG_FLAGS, *_LINK_FLAGS[platform.system]),
        zig=True,
    )


def compile_library(compiler: Compiler, folder: Path, sources: Sequence[str], library: str) -> Path:
    """Compile C files into one shared library.

    Args:
        compiler: see `find_compiler` and `cross_compiler`.
        folder: where the sources lie and the library goes; names are given relative to it, so that no path of this
            machine gets into the library. Headers of FMI are taken from there, else from fmpy.
        sources: names of the C files.
        library: file name of the library.

    Returns:
        Path of the library.

    Raises:
        CompilationError: the compiler refused.
    """
    run_compiler(compiler, folder, [*FLAGS, *compiler.flags, f"-I{header_folder()}", *sources, "-o", library, "-lm"])
    return folder / library


def compile_program(compiler: Compiler, folder: Path, sources: Sequence[str], program: str) -> Path:
    """Compile C files into a program for this machine.

    Args:
        compiler: see `find_compiler`. folder: where the sources lie and the program goes. sources: names of the C
            files. program: file name of the program.

    Returns:
        Path of the program.

    Raises:
        CompilationError: the compiler refused.
    """
    flags = [flag for flag in compiler.flags if flag != "-shared"]
    run_compiler(compiler, folder, [*FLAGS, *flags, *sources, "-o", program, "-lpthread", "-ldl"])
    return folder / program


def run_compiler(compiler: Compiler, folder: Path, words: Sequence[str]) -> None:
    """Run a compiler once.

    Args:
        compiler: see `find_compiler` and `cross_compiler`. folder: in which it works. words: the rest of its command.

    Raises:
        CompilationError: it refused.
    """
    command = [*compiler.command, *words]
    with tempfile.TemporaryDirectory(prefix=owned("fmus-scratch-")) as scratch:
        environment = _zig_environment(Path(scratch)) if compiler.zig else None
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False, env=environment
        )
    if done.returncode != 0:
        raise CompilationError(
            f"{shlex.join(command)} failed with code {done.returncode}:\n{done.stderr.strip() or done.stdout.strip()}"
        )


def header_folder() -> Path:
    """The folder with the headers of the FMI standard that fmpy carries."""
    return Path(fmpy.__file__).parent / "c-code"


def library_name(identifier: str) -> str:
    """File name of the shared library of a model on this platform.

    Args:
        identifier: modelIdentifier of the FMU.
    """
    return identifier + host_platform().extension


def _system_flags() -> tuple[str, ...]:
    if sys.platform == "win32":
        return ("-shared", "-static-libgcc", "-Wl,--no-insert-timestamp", "-s")
    if sys.platform == "darwin":
        return ("-shared", "-fPIC", "-Wl,-dead_strip", "-Wl,-x")
    return ("-shared", "-fPIC", "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,--no-undefined", "-s")


def _advice() -> str:
    bring = f"install the one that the extra 'cross' brings ({_EXTRA}), or set CC to yours."
    if sys.platform == "win32":
        return f"Install one, e.g. 'winget install BrechtSanders.WinLibs.POSIX.UCRT' (gcc) or LLVM (clang), {bring}"
    if sys.platform == "darwin":
        return f"Install one with 'xcode-select --install', {bring}"
    return f"Install one, e.g. 'sudo apt install gcc' (Debian, Ubuntu) or 'sudo dnf install gcc' (Fedora), {bring}"


@lru_cache(maxsize=8)
def _identified(command: tuple[str, ...], own: tuple[str, ...]) -> Compiler:
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, errors="replace", check=False)
    lines = (done.stdout or done.stderr).splitlines()
    return Compiler(command, lines[0].strip() if lines else "unknown", (*_system_flags(), *own))


# -- the cross compiler: ``zig cc`` of the package ``ziglang``, which builds for any platform on any machine ----------


_EXTRA = "pip install 'fmu-observer[cross]'"

_ZIG_FLAGS = (
    "-fno-sanitize=all",  # zig adds checks of undefined behaviour, which would stop the importer's process
    "-fno-stack-protector",
    "-fno-lto",
)
"""What `zig cc` would else add of its own."""

_LINK_FLAGS = {
    "linux": ("-shared", "-fPIC", "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,--no-undefined", "-s"),
    "windows": ("-shared", "-s"),
    "darwin": ("-shared", "-fPIC", "-Wl,-dead_strip", "-Wl,-x"),
}
"""By system. The time stamp of a DLL is a digest of its content, and aarch64 libraries for macOS are signed: zig does
both.
"""


def _zig_is_installed() -> bool:
    """Whether the package ``ziglang`` can be found."""
    return find_spec("ziglang") is not None


@cache
def _zig_version() -> str:
    """What it says about itself, e.g. ``zig 0.15.1``."""
    done = subprocess.run([sys.executable, "-m", "ziglang", "version"], capture_output=True, text=True, check=False)
    return f"zig {done.stdout.strip() or 'unknown'}"


def _zig_environment(scratch: Path) -> dict[str, str]:
    """The environment it runs in: its caches never lie in the user's working folder.

    The C library of each target is compiled once and kept in the user's cache, or in ``$ZIG_GLOBAL_CACHE_DIR``.

    Args:
        scratch: a temporary folder for what belongs to one build.
    """
    environment = dict(os.environ)
    environment.setdefault("ZIG_GLOBAL_CACHE_DIR", str(_kept(scratch)))
    return environment | {"ZIG_LOCAL_CACHE_DIR": str(scratch / "zig-local")}


def _kept(scratch: Path) -> Path:
    folder = cache_folder() / "zig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return scratch / "zig-global"
    return folder if os.access(folder, os.W_OK) else scratch / "zig-global"

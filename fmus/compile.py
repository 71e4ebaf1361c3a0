"""Compilation: C files become the shared library of an FMU, with the system's C compiler."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import fmpy

CANDIDATES = ("cc", "gcc", "clang")

FLAGS = (
    "-std=c11",
    "-O2",
    "-ffp-contract=off",  # a fused multiply-add would round differently from Python
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
    """

    command: tuple[str, ...]
    version: str


def find_compiler() -> Compiler:
    """The system's C compiler: ``$CC``, else the first of cc, gcc, clang.

    Raises:
        CompilerMissing: there is none, or ``$CC`` names one that does not exist.
    """
    wanted = os.environ.get("CC", "").strip()
    if wanted:
        command = tuple(shlex.split(wanted))
        if shutil.which(command[0]) is None:
            raise CompilerMissing(f"The environment variable CC names the compiler {wanted!r}, which does not exist. {_advice()}")
        return _identified(command)
    for candidate in CANDIDATES:
        found = shutil.which(candidate)
        if found is not None:
            return _identified((found,))
    raise CompilerMissing(f"No C compiler was found (looked for {', '.join(CANDIDATES)}). {_advice()}")


def compile_library(compiler: Compiler, folder: Path, sources: Sequence[str], library: str) -> Path:
    """Compile C files into one shared library.

    Args:
        compiler: see `find_compiler`.
        folder: where the sources lie and the library goes; names are given relative to it, so that no path of this
            machine gets into the library.
        sources: names of the C files.
        library: file name of the library.

    Returns:
        Path of the library.

    Raises:
        CompilationError: the compiler refused.
    """
    command = [*compiler.command, *FLAGS, *_platform_flags(), f"-I{header_folder()}", *sources, "-o", library, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CompilationError(
            f"{shlex.join(command)} failed with code {done.returncode}:\n{done.stderr.strip() or done.stdout.strip()}"
        )
    return folder / library


def header_folder() -> Path:
    """The folder with the headers of the FMI standard that fmpy carries."""
    return Path(fmpy.__file__).parent / "c-code"


def library_name(identifier: str) -> str:
    """File name of the shared library of a model on this platform."""
    return identifier + str(fmpy.sharedLibraryExtension)


def binaries_folder(fmi_version: int) -> str:
    """Folder of this platform's library inside an FMU."""
    return f"binaries/{fmpy.platform if fmi_version == 2 else fmpy.platform_tuple}"


def _platform_flags() -> list[str]:
    if sys.platform == "win32":
        return ["-shared", "-static-libgcc", "-Wl,--no-insert-timestamp", "-s"]
    if sys.platform == "darwin":
        return ["-shared", "-fPIC", "-Wl,-dead_strip", "-Wl,-x"]
    return ["-shared", "-fPIC", "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,--no-undefined", "-s"]


def _advice() -> str:
    if sys.platform == "win32":
        return "Install one, e.g. 'winget install BrechtSanders.WinLibs.POSIX.UCRT' (gcc) or LLVM (clang), or set CC to yours."
    if sys.platform == "darwin":
        return "Install one with 'xcode-select --install', or set CC to yours."
    return "Install one, e.g. 'sudo apt install gcc' (Debian, Ubuntu) or 'sudo dnf install gcc' (Fedora), or set CC to yours."


@lru_cache(maxsize=8)
def _identified(command: tuple[str, ...]) -> Compiler:
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    lines = (done.stdout or done.stderr).splitlines()
    return Compiler(command, lines[0].strip() if lines else "unknown")

"""The cross compiler: ``zig cc`` of the package ``ziglang``, which builds for any platform on any machine.

Says how it is called; runs nothing but the question for its version.
"""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from plant_models.disk_cache.folder import cache_folder

EXTRA = "pip install 'fmu-observer[cross]'"

ZIG_FLAGS = (
    "-fno-sanitize=all",  # zig adds checks of undefined behaviour, which would stop the importer's process
    "-fno-stack-protector",
    "-fno-lto",
)
"""What `zig cc` would else add of its own."""

LINK_FLAGS = {
    "linux": ("-shared", "-fPIC", "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,--no-undefined", "-s"),
    "windows": ("-shared", "-s"),
    "darwin": ("-shared", "-fPIC", "-Wl,-dead_strip", "-Wl,-x"),
}
"""By system. The time stamp of a DLL is a digest of its content, and aarch64 libraries for macOS are signed: zig does
both.
"""


def zig_is_installed() -> bool:
    """Whether the package ``ziglang`` can be found."""
    return find_spec("ziglang") is not None


def zig_command(target: str) -> tuple[str, ...]:
    """Program and fixed arguments of the compiler for a target, e.g. ``x86_64-linux-gnu.2.17``."""
    return (sys.executable, "-m", "ziglang", "cc", "-target", target)


@cache
def zig_version() -> str:
    """What it says about itself, e.g. ``zig 0.15.1``."""
    done = subprocess.run([sys.executable, "-m", "ziglang", "version"], capture_output=True, text=True, check=False)
    return f"zig {done.stdout.strip() or 'unknown'}"


def zig_environment(scratch: Path) -> dict[str, str]:
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

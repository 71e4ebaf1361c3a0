"""Platforms: where an FMU can run, what FMI 2.0 and FMI 3.0 call that, and which library lies in which folder.

Knows no compiler. A library is bytes here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import fmpy

from fmus.toolchain.fat import fat_binary


class PlatformError(ValueError):
    """A platform that does not exist; the message names those that do."""


@dataclass(frozen=True)
class Platform:
    """One processor architecture and operating system.

    Args:
        name: platform tuple of FMI 3.0, e.g. ``x86_64-linux``.
        fmi2_folder: name of the 64-bit (or 32-bit) system in FMI 2.0, e.g. ``linux64``.
        extension: of shared libraries.
        target: its name for ``zig cc``; None where libraries for it cannot be built on another platform.
        needs: what a library built for `target` asks of the machine, for the user.
    """

    name: str
    fmi2_folder: str
    extension: str
    target: str | None = None
    needs: str = ""

    @property
    def system(self) -> str:
        """``linux``, ``windows`` or ``darwin``."""
        return self.name.partition("-")[2]


PLATFORMS: dict[str, Platform] = {
    platform.name: platform
    for platform in (
        Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17", "glibc 2.17 (2012) or later"),
        Platform("aarch64-linux", "linux64", ".so", "aarch64-linux-gnu.2.17", "glibc 2.17 (2012) or later"),
        Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu", "Windows 10 or later"),
        Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos.11.0", "macOS 11 or later"),
        Platform("aarch64-darwin", "darwin64", ".dylib", "aarch64-macos.11.0", "macOS 11 or later"),
    )
}
"""All that can be built on any machine with the extra ``cross``, by platform tuple."""

_ALIASES = {
    "linux64": ("x86_64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
    "all": tuple(PLATFORMS),
}
"""The names of FMI 2.0, and all."""

HOST = "host"


def host_platform() -> Platform:
    """The platform of this machine."""
    name = str(fmpy.platform_tuple)
    return PLATFORMS.get(name) or Platform(name, str(fmpy.platform), str(fmpy.sharedLibraryExtension))


def platform_names(wanted: str | Sequence[str]) -> tuple[str, ...]:
    """Platform tuples, and ``host``, without repetitions.

    Args:
        wanted: names separated by commas, or a sequence of names: ``host``, ``all``, platform tuples of FMI 3.0
            (``x86_64-linux``) or names of FMI 2.0 (``linux64``).

    Raises:
        PlatformError: a name is unknown, or there is none.
    """
    words = [word.strip() for word in (wanted.split(",") if isinstance(wanted, str) else wanted)]
    names: list[str] = []
    for word in filter(None, words):
        if word not in (HOST, *_ALIASES, *PLATFORMS):
            raise PlatformError(f"Platform {word!r} is unknown{_nearest(word)}; use {_all_names()}.")
        names += _ALIASES.get(word, (word,))
    if not names:
        raise PlatformError(f"No platform was given; use {_all_names()}.")
    return tuple(dict.fromkeys(names))


def binary_files(fmi_version: int, identifier: str, libraries: Mapping[Platform, bytes]) -> dict[str, bytes]:
    """The files under ``binaries/`` of an FMU.

    FMI 3.0 has one folder for each platform tuple. FMI 2.0 has ``linux64``, ``win64`` and ``darwin64`` for x86-64, and
    platform tuples for the rest; but many importers search ``linux64`` and ``darwin64`` on any processor. So
    ``darwin64`` holds both architectures in one file, and ``linux64`` holds that of aarch64 where there is none of
    x86-64.

    Args:
        fmi_version: 2 or 3.
        identifier: model identifier; the name of the library.
        libraries: shared library by platform.

    Returns:
        Content by name inside the FMU.
    """
    names = {platform: f"{identifier}{platform.extension}" for platform in libraries}
    tuples = {f"binaries/{p.name}/{names[p]}": library for p, library in libraries.items()}
    if fmi_version == 3:
        return tuples
    files = {name: library for name, library in tuples.items() if name.startswith("binaries/aarch64-")}
    for folder in {p.fmi2_folder for p in libraries}:
        here = [p for p in libraries if p.fmi2_folder == folder]
        files[f"binaries/{folder}/{names[here[0]]}"] = _for_any_processor(here, libraries)
    return files


def _for_any_processor(here: Sequence[Platform], libraries: Mapping[Platform, bytes]) -> bytes:
    first, *others = sorted(here, key=lambda p: not p.name.startswith("x86_64-"))
    if others and first.system == "darwin":
        return fat_binary([libraries[p] for p in (first, *others)])
    return libraries[first]


def _all_names() -> str:
    return f"{HOST}, {', '.join([*PLATFORMS, *_ALIASES])}"


def _nearest(name: str) -> str:
    matches = get_close_matches(name, [HOST, *_ALIASES, *PLATFORMS], n=1, cutoff=0.5)
    return f" (did you mean {matches[0]!r}?)" if matches else ""

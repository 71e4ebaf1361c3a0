"""Shared libraries: two FMUs that bring different libraries of one name would share one of them, and compute with the
wrong one.

The dynamic linker knows a library that another one needs by its name alone (its soname): where one of that name is
loaded, whatever the folder, it is taken. So whoever comes second is refused. Libraries of the same bytes are shared, as
the instances of one FMU share theirs; those of the system are left to the system. Linux with ELF; elsewhere nothing is
looked at.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import struct
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import FmuLoadError

_LINK_MAP = 2  # dlinfo: RTLD_DI_LINKMAP
_brought: dict[str, tuple[Path, str]] = {}
"""For every library that an FMU brought into this process, by its path: the FMU, and the digest of the library."""


MAGIC = b"\x7fELF"
_DYNAMIC, LOAD = 2, 1  # types of segments
END, _NEEDED, _STRINGS, _SONAME = 0, 1, 5, 14  # entries of the dynamic section


@dataclass(frozen=True)
class _Linkage:
    """What the dynamic linker goes by.

    Args:
        soname: of the library itself, empty where it has none. needed: of the libraries it asks for.
    """

    soname: str = ""
    needed: tuple[str, ...] = ()


def _read_linkage(path: Path) -> _Linkage | None:
    """The linkage of a 64-bit little-endian ELF file; None of any other file, and of a damaged one."""
    try:
        content = path.read_bytes()
        return _linkage(content) if content[:6] == MAGIC + b"\x02\x01" else None
    except (OSError, struct.error, ValueError):
        return None


def _linkage(content: bytes) -> _Linkage:
    start, size, count = struct.unpack_from("<32xQ14x2H", content)  # e_phoff, e_phentsize, e_phnum
    segments = [struct.unpack_from("<2I4Q", content, start + k * size) for k in range(count)]
    entries = [
        struct.unpack_from("<2Q", content, offset + at)
        for kind, _, offset, _, _, length in segments
        if kind == _DYNAMIC
        for at in range(0, length, 16)
    ]
    entries = entries[: next((k for k, (tag, _) in enumerate(entries) if tag == END), len(entries))]
    address = next((value for tag, value in entries if tag == _STRINGS), 0)
    loads = [(begin, offset, length) for kind, _, offset, begin, _, length in segments if kind == LOAD]
    strings = next(
        (offset + address - begin for begin, offset, length in loads if begin <= address < begin + length), 0
    )

    def text(value: int) -> str:
        return content[strings + value : content.index(b"\0", strings + value)].decode("utf-8", "replace")

    soname = next((text(value) for tag, value in entries if tag == _SONAME), "")
    return _Linkage(soname, tuple(text(value) for tag, value in entries if tag == _NEEDED))


class _LinkMap(ctypes.Structure):
    _fields_ = (("address", ctypes.c_void_p), ("name", ctypes.c_char_p))


def refuse_foreign_libraries(library: Path, fmu: Path, name: str) -> None:
    """Make sure that what an FMU brings for itself is what it would get.

    Args:
        library: the FMU's own library, unpacked and not loaded yet. fmu: the file, name: of the component, for the
            message.

    Raises:
        FmuLoadError: another FMU has brought another library of the same name into this process.
    """
    if sys.platform != "linux":
        return
    for soname, path in _own_needs(library).items():
        loaded = _loaded(soname)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if loaded is None or loaded not in _brought:
            _brought[str(path)] = fmu, digest
            continue
        other, its_digest = _brought[loaded]
        if its_digest != digest:
            raise FmuLoadError(
                f"{name}: {fmu} and {other} each bring a library {soname}, and these differ; in one process both would "
                f"use that "
                f"of {other.name}, and one of them compute wrong numbers. Have one of them built with the library "
                f"linked into it "
                "(static), or under another name; or run the FMUs in programs of their own."
            )


def _own_needs(library: Path) -> dict[str, Path]:
    """The libraries that one needs, directly or not, and that lie in the FMU itself: by the name they are asked for."""
    folder = library.parent
    if not library.is_file():
        return {}  # which loading it will say
    files = {path.name: path for path in folder.iterdir() if path.is_file() and path != library}
    files |= {
        linkage.soname: path
        for path in files.values()
        if (linkage := _read_linkage(path)) is not None and linkage.soname
    }
    found: dict[str, Path] = {}
    waiting = [library]
    while waiting:
        linkage = _read_linkage(waiting.pop())
        for needed in () if linkage is None else linkage.needed:
            if needed in files and needed not in found:
                found[needed] = files[needed]
                waiting.append(files[needed])
    return found


def _loaded(soname: str) -> str | None:
    """Path of the library of this name that is in the process; None where there is none."""
    import _ctypes  # noqa: PLC0415 - where ctypes itself opens libraries

    with suppress(OSError, AttributeError):
        handle = _ctypes.dlopen(soname, os.RTLD_LAZY | os.RTLD_NOLOAD)
        try:
            found = ctypes.POINTER(_LinkMap)()
            if ctypes.CDLL(None).dlinfo(ctypes.c_void_p(handle), _LINK_MAP, ctypes.byref(found)) == 0:
                return os.fsdecode(found.contents.name or b"")
        finally:
            _ctypes.dlclose(handle)
    return None

"""ELF: the name of a shared library and the libraries it needs, read from the file. Standard library only."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

MAGIC = b"\x7fELF"
DYNAMIC, LOAD = 2, 1  # types of segments
END, NEEDED, STRINGS, SONAME = 0, 1, 5, 14  # entries of the dynamic section


@dataclass(frozen=True)
class Linkage:
    """What the dynamic linker goes by.

    Args:
        soname: of the library itself, empty where it has none. needed: of the libraries it asks for.
    """

    soname: str = ""
    needed: tuple[str, ...] = ()


def read_linkage(path: Path) -> Linkage | None:
    """The linkage of a 64-bit little-endian ELF file; None of any other file, and of a damaged one.

    Args:
        path: of the file.
    """
    try:
        content = path.read_bytes()
        return _linkage(content) if content[:6] == MAGIC + b"\x02\x01" else None
    except (OSError, struct.error, ValueError):
        return None


def _linkage(content: bytes) -> Linkage:
    start, size, count = struct.unpack_from("<32xQ14x2H", content)  # e_phoff, e_phentsize, e_phnum
    segments = [struct.unpack_from("<2I4Q", content, start + k * size) for k in range(count)]
    entries = [
        struct.unpack_from("<2Q", content, offset + at)
        for kind, _, offset, _, _, length in segments
        if kind == DYNAMIC
        for at in range(0, length, 16)
    ]
    entries = entries[: next((k for k, (tag, _) in enumerate(entries) if tag == END), len(entries))]
    address = next((value for tag, value in entries if tag == STRINGS), 0)
    loads = [(begin, offset, length) for kind, _, offset, begin, _, length in segments if kind == LOAD]
    strings = next(
        (offset + address - begin for begin, offset, length in loads if begin <= address < begin + length), 0
    )

    def text(value: int) -> str:
        return content[strings + value : content.index(b"\0", strings + value)].decode("utf-8", "replace")

    soname = next((text(value) for tag, value in entries if tag == SONAME), "")
    return Linkage(soname, tuple(text(value) for tag, value in entries if tag == NEEDED))

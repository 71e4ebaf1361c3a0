"""Fat Mach-O: several libraries for macOS, one for each processor, in one file. Bytes in, bytes out."""

from __future__ import annotations

import struct
from collections.abc import Sequence

_FAT_MAGIC = 0xCAFEBABE
_MACH_O_64 = 0xFEEDFACF
_ALIGNMENT = 14
"""Of each slice, as a power of two: the page size of macOS on aarch64, and enough for x86-64."""


def fat_binary(slices: Sequence[bytes]) -> bytes:
    """One file of several 64-bit Mach-O libraries.

    The header is big-endian: a magic number, the number of slices, and for each its processor, subtype, offset, size
    and alignment; see ``mach-o/fat.h`` of Apple's SDK.

    Args:
        slices: thin libraries, each for another processor.

    Raises:
        ValueError: one of them is not a 64-bit Mach-O file, or two are for the same processor.
    """
    processors = [_processor(piece) for piece in slices]
    if len(set(processors)) != len(processors):
        raise ValueError("Two slices of a fat Mach-O file are for the same processor.")
    header = struct.pack(">II", _FAT_MAGIC, len(slices))
    offset, body, start = 0, b"", len(header) + 20 * len(slices)
    for piece, (kind, subtype) in zip(slices, processors, strict=True):
        offset = _aligned(start + len(body))
        body += b"\0" * (offset - start - len(body)) + piece
        header += struct.pack(">IIIII", kind, subtype, offset, len(piece), _ALIGNMENT)
    return header + body


def _processor(library: bytes) -> tuple[int, int]:
    magic, kind, subtype = struct.unpack_from("<III", library) if len(library) >= 12 else (0, 0, 0)
    if magic != _MACH_O_64:
        raise ValueError("A slice of a fat Mach-O file is not a 64-bit Mach-O library.")
    return kind, subtype


def _aligned(position: int) -> int:
    return -(-position >> _ALIGNMENT) << _ALIGNMENT

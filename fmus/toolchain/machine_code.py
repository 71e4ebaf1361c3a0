"""Machine code: for which processor and system a shared library was built, from its first bytes. Loads nothing."""

from __future__ import annotations

import struct

_ELF_MACHINES = {3: "x86-linux", 62: "x86_64-linux", 183: "aarch64-linux", 40: "aarch32-linux", 243: "riscv64-linux"}
_PE_MACHINES = {0x14C: "x86-windows", 0x8664: "x86_64-windows", 0xAA64: "aarch64-windows"}
_MACH_O_MACHINES = {7: "x86-darwin", 0x01000007: "x86_64-darwin", 0x0100000C: "aarch64-darwin"}
UNKNOWN = "unknown"


def platforms_of_library(library: bytes) -> tuple[str, ...]:
    """Platform tuples a library was built for: one, or several for a fat Mach-O; ``unknown`` where it is none of these.

    Args:
        library: its content, or at least the first few kilobytes.
    """
    try:
        return _platforms(library)
    except struct.error:  # cut off
        return (UNKNOWN,)


def _platforms(library: bytes) -> tuple[str, ...]:
    magic = library[:4]
    if magic == b"\x7fELF":
        order = ">" if library[5:6] == b"\x02" else "<"
        return (_ELF_MACHINES.get(struct.unpack_from(f"{order}H", library, 18)[0], UNKNOWN),)
    if magic[:2] == b"MZ":
        (header,) = struct.unpack_from("<I", library, 0x3C)
        signature, machine = struct.unpack_from("<4sH", library, header)
        return (_PE_MACHINES.get(machine, UNKNOWN) if signature == b"PE\0\0" else UNKNOWN,)
    if magic in (b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"):
        return (_mach_o(struct.unpack_from("<I", library, 4)[0]),)
    if magic == b"\xca\xfe\xba\xbe":
        (count,) = struct.unpack_from(">I", library, 4)
        return tuple(_mach_o(struct.unpack_from(">I", library, 8 + 20 * i)[0]) for i in range(min(count, 16)))
    return (UNKNOWN,)


def _mach_o(processor: int) -> str:
    return _MACH_O_MACHINES.get(processor, UNKNOWN)

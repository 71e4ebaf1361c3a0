"""Platforms without a compiler: their names, their folders in both FMI versions, fat libraries, whose library a file
is.
"""

from __future__ import annotations

import struct
import sys

import fmpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.toolchain.compile import CompilerMissing
from fmus.toolchain.fat import fat_binary
from fmus.toolchain.machine_code import platforms_of_library
from fmus.toolchain.platforms import PLATFORMS, PlatformError, binary_files, host_platform, platform_names
from fmus.toolchain.targets import choose_targets

FIVE = ("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")


def mach_o(processor: int, size: int) -> bytes:
    """The head of a 64-bit Mach-O library, filled up."""
    return struct.pack("<IIII", 0xFEEDFACF, processor, 3, 6) + bytes(range(256)) * (size // 256)


X86_64, AARCH64 = mach_o(0x01000007, 5000), mach_o(0x0100000C, 40000)
LIBRARIES = {
    PLATFORMS[name]: content for name, content in zip(FIVE, (b"lx", b"la", b"w", X86_64, AARCH64), strict=True)
}


# -- names ----------------------------------------------------------------------------------------------------------


def test_names() -> None:
    assert tuple(PLATFORMS) == FIVE
    assert platform_names("all") == FIVE
    assert platform_names("host") == ("host",)
    assert platform_names("win64, linux64") == ("x86_64-windows", "x86_64-linux")
    assert platform_names("darwin64,aarch64-darwin,host") == ("x86_64-darwin", "aarch64-darwin", "host")
    assert platform_names(["host", "all"]) == ("host", *FIVE)


@given(st.lists(st.sampled_from(["host", "all", "linux64", "win64", "darwin64", *FIVE]), min_size=1, max_size=6))
def test_names_are_equal_however_they_are_written(words: list[str]) -> None:
    names = platform_names(words)
    assert names == platform_names(",".join(words)) == platform_names(names)
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ("win46", "did you mean 'win64'"),
        ("host,beos", "'beos' is unknown"),
        ("", "No platform"),
        (" , ", "No platform"),
        ([], "host"),
    ],
)
def test_unknown_platforms_are_refused(wanted: str, words: str) -> None:
    with pytest.raises(PlatformError, match=words) as refused:
        choose_targets(wanted)
    assert all(name in str(refused.value) for name in FIVE)


def test_this_machine_is_the_one_that_fmpy_sees() -> None:
    host = host_platform()
    assert (host.name, host.fmi2_folder, host.extension) == (
        fmpy.platform_tuple,
        fmpy.platform,
        fmpy.sharedLibraryExtension,
    )


def test_without_ziglang_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(CompilerMissing, match=r"pip install 'fmu-observer\[cross\]'"):
        choose_targets("x86_64-windows")


# -- folders --------------------------------------------------------------------------------------------------------


def test_folders_of_fmi_3() -> None:
    assert binary_files(3, "m", LIBRARIES) == {
        "binaries/x86_64-linux/m.so": b"lx",
        "binaries/aarch64-linux/m.so": b"la",
        "binaries/x86_64-windows/m.dll": b"w",
        "binaries/x86_64-darwin/m.dylib": X86_64,
        "binaries/aarch64-darwin/m.dylib": AARCH64,
    }


def test_folders_of_fmi_2() -> None:
    """``linux64``, ``win64``, ``darwin64`` mean x86-64 (FMI 2.0.4, 2.3); platform tuples stand for the rest."""
    assert binary_files(2, "m", LIBRARIES) == {
        "binaries/linux64/m.so": b"lx",
        "binaries/aarch64-linux/m.so": b"la",
        "binaries/win64/m.dll": b"w",
        "binaries/darwin64/m.dylib": fat_binary([X86_64, AARCH64]),
        "binaries/aarch64-darwin/m.dylib": AARCH64,
    }


@pytest.mark.parametrize("name", ["aarch64-linux", "aarch64-darwin"])
def test_fmi_2_importers_on_aarch64_search_the_old_folder(name: str) -> None:
    platform = PLATFORMS[name]
    files = binary_files(2, "m", {platform: AARCH64})
    folders = (platform.fmi2_folder, platform.name)
    assert files == {f"binaries/{folder}/m{platform.extension}": AARCH64 for folder in folders}


# -- fat libraries and machine code ----------------------------------------------------------------------------------


def test_slices_of_a_fat_library_lie_on_pages() -> None:
    fat = fat_binary([X86_64, AARCH64])
    assert struct.unpack_from(">II", fat) == (0xCAFEBABE, 2)
    for i, piece in enumerate((X86_64, AARCH64)):
        processor, subtype, offset, size, alignment = struct.unpack_from(">IIIII", fat, 8 + 20 * i)
        assert (processor, subtype) == struct.unpack_from("<II", piece, 4)
        assert fat[offset : offset + size] == piece
        assert offset % 16384 == 0 == offset % 2**alignment
    assert len(fat) == offset + size


@pytest.mark.parametrize("slices", [[X86_64, X86_64], [X86_64, b"\x7fELF" + bytes(60)], [b""]])
def test_what_makes_no_fat_library(slices: list[bytes]) -> None:
    with pytest.raises(ValueError, match="Mach-O"):
        fat_binary(slices)


PE = b"MZ" + bytes(58) + struct.pack("<I", 64) + b"PE\0\0" + struct.pack("<H", 0x8664)


@pytest.mark.parametrize(
    ("content", "platforms"),
    [
        (X86_64, ("x86_64-darwin",)),
        (fat_binary([X86_64, AARCH64]), ("x86_64-darwin", "aarch64-darwin")),
        (PE, ("x86_64-windows",)),
        (b"\x7fELF\x02\x01" + bytes(12) + struct.pack("<H", 183), ("aarch64-linux",)),
        (b"MZ" + bytes(10), ("unknown",)),
        (b"\x7fELF", ("unknown",)),
        (b"#!/bin/sh\n", ("unknown",)),
        (b"", ("unknown",)),
    ],
)
def test_whose_library_it_is(content: bytes, platforms: tuple[str, ...]) -> None:
    assert platforms_of_library(content) == platforms


@given(st.binary(max_size=200), st.sampled_from([b"", b"MZ", b"\x7fELF", b"\xca\xfe\xba\xbe", b"\xcf\xfa\xed\xfe"]))
def test_any_bytes_have_a_response(content: bytes, head: bytes) -> None:
    assert platforms_of_library(head + content)

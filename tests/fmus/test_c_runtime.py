"""The C runtime by itself: its noise is that of Python, it compiles without a warning, it shows only FMI's names."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from ctypes import CDLL, POINTER, c_char_p, c_double, c_uint32, c_uint64
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.build import plan_fmu, runtime_sources
from fmus.toolchain.compile import compile_library, find_compiler, header_folder
from plant_models.hybrid import HybridSystem
from plant_models.hybrid.noise import Purpose, _philox4x32, is_seed, seed_of, standard_normal

pytestmark = pytest.mark.compiler

WORD = st.integers(0, 2**32 - 1)
KNOWN_VALUES = [  # Random123, kat_vectors, philox4x32 10
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.fixture(scope="module")
def noise(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The C file of the noise as a library."""
    folder = tmp_path_factory.mktemp("noise")
    for name in ("noise.c", "noise.h", "private.h"):
        (folder / name).write_bytes(runtime_sources()[name])
    visible = find_compiler()
    command = [
        *visible.command,
        "-shared",
        "-fPIC",
        "-O2",
        "-ffp-contract=off",
        "-DPRIVATE=",
        "noise.c",
        "-o",
        "noise.so",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    library = CDLL(str(folder / "noise.so"))
    library.noise_standard_normal.restype = c_double
    library.noise_standard_normal.argtypes = [c_uint64, c_uint64, c_uint64, c_uint32]
    library.noise_seed_of.restype = c_double
    library.noise_seed_of.argtypes = [c_uint64, c_char_p]
    library.noise_philox4x32.argtypes = [POINTER(c_uint32), c_uint32, c_uint32]
    library.noise_philox4x32.restype = None
    return library


def _philox(library: Any, counter: tuple[int, ...], key: tuple[int, int]) -> tuple[int, ...]:
    words = (c_uint32 * 4)(*counter)
    library.noise_philox4x32(words, *key)
    return tuple(words)


@pytest.mark.parametrize(("counter", "key", "response"), KNOWN_VALUES)
def test_philox_known_values(
    noise: Any, counter: tuple[int, ...], key: tuple[int, int], response: tuple[int, ...]
) -> None:
    assert _philox(noise, counter, key) == response


@given(st.tuples(WORD, WORD, WORD, WORD), st.tuples(WORD, WORD))
def test_philox_is_that_of_python(noise: Any, counter: tuple[int, int, int, int], key: tuple[int, int]) -> None:
    assert _philox(noise, counter, key) == _philox4x32(counter, key)


@given(st.integers(0, 2**53 - 1), st.integers(0, 100), st.integers(0, 2**53), st.sampled_from(Purpose))
def test_normal_numbers_are_those_of_python(noise: Any, seed: int, signal: int, index: int, purpose: Purpose) -> None:
    assert noise.noise_standard_normal(seed, signal, index, purpose) == standard_normal(seed, signal, index, purpose)


@given(st.integers(0, 2**53 - 1), st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
def test_the_seed_of_a_name_is_that_of_python(noise: Any, run_seed: int, name: str) -> None:
    found = seed_of(run_seed, name)
    assert noise.noise_seed_of(run_seed, name.encode()) == found
    assert is_seed(found)


def _write_sources(system: HybridSystem, version: Any, folder: Path) -> list[str]:
    plan = plan_fmu(system, version)
    for name, text in plan.source_files().items():
        (folder / name).write_bytes(text)
    return plan.sources


def test_runtime_compiles_without_a_warning(version: int, tmp_path: Path, reference: Callable[[str], Any]) -> None:
    sources = _write_sources(reference("tracker").system, version, tmp_path)
    (tmp_path / "generated").mkdir()
    (tmp_path / "model.c").rename(tmp_path / "generated" / "model.c")
    # Warnings in system headers are not shown: fmpy's FMI 3 header and CasADi's code are not our business.
    flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wno-sign-conversion", "-Wshadow", "-Werror"]
    foreign = ["-isystem", str(header_folder()), "-isystem", "generated"]
    command = [*find_compiler().command, *flags, "-c", "-I.", *foreign, *sources]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_only_fmi_functions_are_visible(version: int, tmp_path: Path, reference: Callable[[str], Any]) -> None:
    sources = _write_sources(reference("tracker").system, version, tmp_path)
    library = CDLL(str(compile_library(find_compiler(), tmp_path, sources, "tracker.so")))
    header = (header_folder() / f"fmi{version}Functions.h").read_text()
    exported = [line for line in header.splitlines() if line.strip().startswith(f"FMI{version}_Export fmi")]
    declared = {line.split()[-1].rstrip(";") for line in exported}
    assert len(declared) == {2: 44, 3: 75}[version]
    assert {name for name in declared if not hasattr(library, name)} == set()
    own = re.findall(
        r"^\w[\w *]*?\b(\w+)\(",
        "\n".join(
            (tmp_path / n).read_text()
            for n in plan_fmu(reference("tracker").system, version).source_files()
            if n.endswith(".c")
        ),
        flags=re.MULTILINE,
    )
    hidden = {*own, "model"} - declared
    assert {"runtime_advance", "tracker_step", "noise_philox4x32", "instance_create"} <= hidden
    assert {name for name in hidden if hasattr(library, name)} <= {"exp", "cos", "sin"}


def test_nothing_is_writable_data(version: int, tmp_path: Path, reference: Callable[[str], Any]) -> None:
    """No state outside the instances: two of them, or two threads, cannot meet."""
    _write_sources(reference("tracker").system, version, tmp_path)
    for file in tmp_path.iterdir():
        text = file.read_text()
        statics = [
            line for line in text.splitlines() if line.startswith("static ") and line.rstrip().endswith((";", "= {"))
        ]
        assert all("const" in line or "(" in line for line in statics), statics

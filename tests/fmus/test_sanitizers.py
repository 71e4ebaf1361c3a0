"""The C runtime under AddressSanitizer, LeakSanitizer and UndefinedBehaviorSanitizer: a whole life of several models,
in co-simulation and model exchange, and states with damaged bytes."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from c_hosts import SANITIZE, Unpacked, compile_host, run
from life_wirings import MODELS, life_wiring
from shipped import shipped

from fmu_observer.description import can_exchange
from fmus import cached_fmu, recipe
from fmus.toolchain.compile import find_compiler, header_folder

pytestmark = pytest.mark.compiler
Sanitized = Callable[[Unpacked], Path]


@pytest.fixture(scope="module")
def life(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host program, sanitized."""
    return compile_host("life", tmp_path_factory.mktemp("sanitized"), SANITIZE)


@pytest.fixture(scope="module")
def exchange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host program for model exchange, sanitized."""
    return compile_host("exchange", tmp_path_factory.mktemp("sanitized"), SANITIZE)


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Sanitized:
    """The library of an FMU, compiled from the sources it carries; once, however many tests load it."""
    compiled: dict[bytes, Path] = {}

    def library(fmu: Unpacked) -> Path:
        sources = (fmu.folder / "sources" / "all.c").parent
        key = b"".join(path.name.encode() + path.read_bytes() for path in sorted(sources.iterdir()) if path.is_file())
        if key not in compiled:
            target = tmp_path_factory.mktemp("library") / "sanitized.so"
            flags = ["-std=c11", "-O1", "-g", "-fPIC", "-shared", *SANITIZE, f"-I{header_folder()}"]
            run([*find_compiler().command, *flags, str(sources / "all.c"), "-o", str(target), "-lm"])
            compiled[key] = target
        return compiled[key]

    return library


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", [name for name in MODELS if name != "multirate_cdo"])  # like the other observer
def test_a_whole_life_is_clean(name: str, version: int, life: Path, sanitized: Sanitized, tmp_path: Path) -> None:
    fmu = Unpacked.of(cached_fmu(recipe(name), version), tmp_path / name)  # type: ignore[arg-type]
    run([str(life), "cover", str(life_wiring(fmu, tmp_path / "wiring.txt", sanitized(fmu)))])


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["takagi_sugeno_cdo", "balise_reader", "odometer"])
def test_damaged_states_are_refused_or_harmless(
    name: str, version: int, life: Path, sanitized: Sanitized, tmp_path: Path
) -> None:
    """A state is accepted where a damaged word only changes a value; then steps come to an end and touch nothing
    else.
    """
    fmu = Unpacked.of(cached_fmu(recipe(name), version), tmp_path / name)  # type: ignore[arg-type]
    printed = run([str(life), "damage", str(life_wiring(fmu, tmp_path / "wiring.txt", sanitized(fmu)))])
    tried, accepted = map(int, printed.split())
    assert 0 < accepted < tried


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", [name for name in MODELS if can_exchange(shipped(name)) and name != "multirate_cdo"])
def test_model_exchange_is_clean(name: str, version: int, exchange: Path, sanitized: Sanitized, tmp_path: Path) -> None:
    """A run with events and directional derivatives, then damaged states."""
    fmu = Unpacked.of(cached_fmu(recipe(name), version), tmp_path / name)  # type: ignore[arg-type]
    wiring = life_wiring(fmu, tmp_path / "wiring.txt", sanitized(fmu))
    states, indicators = (
        str(n or 0) for n in (fmu.description.numberOfContinuousStates, fmu.description.numberOfEventIndicators)
    )
    stated, tried, accepted = map(int, run([str(exchange), str(wiring), states, indicators]).split())
    assert stated > 0
    assert 0 < accepted < tried


@pytest.mark.parametrize("version", [2, 3])
def test_reading_a_resource_is_clean(version: int, life: Path, sanitized: Sanitized, tmp_path: Path) -> None:
    """Files right and wrong; a refusal leaves nothing open and nothing allocated."""
    system = recipe("balise_reader", layout="positions", balise_capacity=4)
    fmu = Unpacked.of(cached_fmu(system, version), tmp_path / "reader")  # type: ignore[arg-type]
    wiring = life_wiring(fmu, tmp_path / "wiring.txt", sanitized(fmu))
    table = fmu.folder / "resources" / "balises.csv"
    run([str(life), "cover", str(wiring)])
    rows = ["x\n", "2\n1\n", "1\n2\n3\n4\n5\n", "1" * 2000 + "\n"]
    for text in ["", "place\n1\n", *(f"position\n{r}" for r in rows), 'id,position\n"a""b, c\n', "id,position\nonly\n"]:
        table.write_text(text, encoding="utf-8")
        done = subprocess.run([str(life), "cover", str(wiring)], capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert "could not be instantiated" in done.stderr
        assert "balises.csv" in done.stderr
        assert "Sanitizer" not in done.stderr


def test_the_sanitizers_are_awake(tmp_path: Path) -> None:
    """A program with a leak, and one that writes past its end, are found out."""
    overrun = "char *p = malloc(8); p[argc + 7] = 1; free(p);"
    for body, finding in (("malloc(8);", "LeakSanitizer"), (overrun, "AddressSanitizer")):
        source = tmp_path / "wrong.c"
        source.write_text(f"#include <stdlib.h>\nint main(int argc, char **argv) {{ (void)argv; {body} return 0; }}\n")
        run([*find_compiler().command, *SANITIZE, "-O0", "-w", str(source), "-o", str(tmp_path / "wrong")])
        done = subprocess.run([str(tmp_path / "wrong")], capture_output=True, text=True, check=False)
        assert done.returncode != 0
        assert finding in done.stderr

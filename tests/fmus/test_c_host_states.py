"""States that cross from one process into another, and a thousand lives, in a plain C program."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from c_hosts import Unpacked, compile_host, run
from life_wirings import MODELS, life_wiring

from fmus import cached_fmu, recipe

pytestmark = pytest.mark.compiler


@pytest.fixture(scope="module")
def life(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host program."""
    return compile_host("life", tmp_path_factory.mktemp("life"))


@pytest.fixture
def wiring(tmp_path: Path) -> Callable[[str, int], Path]:
    """The wiring of one model alone; the reader with a file that it opens in each of its lives."""

    def make(name: str, version: int) -> Path:
        options = {"layout": "positions"} if name == "balise_reader" else {}
        fmu = Unpacked.of(cached_fmu(recipe(name, **options), version), tmp_path / name)  # type: ignore[arg-type]
        return life_wiring(fmu, tmp_path / f"{name}{version}.txt")

    return make


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", MODELS)
def test_a_state_continues_in_another_process(
    name: str, version: int, life: Path, wiring: Callable[[str, int], Path], tmp_path: Path
) -> None:
    file = wiring(name, version)
    kept = run([str(life), "save", str(file), str(tmp_path / "state")])
    taken_up = run([str(life), "continue", str(file), str(tmp_path / "state")])
    assert taken_up == kept
    assert len(kept.split()) > 1


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["takagi_sugeno_cdo", "balise_reader"])
def test_a_thousand_lives_leave_nothing_behind(
    name: str, version: int, life: Path, wiring: Callable[[str, int], Path]
) -> None:
    lines = run([str(life), "many", str(wiring(name, version)), "1000"]).splitlines()
    (early_memory, early_files), (memory, files) = (map(int, line.split()) for line in lines)
    assert files == early_files
    # What one instance holds, lost in each of the last 900 lives, would be 4 MB at the least; the allocator's own
    # bookkeeping moves by some pages.
    assert memory - early_memory < 256
